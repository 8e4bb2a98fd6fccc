"""The suction gripper: a pad that holds what it touches.

Holding is a fixed constraint at the measured relative pose, so that nothing jumps when the pad
takes hold. What the constraint bears is measured in every step; more than the pad holds breaks it,
and the box falls. Metres, newtons, frame `cell`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import pybullet

from arm_executor.arms.physics.contacts import touched_by
from arm_executor.arms.physics.world import PhysicsWorld
from arm_executor.model.layout import Tool
from arm_executor.model.suction import Pad, PadLoad, overload, pad_on
from pack_msgs_py.geometry.pose import Pose, upright_axis
from pack_msgs_py.values import Vec3

#: The bellows give way, and reach out, by this much until their lip seals, metres.
STROKE = 0.012
#: The box slipped, or the pad let go, when it moved this far under the pad, metres.
SLIP_DISTANCE = 0.010
#: The bellows even out what is shorter than this, steps of physics (25 ms).
_EVEN_OUT = 6
#: Stronger than any pad: the constraint is to give way by our rule, not by stretching.
_STIFF_N = 20_000.0


class SuctionGripper:
    """Takes hold of one box at a time in a :class:`PhysicsWorld`.

    ``lost_because`` says what broke the hold of the box called ``box_id``, empty while it holds.
    """

    def __init__(self, world: PhysicsWorld, tool: Tool | None = None) -> None:
        self._world = world
        self._tool = tool or Tool()
        self._constraint: int | None = None
        self._grasp: Pose | None = None
        self._pad: Pad | None = None
        self._borne: deque[tuple[float, ...]] = deque(maxlen=_EVEN_OUT)
        self._soft: str | None = None
        self.box_id: str | None = None
        self.lost_because = ''
        world.after_step = self._watch

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

    def approach(self, box_id: str) -> None:
        """From now on the bellows give way to ``box_id``, which may be higher than expected."""
        self._yield_to(None)
        self._yield_to(box_id)

    def attach(self, box_id: str) -> bool:
        """Take hold of ``box_id``; ``False`` when the bellows do not seal on it."""
        world = self._world
        if abs(self.gap(box_id)) > STROKE:
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
        pybullet.changeConstraint(self._constraint, maxForce=_STIFF_N, physicsClientId=world.client)
        self._filter(body, collide=False)
        self._borne.clear()
        self.lost_because = ''
        self.box_id = box_id
        self._grasp = self._relative(box_id)
        self._pad = pad_on(self._tool, self._along_tool(box_id, self._grasp))
        return True

    def _along_tool(self, box_id: str, grasp: Pose) -> Vec3:
        """Size of a box by the axes of the tool, its depth below the pad last."""
        depth = upright_axis(grasp.quaternion)
        size = self._world.boxes[box_id].size
        across = [edge for axis, edge in enumerate(size) if axis != depth]
        return (across[0], across[1], size[depth])

    def slipped(self) -> float:
        """How far the held box moved under the pad since it was taken, metres."""
        if self.box_id is None or self._grasp is None:
            return 0.0
        now = self._relative(self.box_id).position
        return math.dist(now, self._grasp.position)

    def load(self) -> PadLoad | None:
        """What the pad bears, evened out; ``None`` while it holds nothing."""
        if self._constraint is None or self.box_id is None or not self._borne:
            return None
        # In plain numbers: this is done in every step, and arrays this small are slow.
        count = len(self._borne)
        fx, fy, fz, tx, ty, tz = (sum(column) / count for column in zip(*self._borne, strict=True))
        tool = self._world.tool_pose()
        turn = pybullet.getMatrixFromQuaternion(tool.quaternion)
        dx, dy, dz = turn[2], turn[5], turn[8]
        # The constraint acts at the box's centre of mass; the pad bears that and its lever.
        number = self._world.boxes[self.box_id].number
        centre, _ = pybullet.getBasePositionAndOrientation(
            number, physicsClientId=self._world.client
        )
        rx, ry, rz = (a - b for a, b in zip(centre, tool.position, strict=True))
        mx, my, mz = tx + ry * fz - rz * fy, ty + rz * fx - rx * fz, tz + rx * fy - ry * fx
        pull = -(fx * dx + fy * dy + fz * dz)
        shear = math.hypot(fx + pull * dx, fy + pull * dy, fz + pull * dz)
        twist = mx * dx + my * dy + mz * dz
        peel = math.hypot(mx - twist * dx, my - twist * dy, mz - twist * dz)
        return PadLoad(pull, shear, peel)

    def release(self) -> None:
        """Let go; without a box nothing happens."""
        self._part()
        self._grasp = self._pad = self.box_id = None
        self.lost_because = ''

    def _part(self) -> None:
        """Pad and box go their own ways."""
        if self._constraint is not None:
            pybullet.removeConstraint(self._constraint, physicsClientId=self._world.client)
        if self.box_id is not None and self.box_id in self._world.boxes:
            self._filter(self._world.boxes[self.box_id].number, collide=True)
        self._constraint = None

    def _watch(self) -> None:
        """After each step: measure what the pad bears, and let go when that is too much."""
        if self._constraint is None or self._pad is None:
            return
        borne = pybullet.getConstraintState(self._constraint, physicsClientId=self._world.client)
        # As the box feels it: forces along the axes of `cell`, torques about those of the box.
        fx, fy, fz, x, y, z = (-value for value in borne[:6])
        a, b, c, d, e, f, g, h, i = self._axes()
        turning = (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)
        self._borne.append((fx, fy, fz, *turning))
        load = self.load()
        if len(self._borne) < _EVEN_OUT or load is None:
            return
        too_much = overload(self._pad, load)
        if too_much is not None:
            touched = touched_by(self._world, self.box_id or '')
            self.lost_because = f'{too_much}, while the box touched {touched}'
            self._part()

    def _axes(self) -> Sequence[float]:
        """Axes of the held box as a matrix, row by row (9,)."""
        assert self.box_id is not None
        _, quaternion = pybullet.getBasePositionAndOrientation(
            self._world.boxes[self.box_id].number, physicsClientId=self._world.client
        )
        rows: Sequence[float] = pybullet.getMatrixFromQuaternion(quaternion)
        return rows

    def _relative(self, box_id: str) -> Pose:
        tool, box = self._world.tool_pose(), self._world.pose(box_id)
        inverse = pybullet.invertTransform(tool.position, tool.quaternion)
        position, quaternion = pybullet.multiplyTransforms(*inverse, box.position, box.quaternion)
        return Pose(tuple(position), tuple(quaternion))

    def _yield_to(self, box_id: str | None) -> None:
        """The pad is soft to this box alone; also after the release, until the next one comes."""
        before, self._soft = self._soft, box_id
        for soft_id, collide in ((before, 1), (box_id, 0)):
            if soft_id is not None and soft_id in self._world.boxes:
                pybullet.setCollisionFilterPair(
                    self._world.robot,
                    self._world.boxes[soft_id].number,
                    self._world.links['tool'],
                    -1,
                    collide,
                    physicsClientId=self._world.client,
                )

    def _filter(self, body: int, collide: bool) -> None:
        world = self._world
        for name, link in world.links.items():
            if collide and name == 'tool' and self._soft == self.box_id:
                continue
            pybullet.setCollisionFilterPair(
                world.robot, body, link, -1, int(collide), physicsClientId=world.client
            )
