"""Forward and inverse kinematics in closed form, for many configurations at once.

Conventions: the arm's own base frame is the Denavit-Hartenberg base, its flange frame frame 6 of
the table. Joint angles are radians in the order of
:data:`arm_executor.model.robot_data.JOINT_NAMES`.
Configurations of the whole cell have seven values, the rail's x in metres first.
Inverse kinematics after K. P. Hawkins, 'Analytic inverse kinematics for the Universal Robots
UR-5/UR-10 arms' (2013), rewritten for arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel
from pack_msgs_py.geometry.pose import Quaternion

Array = NDArray[np.float64]

#: Inverse kinematics branches: shoulder, wrist and elbow sign of each of the eight columns.
BRANCHES = tuple((s, w, e) for s in (1, -1) for w in (1, -1) for e in (1, -1))
#: Shoulder, wrist and elbow that the arm begins with: with the wrist on this side it reaches all of
#: a roller cage.
HOME_POSTURE = (1, -1, 1)

_TWIST = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)


def link_frames(robot: RobotModel, q: ArrayLike) -> Array:
    """Denavit-Hartenberg frames 1 to 6 for joint angles ``q`` (..., 6), shape (..., 6, 4, 4)."""
    angles = np.asarray(q, dtype=float)
    offsets = (robot.d1, 0.0, 0.0, robot.d4, robot.d5, robot.d6)
    lengths = (0.0, robot.a2, robot.a3, 0.0, 0.0, 0.0)
    frames = np.empty((*angles.shape[:-1], 6, 4, 4))
    total = np.broadcast_to(np.eye(4), (*angles.shape[:-1], 4, 4))
    for i in range(6):
        cosine, sine = np.cos(angles[..., i]), np.sin(angles[..., i])
        ca, sa = math.cos(_TWIST[i]), math.sin(_TWIST[i])
        step = np.zeros((*angles.shape[:-1], 4, 4))
        step[..., 0, 0], step[..., 0, 1], step[..., 0, 2] = cosine, -sine * ca, sine * sa
        step[..., 1, 0], step[..., 1, 1], step[..., 1, 2] = sine, cosine * ca, -cosine * sa
        step[..., 2, 1], step[..., 2, 2] = sa, ca
        step[..., 0, 3], step[..., 1, 3] = lengths[i] * cosine, lengths[i] * sine
        step[..., 2, 3], step[..., 3, 3] = offsets[i], 1.0
        total = total @ step
        frames[..., i, :, :] = total
    return frames


def forward(robot: RobotModel, q: ArrayLike) -> Array:
    """Flange pose (..., 4, 4) in the arm's base frame for joint angles ``q`` (..., 6)."""
    flange: Array = link_frames(robot, q)[..., 5, :, :]
    return flange


def inverse(robot: RobotModel, pose: ArrayLike, branches: Sequence[int] = range(8)) -> Array:
    """Solutions for flange poses (n, 4, 4), shape (n, 8, 6); NaN where there is none.

    Columns follow :data:`BRANCHES`; those not asked for are NaN. Angles are in (-pi, pi].
    """
    target = np.asarray(pose, dtype=float).reshape(-1, 4, 4)
    position, rotation = target[:, :3, 3], target[:, :3, :3]
    wrist = position - robot.d6 * rotation[:, :, 2]
    radius = np.hypot(wrist[:, 0], wrist[:, 1])
    solutions = np.full((len(target), 8, 6), np.nan)
    with np.errstate(invalid='ignore', divide='ignore'):
        spread = np.arccos(robot.d4 / radius)
        heading = np.arctan2(wrist[:, 1], wrist[:, 0])
        for column in branches:
            shoulder, flip, elbow = BRANCHES[column]
            q1 = heading + shoulder * spread + math.pi / 2
            solutions[:, column] = _one_branch(robot, position, rotation, q1, flip, elbow)
    solutions = -((math.pi - solutions) % (2 * math.pi) - math.pi)
    solutions[np.isnan(solutions).any(axis=2)] = np.nan
    return solutions


def _one_branch(
    robot: RobotModel, position: Array, rotation: Array, q1: Array, flip: int, elbow: int
) -> Array:
    """Joint angles (n, 6) for a given ``q1`` (n,) and the signs of wrist and elbow."""
    c1, s1 = np.cos(q1), np.sin(q1)
    c5 = (position[:, 0] * s1 - position[:, 1] * c1 - robot.d4) / robot.d6
    c5 = np.where(np.abs(c5) < 1 + 1e-9, np.clip(c5, -1, 1), np.nan)
    q5 = flip * np.arccos(c5)
    s5 = np.sin(q5)
    # Rows of the arm plane's frame: along the arm, up, and its normal.
    along = np.stack([c1, s1, np.zeros_like(c1)], axis=1)
    normal = np.stack([s1, -c1, np.zeros_like(c1)], axis=1)
    on_normal = np.einsum('ni,nij->nj', normal, rotation)
    on_along = np.einsum('ni,nij->nj', along, rotation)
    q6 = np.arctan2(-on_normal[:, 1] / s5, on_normal[:, 0] / s5)
    c6, s6 = np.cos(q6), np.sin(q6)
    # Axis x of frame 4, and so q2 + q3 + q4, by undoing joints 6 and 5.
    x_of_5_along = on_along[:, 0] * c6 - on_along[:, 1] * s6
    x_of_5_up = rotation[:, 2, 0] * c6 - rotation[:, 2, 1] * s6
    y_of_5_along = on_along[:, 0] * s6 + on_along[:, 1] * c6
    y_of_5_up = rotation[:, 2, 0] * s6 + rotation[:, 2, 1] * c6
    x_along = x_of_5_along * c5 - on_along[:, 2] * s5
    x_up = x_of_5_up * c5 - rotation[:, 2, 2] * s5
    q234 = np.arctan2(x_up, x_along)
    # Frame 5's y is the direction of d5 reversed; go back from the flange to joint 4.
    px = (
        np.einsum('ni,ni->n', along, position) - robot.d6 * on_along[:, 2] + robot.d5 * y_of_5_along
    )
    py = position[:, 2] - robot.d1 - robot.d6 * rotation[:, 2, 2] + robot.d5 * y_of_5_up
    c3 = (px * px + py * py - robot.a2**2 - robot.a3**2) / (2 * robot.a2 * robot.a3)
    c3 = np.where(np.abs(c3) <= 1, c3, np.nan)
    q3 = elbow * np.arccos(c3)
    q2 = np.arctan2(py, px) - np.arctan2(robot.a3 * np.sin(q3), robot.a2 + robot.a3 * np.cos(q3))
    return np.stack([q1, q2, q3, q234 - q2 - q3, q5, q6], axis=1)


@dataclass(frozen=True)
class CellKinematics:
    """The arm on its rail with its mast, in frame `cell`."""

    robot: RobotModel
    layout: Layout

    def tool(self, q: ArrayLike) -> Array:
        """Pose (n, 4, 4) of the pad's face for configurations (n, 7), frame `cell`."""
        config = np.atleast_2d(np.asarray(q, dtype=float))
        pose = forward(self.robot, config[:, 1:])
        pose[:, :3, 3] += self.layout.tool.length * pose[:, :3, 2]
        pose[:, 0, 3] += config[:, 0]
        pose[:, 2, 3] += self.layout.rail.base_height
        return pose

    def tool_down(
        self,
        rail: ArrayLike,
        xyz: ArrayLike,
        yaw: ArrayLike,
        branches: Sequence[int] = range(8),
    ) -> Array:
        """Configurations (n, 8, 7) with the pad at ``xyz`` (n, 3) facing down, turned by ``yaw``.

        ``rail`` (n,) is where the arm stands. The pad's axes are the `cell` axes turned about z by
        ``yaw`` (n,), then about its own x by pi. NaN where there is no solution.
        """
        x = np.asarray(rail, dtype=float)
        point = np.atleast_2d(np.asarray(xyz, dtype=float))
        turn = np.broadcast_to(np.asarray(yaw, dtype=float), x.shape)
        cosine, sine = np.cos(turn), np.sin(turn)
        pose = np.zeros((len(point), 4, 4))
        pose[:, 0, 0], pose[:, 0, 1] = cosine, sine
        pose[:, 1, 0], pose[:, 1, 1] = sine, -cosine
        pose[:, 2, 2], pose[:, 3, 3] = -1.0, 1.0
        pose[:, :3, 3] = point
        pose[:, 0, 3] -= x
        pose[:, 2, 3] += self.layout.tool.length - self.layout.rail.base_height
        config = np.empty((len(point), 8, 7))
        config[:, :, 0] = x[:, None]
        config[:, :, 1:] = inverse(self.robot, pose, branches)
        return config

    def tool_ahead(self, rail: ArrayLike, xyz: ArrayLike, yaw: float = 0.0) -> Array:
        """Configurations (n, 8, 7) with the tool level, the pad at ``xyz`` (n, 3) facing +y.

        Both are then turned by ``yaw`` about the vertical. The pad's x is level; otherwise as
        :meth:`tool_down`.
        """
        x = np.asarray(rail, dtype=float)
        point = np.atleast_2d(np.asarray(xyz, dtype=float))
        pose = np.zeros((len(point), 4, 4))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        pose[:, :3, 0] = (cosine, sine, 0.0)
        pose[:, :3, 1] = (0.0, 0.0, -1.0)
        pose[:, :3, 2] = (-sine, cosine, 0.0)
        pose[:, 3, 3] = 1.0
        pose[:, :3, 3] = point - self.layout.tool.length * pose[:, :3, 2]
        pose[:, 0, 3] -= x
        pose[:, 2, 3] -= self.layout.rail.base_height
        config = np.empty((len(point), 8, 7))
        config[:, :, 0] = x[:, None]
        config[:, :, 1:] = inverse(self.robot, pose)
        return config


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
