"""The tree of links and joints, from which URDF and transforms both follow.

From `cell` to the pad's face: the rail carries the carriage and its pedestal, on it the arm's six
joints, the mast (`tool`) and the face of the pad (`tcp`). Links and frames are named and lie as in
Universal Robots' ROS description. Metres, radians, quaternions x y z w.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import JOINT_NAMES, RobotModel
from pack_msgs_py.geometry.pose import Pose, about_z, quaternion_product
from pack_msgs_py.values import Vec3

ROOT = 'cell'
RAIL_JOINT = 'rail_joint'
CELL_JOINT_NAMES = (RAIL_JOINT, *JOINT_NAMES)
LINKS = (
    'base_link_inertia', 'shoulder_link', 'upper_arm_link', 'forearm_link', 'wrist_1_link',
    'wrist_2_link', 'wrist_3_link',
)  # fmt: skip
#: Frames of the description beside its links, which weigh nothing and have no shape.
BARE_FRAMES = ('base_link', 'base', 'flange', 'tool0')
_QUARTER = math.pi / 2


@dataclass(frozen=True)
class Joint:
    """How ``child`` hangs on ``parent``: moved by ``xyz``, then turned by ``rpy``, as in a URDF.

    ``index`` is the joint's place in a cell configuration (0 the rail, which moves along x; others
    turn about their z), ``None`` when it does not move.
    """

    name: str
    parent: str
    child: str
    xyz: Vec3 = (0.0, 0.0, 0.0)
    rpy: Vec3 = (0.0, 0.0, 0.0)
    index: int | None = None

    def transform(self, q: Sequence[float]) -> Pose:
        """Pose of ``child`` in ``parent`` for a cell configuration ``q`` (7,)."""
        if self.index == 0:
            x, y, z = self.xyz
            return Pose((x + q[0], y, z))
        roll, pitch, yaw = self.rpy
        turn = 0.0 if self.index is None else q[self.index]
        about_x = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
        about_y = (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))
        fixed = quaternion_product(about_z(yaw), quaternion_product(about_y, about_x))
        return Pose(self.xyz, quaternion_product(fixed, about_z(turn)))


def cell_joints(robot: RobotModel, layout: Layout) -> tuple[Joint, ...]:
    """Every joint from `cell` to `tcp`, in order, without :data:`BARE_FRAMES`."""
    turn = _QUARTER
    origins: tuple[tuple[Vec3, float], ...] = (
        ((0.0, 0.0, robot.d1), 0.0),
        ((0.0, 0.0, 0.0), turn),
        ((robot.a2, 0.0, 0.0), 0.0),
        ((robot.a3, 0.0, robot.d4), 0.0),
        ((0.0, -robot.d5, 0.0), turn),
        ((0.0, robot.d6, 0.0), -turn),
    )
    revolute = tuple(
        Joint(name, LINKS[index], LINKS[index + 1], xyz, (roll, 0.0, 0.0), index + 1)
        for index, (name, (xyz, roll)) in enumerate(zip(JOINT_NAMES, origins, strict=True))
    )
    return (
        Joint(RAIL_JOINT, ROOT, 'carriage', index=0),
        Joint('pedestal', 'carriage', LINKS[0], (0.0, 0.0, layout.rail.base_height)),
        *revolute,
        Joint('flange', LINKS[-1], 'tool'),
        Joint('pad_face', 'tool', 'tcp', (0.0, 0.0, layout.tool.length)),
    )


def described_joints(robot: RobotModel, layout: Layout) -> tuple[Joint, ...]:
    """The same with :data:`BARE_FRAMES` in between, as in the description of Universal Robots.

    `base_link` and the controller's `base` face away from each other (REP 199), and `flange` and
    `tool0` are one place with other axes.
    """
    joints: list[Joint] = []
    for joint in cell_joints(robot, layout):
        if joint.child == LINKS[0]:
            half_turn = (0.0, 0.0, math.pi)
            joints += [
                replace(joint, child='base_link', rpy=half_turn),
                Joint('base_link-base_fixed_joint', 'base_link', 'base', rpy=half_turn),
                Joint('base_link-base_link_inertia', 'base_link', LINKS[0], rpy=half_turn),
            ]
        elif joint.child == 'tool':
            joints += [
                Joint('wrist_3-flange', LINKS[-1], 'flange', rpy=(0.0, -_QUARTER, -_QUARTER)),
                Joint('flange-tool0', 'flange', 'tool0', rpy=(_QUARTER, 0.0, _QUARTER)),
                replace(joint, parent='tool0', name='tool0-tool'),
            ]
        else:
            joints.append(joint)
    return tuple(joints)
