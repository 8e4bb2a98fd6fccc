"""Where a box lies when it is grasped (docs/architecture.md, 'Frames and layout')."""

from __future__ import annotations

from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box

#: Frame `cell`, metres: front face of a box at the pick point, and top of the belt.
FRONT_FACE_Y = 0.55
BELT_Z = 0.75


def pick_pose(box: Box) -> Pose:
    """Centre of ``box`` at the pick point, frame `cell`; it lies with its axes along the frame's.

    >>> pick_pose(Box('a', (300.0, 200.0, 100.0))).position
    (0.0, 0.65, 0.8)
    """
    _, width, height = box.size_mm
    return Pose((0.0, FRONT_FACE_Y + width / 2000, BELT_Z + height / 2000))
