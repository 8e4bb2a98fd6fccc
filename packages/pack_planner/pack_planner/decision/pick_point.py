"""Where a box lies when it is grasped (docs/architecture.md, 'Frames and layout')."""

from __future__ import annotations

import math

from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.picking import expected_pick, turn_from
from pack_msgs_py.values import Box

#: Frame `cell`, metres: front face of a box at the pick point, and top of the belt.
FRONT_FACE_Y = 0.55
BELT_Z = 0.75
#: A box that lies farther from there than this is a case of its own for the arm.
ODD_M, ODD_RAD = 0.015, math.radians(4.0)


def pick_pose(box: Box, lies: str = 'xyz') -> Pose:
    """Centre of ``box`` at the pick point, frame `cell`.

    ``lies`` names the axes of the box along those of the frame: a tilt tray may have tipped it.

    >>> pick_pose(Box('a', (300.0, 200.0, 100.0))).position
    (0.0, 0.65, 0.8)
    """
    _, depth, height = oriented_size(box.size_mm, lies)
    centre = (0.0, FRONT_FACE_Y + depth / 2000, BELT_Z + height / 2000)
    return Pose(centre, QUATERNIONS[lies])


def lies_oddly(box: Box, scan: Scan | None) -> bool:
    """Whether the arm will find ``box`` aside or turned: what it refuses then may be due to that.

    A box that a tray has tipped is not looked at.
    """
    nominal = pick_pose(box)
    found = expected_pick(nominal, box.id, scan)
    shift = math.dist(found.position, nominal.position)
    return shift > ODD_M or abs(turn_from(found, nominal)) > ODD_RAD
