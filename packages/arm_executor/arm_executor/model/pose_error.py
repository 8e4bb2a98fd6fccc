"""How far apart two poses of one box are. Metres, radians, quaternions x y z w."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.cell_values import Pose, Quaternion
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

_SIGNS = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


def rotation(quaternion: Quaternion) -> Array:
    """Rotation matrix (3, 3)."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def corners(pose: Pose, size: Vec3) -> Array:
    """The eight corners (8, 3) of a box of ``size`` with its centre at ``pose``."""
    result: Array = (_SIGNS * np.array(size)) @ rotation(pose.quaternion).T + np.array(
        pose.position
    )
    return result


def corner_distance(one: Pose, other: Pose, size: Vec3) -> float:
    """Largest distance between corresponding corners of a box in two poses."""
    away = corners(one, size) - corners(other, size)
    return float(np.linalg.norm(away, axis=1).max())


def turn_between(one: Pose, other: Pose) -> float:
    """Angle between two orientations, 0 to pi."""
    dot = abs(sum(a * b for a, b in zip(one.quaternion, other.quaternion, strict=True)))
    return 2 * math.acos(min(1.0, dot))


def folded(pose: Pose, near: Pose) -> Pose:
    """``pose`` or the same turned by half a turn about the box's own z, whichever is nearer.

    A box turned so fills the same space, and the arm may place it either way round.
    """
    x, y, z, w = pose.quaternion
    half_turned = Pose(pose.position, (y, -x, w, -z))
    return min((pose, half_turned), key=lambda one: turn_between(one, near))
