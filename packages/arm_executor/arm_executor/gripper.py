"""The suction gripper: a pad that holds what it touches.

Holding is a fixed constraint at the measured relative pose, so that nothing jumps when the pad
takes hold. Metres, frame `cell`.
"""

from __future__ import annotations

import math

import pybullet

from arm_executor.world import PhysicsWorld
from pack_msgs_py.cell_values import Pose

#: The bellows' lip seals up to this distance between pad and box, metres.
SEAL_DISTANCE = 0.002
#: The box slipped, or the pad let go, when it moved this far under the pad, metres.
SLIP_DISTANCE = 0.010


class SuctionGripper:
    """Takes hold of one box at a time in a :class:`PhysicsWorld`."""

    def __init__(self, world: PhysicsWorld, max_force_n: float = 2000.0) -> None:
        self._world = world
        self._max_force_n = max_force_n
        self._constraint: int | None = None
        self._grasp: Pose | None = None
        self.box_id: str | None = None

    def gap(self, box_id: str) -> float:
        """Distance between pad and box, metres; infinite beyond 5 cm."""
        world = self._world
        points = pybullet.getClosestPoints(
            world.robot,
            world.boxes[box_id].number,
            0.05,
            linkIndexA=world.links['tool'],
            physicsClientId=world.client,
        )
        return min((float(point[8]) for point in points), default=math.inf)

    def attach(self, box_id: str) -> bool:
        """Take hold of ``box_id``; ``False`` when the pad does not touch it."""
        world = self._world
        if self.gap(box_id) > SEAL_DISTANCE:
            return False
        body = world.boxes[box_id].number
        link = world.links['tool']
        tool = pybullet.getLinkState(
            world.robot, link, computeForwardKinematics=1, physicsClientId=world.client
        )
        centre, turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=world.client)
        # Constraints are given in frames at the centres of mass.
        inverse = pybullet.invertTransform(tool[0], tool[1])
        offset, offset_turn = pybullet.multiplyTransforms(*inverse, centre, turn)
        self._constraint = pybullet.createConstraint(
            world.robot,
            link,
            body,
            -1,
            pybullet.JOINT_FIXED,
            [0, 0, 0],
            parentFramePosition=offset,
            childFramePosition=[0, 0, 0],
            parentFrameOrientation=offset_turn,
            childFrameOrientation=[0, 0, 0, 1],
            physicsClientId=world.client,
        )
        pybullet.changeConstraint(
            self._constraint, maxForce=self._max_force_n, physicsClientId=world.client
        )
        self._filter(body, collide=False)
        self.box_id = box_id
        self._grasp = self._relative(box_id)
        return True

    def slipped(self) -> float:
        """How far the held box moved under the pad since it was taken, metres."""
        if self.box_id is None or self._grasp is None:
            return 0.0
        now = self._relative(self.box_id).position
        return math.dist(now, self._grasp.position)

    def release(self) -> None:
        """Let go; without a box nothing happens."""
        if self._constraint is not None:
            pybullet.removeConstraint(self._constraint, physicsClientId=self._world.client)
        if self.box_id is not None and self.box_id in self._world.boxes:
            self._filter(self._world.boxes[self.box_id].number, collide=True)
        self._constraint = self._grasp = self.box_id = None

    def _relative(self, box_id: str) -> Pose:
        tool, box = self._world.tool_pose(), self._world.pose(box_id)
        inverse = pybullet.invertTransform(tool.position, tool.quaternion)
        position, quaternion = pybullet.multiplyTransforms(*inverse, box.position, box.quaternion)
        return Pose(tuple(position), tuple(quaternion))

    def _filter(self, body: int, collide: bool) -> None:
        world = self._world
        for link in world.links.values():
            pybullet.setCollisionFilterPair(
                world.robot, body, link, -1, int(collide), physicsClientId=world.client
            )
