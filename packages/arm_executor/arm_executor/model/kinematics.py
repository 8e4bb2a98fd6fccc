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

from arm_executor.model.compiled_kinematics import frames_of, solutions_of
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel

Array = NDArray[np.float64]

#: Inverse kinematics branches: shoulder, wrist and elbow sign of each of the eight columns.
BRANCHES = tuple((s, w, e) for s in (1, -1) for w in (1, -1) for e in (1, -1))
#: Shoulder, wrist and elbow that the arm begins with: with the wrist on this side it reaches all of
#: a roller cage.
HOME_POSTURE = (1, -1, 1)
_SIGNS = np.array(BRANCHES, dtype=np.float64)

#: Cosine and sine of the twist of each joint.
_TURNS = np.array([(0.0, 1.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0)])


def link_frames(robot: RobotModel, q: ArrayLike) -> Array:
    """Denavit-Hartenberg frames 1 to 6 for joint angles ``q`` (..., 6), shape (..., 6, 4, 4)."""
    angles = np.asarray(q, dtype=float)
    rows = np.ascontiguousarray(angles.reshape(-1, 6))
    frames: Array = frames_of(_lengths(robot), _TURNS, rows)
    return frames.reshape(*angles.shape[:-1], 6, 4, 4)


def _lengths(robot: RobotModel) -> Array:
    return np.array([robot.d1, robot.a2, robot.a3, robot.d4, robot.d5, robot.d6])


def forward(robot: RobotModel, q: ArrayLike) -> Array:
    """Flange pose (..., 4, 4) in the arm's base frame for joint angles ``q`` (..., 6)."""
    flange: Array = link_frames(robot, q)[..., 5, :, :]
    return flange


def inverse(robot: RobotModel, pose: ArrayLike, branches: Sequence[int] = range(8)) -> Array:
    """Solutions for flange poses (n, 4, 4), shape (n, 8, 6); NaN where there is none.

    Columns follow :data:`BRANCHES`; those not asked for are NaN. Angles are in (-pi, pi].
    """
    target = np.ascontiguousarray(pose, dtype=float).reshape(-1, 4, 4)
    found: Array = solutions_of(_lengths(robot), target, _SIGNS, np.array(branches, dtype=np.int64))
    return found


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
