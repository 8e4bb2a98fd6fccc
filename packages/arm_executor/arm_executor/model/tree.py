"""The tree of links and joints, from which URDF and transforms both follow.

From `cell` to the pad's face: the rail carries the carriage and its pedestal, on it the arm's six
joints, the mast (`tool`) and the face of the pad (`tcp`). Link frames follow Universal Robots' ROS
description. Metres, radians, quaternions x y z w.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import JOINT_NAMES, RobotModel
from pack_msgs_py.geometry.pose import Pose, about_z, quaternion_product
from pack_msgs_py.values import Vec3

ROOT = 'cell'
RAIL_JOINT = 'rail_joint'
CELL_JOINT_NAMES = (RAIL_JOINT, *JOINT_NAMES)
LINKS = ('base_link', 'shoulder', 'upper_arm', 'forearm', 'wrist_1', 'wrist_2', 'wrist_3')


@dataclass(frozen=True)
class Joint:
    """How ``child`` hangs on ``parent``: moved by ``xyz``, then turned about x by ``roll``.

    ``index`` is the joint's place in a cell configuration (0 the rail, which moves along x; others
    turn about their z), ``None`` when it does not move.
    """

    name: str
    parent: str
    child: str
    xyz: Vec3 = (0.0, 0.0, 0.0)
    roll: float = 0.0
    index: int | None = None

    def transform(self, q: Sequence[float]) -> Pose:
        """Pose of ``child`` in ``parent`` for a cell configuration ``q`` (7,)."""
        if self.index == 0:
            x, y, z = self.xyz
            return Pose((x + q[0], y, z))
        half_roll, turn = self.roll / 2, 0.0 if self.index is None else q[self.index]
        about_x = (math.sin(half_roll), 0.0, 0.0, math.cos(half_roll))
        return Pose(self.xyz, quaternion_product(about_x, about_z(turn)))


def cell_joints(robot: RobotModel, layout: Layout) -> tuple[Joint, ...]:
    """Every joint from `cell` to `tcp`, in order."""
    turn = math.pi / 2
    origins: tuple[tuple[Vec3, float], ...] = (
        ((0.0, 0.0, robot.d1), 0.0),
        ((0.0, 0.0, 0.0), turn),
        ((robot.a2, 0.0, 0.0), 0.0),
        ((robot.a3, 0.0, robot.d4), 0.0),
        ((0.0, -robot.d5, 0.0), turn),
        ((0.0, robot.d6, 0.0), -turn),
    )
    revolute = tuple(
        Joint(name, LINKS[index], LINKS[index + 1], xyz, roll, index + 1)
        for index, (name, (xyz, roll)) in enumerate(zip(JOINT_NAMES, origins, strict=True))
    )
    return (
        Joint(RAIL_JOINT, ROOT, 'carriage', index=0),
        Joint('pedestal', 'carriage', 'base_link', (0.0, 0.0, layout.rail.base_height)),
        *revolute,
        Joint('flange', 'wrist_3', 'tool'),
        Joint('pad_face', 'tool', 'tcp', (0.0, 0.0, layout.tool.length)),
    )
