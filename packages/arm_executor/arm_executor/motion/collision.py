"""The planning world: would this configuration touch anything?

A second physics client that never steps. The arm is set to a configuration, the carried box is
hung under its pad, and the contacts are read.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np
import pybullet
from numpy.typing import NDArray

from arm_executor.model import bullet
from arm_executor.model.layout import Block, Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.model.rotations import quaternions_of
from arm_executor.model.urdf import cell_urdf
from arm_executor.motion.obstacle_world import (
    ARM_MARGIN,
    BOX_MARGIN,
    BOX_SKIN,
    PAD_MARGIN,
    WIDE_FROM,
    WIDE_MARGIN,
)
from arm_executor.motion.path import JointPath
from arm_executor.motion.swing import Obstacles
from pack_msgs_py.geometry.pose import Pose, extent
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Links this many joints apart cannot meet, or always touch.
_NEIGHBOUR_LINKS = 2
_TOOL_LINKS = ('tool', 'tcp')
#: Collision groups of the carried box and of the tool, which do not meet; nor does the box meet
#: its own other size.
_HELD_GROUP, _TOOL_GROUP = 64, 128
#: Where the carried box is while it is not checked.
_ASIDE = Pose((0.0, 0.0, 9.0))


class PlanningWorld:
    """Fixed obstacles by key, the arm, and one carried box."""

    def __init__(self, robot: RobotModel, layout: Layout) -> None:
        self._client = bullet.connect()
        tool = replace(layout.tool, pad_edge=layout.tool.pad_edge + 2 * PAD_MARGIN)
        urdf = cell_urdf(robot, replace(layout, tool=tool))
        self._robot = bullet.load_robot(self._client, urdf, self_collision=True)
        self._joints = bullet.joint_indices(self._client, self._robot)
        self._links = bullet.link_names(self._client, self._robot)
        self._tool = {n for n, name in self._links.items() if name in _TOOL_LINKS}
        for link in self._tool:
            bullet.set_groups(self._client, self._robot, link, _TOOL_GROUP, ~_HELD_GROUP)
        for link in self._links:
            for other in self._links:
                if abs(link - other) <= _NEIGHBOUR_LINKS:
                    pybullet.setCollisionFilterPair(
                        self._robot, self._robot, link, other, 0, physicsClientId=self._client
                    )
        self._bodies: dict[str, tuple[int, object, tuple[Vec3, Vec3]]] = {}
        self._names: dict[int, str] = {self._robot: 'arm'}
        self._held: dict[str, int] = {}
        self.held_size: Vec3 = (0.0, 0.0, 0.0)

    def set_block(self, block: Block) -> None:
        """Add a fixed obstacle under its own name."""
        self.set_box(block.name, block.size, Pose(block.centre))

    def set_box(self, name: str, size: Vec3, pose: Pose) -> None:
        """Add an obstacle called ``name``, or move it."""
        if name in self._bodies:
            if self._bodies[name][1] == (size, pose):
                return
            self.remove(name)
        body = bullet.add_box(self._client, size, pose)
        self._bodies[name] = (body, (size, pose), extent(pose, size))
        self._names[body] = name

    def obstacles(self, without: Collection[str] = ()) -> Obstacles:
        """Extents of all obstacles but those called one of ``without``."""
        spans = [body[2] for name, body in self._bodies.items() if name not in without]
        low, high = (np.array([span[end] for span in spans]).reshape(-1, 3) for end in (0, 1))
        return Obstacles(low, high)

    def remove(self, name: str) -> None:
        """Take an obstacle away; one that is not there is fine."""
        entry = self._bodies.pop(name, None)
        if entry is not None:
            pybullet.removeBody(entry[0], physicsClientId=self._client)
            del self._names[entry[0]]

    def hold(self, size: Vec3, name: str) -> None:
        """Hang a box of ``size`` under the pad for the coming checks."""
        self.drop()
        length, breadth = (edge + 2 * BOX_MARGIN for edge in size[:2])
        skinned = (length, breadth, max(size[2] - 2 * BOX_SKIN, size[2] / 4))
        # Dynamic on purpose: two fixed bodies are never checked against each other.
        x, y, z = (edge + 2 * WIDE_MARGIN for edge in size)
        for key, body_size in (('close', skinned), ('wide', (x, y, z))):
            body = bullet.add_box(self._client, body_size, _ASIDE, mass=0.1)
            self._held[key] = body
            self._names[body] = name
            # Not by pairs of bodies: such a rule would outlive this body, see `bullet`.
            mask = ~(_HELD_GROUP | _TOOL_GROUP)
            bullet.set_groups(self._client, body, -1, _HELD_GROUP, mask)
        self.held_size = size

    def drop(self) -> None:
        """Take the carried box away."""
        for body in self._held.values():
            pybullet.removeBody(body, physicsClientId=self._client)
            del self._names[body]
        self._held.clear()

    def first_hit(self, path: JointPath, box_turn: float | None = None) -> str | None:
        """What touches what along ``path``, or ``None`` when nothing does.

        ``box_turn`` is the carried box's yaw relative to the pad's; ``None`` when the pad is empty.
        Samples are visited coarse to fine, since most collisions are long.
        """
        carried = bool(self._held) and box_turn is not None
        for body in self._held.values():
            bullet.move_box(self._client, body, _ASIDE)
        away = np.minimum(
            np.hypot(*(path.tcp - path.tcp[0])[:, :2].T),
            np.hypot(*(path.tcp - path.tcp[-1])[:, :2].T),
        )
        for index in _coarse_to_fine(len(path.q)):
            held = -1
            if carried and box_turn is not None:
                held = self._held['wide' if away[index] > WIDE_FROM else 'close']
                x, y, z = (float(value) for value in path.tcp[index])
                half = 0.5 * (float(path.yaw[index]) + box_turn)
                pybullet.resetBasePositionAndOrientation(
                    held,
                    (x, y, z - self.held_size[2] / 2),
                    (0.0, 0.0, np.sin(half), np.cos(half)),
                    physicsClientId=self._client,
                )
            hit = self._hit_at(path.q[index], held)
            if hit is not None:
                return hit
        return None

    def first_hit_tilted(self, q: Array, tool: Array) -> str | None:
        """Like :meth:`first_hit` for a box held in front of a tool that tilts on its way.

        ``tool`` (n, 4, 4) is the pose of the pad's face at ``q`` (n, 7). The box's own z points
        out of the pad, turned about its x by half a turn.
        """
        for body in self._held.values():
            bullet.move_box(self._client, body, _ASIDE)
        depth = self.held_size[2]
        away = np.linalg.norm(tool[:, :3, 3] - tool[0, :3, 3], axis=1)
        beside = np.hypot(*(tool[:, :2, 3] - tool[-1, :2, 3]).T)
        turns = quaternions_of(tool[:, :3, :3])
        centres = (tool[:, :3, 3] + tool[:, :3, 2] * depth / 2).tolist()
        for index in _coarse_to_fine(len(q)):
            if away[index] < WIDE_FROM:
                continue
            held = self._held['wide' if beside[index] > WIDE_FROM else 'close']
            pybullet.resetBasePositionAndOrientation(
                held, centres[index], turns[index], physicsClientId=self._client
            )
            hit = self._hit_at(q[index], held)
            if hit is not None:
                return hit
        return None

    def _hit_at(self, q: Array, held: int) -> str | None:
        # One call for all joints: each call of the single one updates every link.
        pybullet.resetJointStatesMultiDof(
            self._robot, self._joints, [[value] for value in q], physicsClientId=self._client
        )
        pybullet.performCollisionDetection(physicsClientId=self._client)
        idle = [body for body in self._held.values() if body != held]
        for contact in pybullet.getContactPoints(bodyA=self._robot, physicsClientId=self._client):
            _, _, other, link, other_link, *_ = contact
            distance = contact[8]
            if other in idle:
                continue
            if other == held:
                margin = ARM_MARGIN
            elif other == self._robot:
                margin = 0.0
            else:
                margin = 0.0 if link in self._tool else ARM_MARGIN
            if distance < margin:
                what = self._links[other_link] if other == self._robot else self._names[other]
                return f'{self._links[link]} and {what}'
        if held >= 0:
            contacts = pybullet.getContactPoints(bodyA=held, physicsClientId=self._client)
            for contact in contacts:
                if contact[2] != self._robot and contact[2] not in idle and contact[8] < 0.0:
                    return f'{self._names[held]} and {self._names[contact[2]]}'
        return None

    def names(self) -> Iterable[str]:
        """Names of the obstacles."""
        return tuple(self._bodies)

    def close(self) -> None:
        """End the client."""
        pybullet.disconnect(physicsClientId=self._client)


def _coarse_to_fine(count: int) -> list[int]:
    order = list(range(0, count, 8))
    order += range(4, count, 8)
    order += range(2, count, 4)
    order += range(1, count, 2)
    return order
