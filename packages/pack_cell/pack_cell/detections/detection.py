"""One detection: what it may be, and how the box lies that it is about."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.geometry.pose import (
    HALF_TURNS,
    NO_TURN,
    Pose,
    conjugate,
    quaternion_product,
    turn_between,
)
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.values import Vec3


@dataclass(frozen=True)
class Detection:
    """A box that a camera sees.

    Attributes
    ----------
    id : the same for the same box in every image.
    class_id : what the box is taken for: its article.
    score : how sure that is, 0 to 1.
    pose : of its centre, frame `cell`.
    size_mm : edges along the axes of the pose.
    """

    id: str
    class_id: str
    score: float
    pose: Pose
    size_mm: Vec3


def as_it_lies(pose: Pose, size_mm: Vec3) -> tuple[Pose, Vec3]:
    """The same box with its axes named as the cell does: z up, x and y as near as can be.

    A detector names the axes of a bounding box as it likes, and otherwise in the next image.

    >>> as_it_lies(Pose((0.0, 0.0, 0.0), QUATERNIONS['zxy']), (100.0, 200.0, 300.0))[1]
    (300.0, 100.0, 200.0)
    """
    best, best_turn, best_size = pose, float('inf'), size_mm
    for orientation, turn in QUATERNIONS.items():
        named = quaternion_product(pose.quaternion, conjugate(turn))
        for flip in (NO_TURN, *HALF_TURNS):
            turned = Pose(pose.position, quaternion_product(named, flip))
            away = turn_between(turned, Pose())
            if away < best_turn - 1e-9:
                best, best_turn, best_size = turned, away, oriented_size(size_mm, orientation)
    return best, best_size
