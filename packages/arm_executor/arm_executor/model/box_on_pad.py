"""A box in the gripper, as viewers show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.rotations import quaternions_of
from pack_msgs_py.cell_values import ScannedBox
from pack_msgs_py.geometry.pose import Pose, rotation_matrix
from pack_msgs_py.values import Box

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BoxOnPad:
    """A box in the gripper, and its centre in frame `tcp`."""

    box: Box
    pose: Pose


def held_by_pad(scanned: ScannedBox, pad: Array) -> BoxOnPad:
    """``scanned`` on a pad with the rotation ``pad`` (3, 3) in `cell`.

    Square to the pad, with the face on it that was taken: the arm has moved on a little since.
    """
    relative = pad.T @ np.array(rotation_matrix(scanned.pose.quaternion))
    columns = np.zeros((3, 3))
    for row in range(2, -1, -1):
        free = np.abs(relative[row]) * (columns.any(axis=0) == 0)
        columns[row, free.argmax()] = np.copysign(1.0, relative[row, free.argmax()])
    if np.linalg.det(columns) < 0:
        columns[0] *= -1
    depth = float(np.abs(columns[2]) @ np.array(scanned.box.size_mm)) / 2000
    return BoxOnPad(scanned.box, Pose((0.0, 0.0, depth), quaternions_of(columns[None])[0]))
