"""Rotations in the other of their two forms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.geometry.pose import Quaternion

Array = NDArray[np.float64]


def quaternions_of(turns: Array) -> list[Quaternion]:
    """Quaternions (x, y, z, w) of rotation matrices (n, 3, 3).

    The eigenvector of the largest eigenvalue (Bar-Itzhack, 2000) has no singular cases.
    """
    m = np.moveaxis(turns, 0, -1)
    table = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    _, vectors = np.linalg.eigh(np.moveaxis(table, -1, 0))
    return [(x, y, z, w) for x, y, z, w in vectors[:, :, -1].tolist()]
