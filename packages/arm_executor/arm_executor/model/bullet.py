"""The few PyBullet calls that physics and planning share. Metres, kilograms, quaternions x y z w.

PyBullet has no type information; this module, `world` and `motion.collision` are the only ones that
call it.

A rule about a pair of bodies (`setCollisionFilterPair`) outlives them: PyBullet keeps it by their
numbers and gives the numbers of removed bodies out again. So bodies that go are removed by
:func:`remove`, which lifts the rules about them, or have groups of their own instead of rules.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable
from pathlib import Path

import pybullet

from arm_executor.model.layout import Block
from arm_executor.model.tree import CELL_JOINT_NAMES
from pack_msgs_py.geometry.pose import NO_TURN, Pose
from pack_msgs_py.values import Vec3

_WITH_MASS = (
    r'<link name="\1"><inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
)


def connect() -> int:
    """Start a physics client inside this process; its number."""
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        msg = 'PyBullet could not start a physics client in this process'
        raise RuntimeError(msg)
    return client


def load_robot(client: int, urdf: str, self_collision: bool = False) -> int:
    """Body number of the robot described by ``urdf``, its root fixed to the world."""
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL
    if self_collision:
        flags |= pybullet.URDF_USE_SELF_COLLISION
    with tempfile.TemporaryDirectory(prefix='arm_executor_') as folder:
        path = Path(folder, 'cell.urdf')
        # A frame without inertia is right for ROS and a warning on the console for PyBullet.
        text = re.sub(r'<link name="(\w+)"\s*/>', _WITH_MASS, urdf)
        path.write_text(text, encoding='utf-8')
        robot: int = pybullet.loadURDF(
            str(path), useFixedBase=True, flags=flags, physicsClientId=client
        )
    return robot


def joint_indices(client: int, robot: int) -> tuple[int, ...]:
    """PyBullet's joint numbers of :data:`CELL_JOINT_NAMES`, in that order."""
    numbers = {name: number for number, name in joint_names(client, robot).items()}
    return tuple(numbers[name] for name in CELL_JOINT_NAMES)


def link_names(client: int, robot: int) -> dict[int, str]:
    """Link name by PyBullet's link number; -1 is the root."""
    names = {-1: 'cell'}
    for joint in range(pybullet.getNumJoints(robot, physicsClientId=client)):
        info = pybullet.getJointInfo(robot, joint, physicsClientId=client)
        names[joint] = info[12].decode()
    return names


def joint_names(client: int, robot: int) -> dict[int, str]:
    """Joint name by PyBullet's joint number."""
    count = pybullet.getNumJoints(robot, physicsClientId=client)
    return {
        joint: pybullet.getJointInfo(robot, joint, physicsClientId=client)[1].decode()
        for joint in range(count)
    }


def add_block(
    client: int, block: Block, colour: tuple[float, float, float, float] | None = None
) -> int:
    """A fixed block; visible when it has a ``colour``."""
    return add_box(client, block.size, Pose(block.centre), colour=colour)


def add_box(
    client: int,
    size: Vec3,
    pose: Pose,
    mass: float = 0.0,
    com_offset: Vec3 = (0.0, 0.0, 0.0),
    colour: tuple[float, float, float, float] | None = None,
    collides: bool = True,
) -> int:
    """A box in the physics client ``client``; returns its number.

    Parameters
    ----------
    size : edge lengths, metres.
    pose : of its geometric centre, frame `cell`.
    mass : kilograms; 0 for a box that is fixed where it is.
    com_offset : of its centre of mass from the geometric one, along its own axes, metres.
    colour : red, green, blue and opacity, 0 to 1; without it the box is not to be seen.
    collides : whether anything can touch it.
    """
    half = [edge / 2 for edge in size]
    shape = visual = -1
    # Shapes are placed in the link frame, which we keep at the geometric centre.
    if collides:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client
        )
    if colour is not None:
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=colour, physicsClientId=client
        )
    body: int = pybullet.createMultiBody(
        baseMass=mass,
        baseCollisionShapeIndex=shape,
        baseVisualShapeIndex=visual,
        baseInertialFramePosition=list(com_offset),
        physicsClientId=client,
    )
    move_box(client, body, pose, com_offset)
    return body


def set_groups(client: int, body: int, link: int, group: int, mask: int) -> None:
    """A link of ``body`` is in ``group`` and meets only groups of ``mask``, bit by bit.

    Link -1 is the base. For two bodies not to meet, neither may be in a group that the mask of the
    other has.
    """
    pybullet.setCollisionFilterGroupMask(body, link, group, mask, physicsClientId=client)


def remove(client: int, body: int, robot: int, links: Iterable[int]) -> None:
    """Remove a body that ``links`` of the ``robot`` may have been told not to meet."""
    for link in links:
        pybullet.setCollisionFilterPair(robot, body, link, -1, 1, physicsClientId=client)
    pybullet.removeBody(body, physicsClientId=client)


def move_box(client: int, body: int, pose: Pose, com_offset: Vec3 = (0.0, 0.0, 0.0)) -> None:
    """Put the geometric centre of ``body`` at ``pose``."""
    mass_centre, _ = pybullet.multiplyTransforms(
        pose.position, pose.quaternion, com_offset, NO_TURN
    )
    pybullet.resetBasePositionAndOrientation(
        body, mass_centre, pose.quaternion, physicsClientId=client
    )


def box_pose(client: int, body: int, com_offset: Vec3 = (0.0, 0.0, 0.0)) -> Pose:
    """Pose of the geometric centre of ``body``."""
    mass_centre, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    back = (-com_offset[0], -com_offset[1], -com_offset[2])
    centre, _ = pybullet.multiplyTransforms(mass_centre, quaternion, back, NO_TURN)
    return Pose(tuple(centre), tuple(quaternion))
