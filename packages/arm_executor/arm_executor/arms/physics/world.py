"""The physics world: bins, boxes and the arm as bodies. Frame `cell`, metres, seconds.

Settings from measurements (docs/decisions.md): 240 steps a second and up to 300 solver iterations
keep forty-box stacks still to 2 mm; bodies at rest sleep, since awake they creep.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pybullet
from numpy.typing import NDArray

from arm_executor.model import bullet, colours
from arm_executor.model.layout import Block, Layout, conveyor_block, rail_block
from arm_executor.model.robot_data import RobotModel
from arm_executor.model.urdf import cell_urdf
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box, Vec3

Array = NDArray[np.float64]

STEP_S = 1.0 / 240.0
_ITERATIONS = 300
#: Bodies nearer than this are in touch for the solver, and wake each other, metres. Bullet's own
#: 2 cm is more than the gap between boxes: then a whole bin wakes when one box comes near.
_TOUCH = 0.002
_DAMPING = 0.04
_FRICTION = 0.6
#: A box slower than this is at rest, m/s and rad/s.
_REST_SPEED, _REST_TURN = 0.003, 0.03
_REST_STEPS = 12
#: Boxes that were slower than this for so many looks, so many steps apart (0.5 s), may sleep while
#: the arm still moves: what tips over gets faster than that in a tenth of it.
_DOZE_SPEED, _DOZE_TURN = 0.001, 0.01
_DOZE_LOOKS, _DOZE_EVERY = 10, 12


@dataclass(frozen=True)
class Body:
    """A box as a body."""

    number: int
    size: Vec3
    com_offset: Vec3
    mass: float


class PhysicsWorld:
    """One physics client with the arm, the fixed parts of the cell and boxes by id.

    ``speed`` paces the steps: 1 is real time, 0 as fast as possible. ``after_step`` is called after
    each of them.
    """

    def __init__(self, robot: RobotModel, layout: Layout, speed: float = 0.0) -> None:
        self.client = bullet.connect()
        self._speed = speed
        self._due = time.monotonic()
        self._parts: dict[str, list[int]] = {}
        self.boxes: dict[str, Body] = {}
        self.elapsed_s = 0.0
        self.after_step: Callable[[], None] | None = None
        self._dozing: list[int] = []
        self._doze_looks = 0
        client = self.client
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S,
            numSolverIterations=_ITERATIONS,
            contactBreakingThreshold=_TOUCH,
            physicsClientId=client,
        )
        self.robot = bullet.load_robot(client, cell_urdf(robot, layout))
        self.joints = bullet.joint_indices(client, self.robot)
        self._torques = [layout.rail.force, *robot.max_torque]
        self.links = {name: n for n, name in bullet.link_names(client, self.robot).items()}
        for link in self.links.values():
            pybullet.changeDynamics(
                self.robot, link, linearDamping=0, angularDamping=0, physicsClientId=client
            )
        self.add_part('floor', (Block('floor', (-20, -20, -0.1), (20, 20, 0.0)),), colours.FLOOR)
        self.add_part('conveyor', (conveyor_block(layout),), colours.BELT)
        self.add_part('rail', (rail_block(layout),), colours.STEEL)
        for part in ('rail', 'floor'):
            pybullet.setCollisionFilterPair(
                self.robot,
                self._parts[part][0],
                self.links['carriage'],
                -1,
                0,
                physicsClientId=client,
            )

    def add_part(
        self,
        name: str,
        blocks: Iterable[Block],
        colour: colours.Colour | None = None,
    ) -> None:
        """Add fixed blocks under one ``name``; the default colour is that of a bin."""
        numbers = self._parts.setdefault(name, [])
        for block in blocks:
            shade = colour or (colours.PALLET if block.name.endswith('floor') else colours.WALL)
            number = bullet.add_block(self.client, block, shade)
            pybullet.changeDynamics(
                number, -1, lateralFriction=_FRICTION, physicsClientId=self.client
            )
            numbers.append(number)

    def remove_part(self, name: str) -> None:
        """Take the blocks called ``name`` away."""
        for number in self._parts.pop(name, []):
            pybullet.removeBody(number, physicsClientId=self.client)

    def add_box(self, box: Box, pose: Pose) -> None:
        """Add ``box`` with its true size, mass and centre of mass at ``pose``."""
        size = _metres(box.size_mm)
        offset = _metres(box.com_offset_mm)
        shade = colours.carton(box.id)
        number = bullet.add_box(self.client, size, pose, box.weight_kg, offset, shade)
        pybullet.changeDynamics(
            number,
            -1,
            lateralFriction=_FRICTION,
            linearDamping=_DAMPING,
            angularDamping=_DAMPING,
            activationState=pybullet.ACTIVATION_STATE_ENABLE_SLEEPING,
            physicsClientId=self.client,
        )
        self.boxes[box.id] = Body(number, size, offset, box.weight_kg)

    def remove_box(self, box_id: str) -> None:
        """Take a box away; one that is not there is fine. Those that lean on it wake."""
        body = self.boxes.pop(box_id, None)
        if body is not None:
            self._dozing = []
            self._wake_around(body.number)
            bullet.remove(self.client, body.number, self.robot, self.links.values())

    def _wake_around(self, number: int) -> None:
        """Wake the boxes that touch a body: without it they would sleep on in mid-air."""
        low, high = pybullet.getAABB(number, physicsClientId=self.client)
        near = pybullet.getOverlappingObjects(
            [edge - _TOUCH for edge in low],
            [edge + _TOUCH for edge in high],
            physicsClientId=self.client,
        )
        others = {body.number for body in self.boxes.values()}
        for other in others & {found for found, _ in near or ()}:
            pybullet.changeDynamics(
                other,
                -1,
                activationState=pybullet.ACTIVATION_STATE_WAKE_UP,
                physicsClientId=self.client,
            )

    def move_box(self, box_id: str, pose: Pose) -> None:
        """Put a box elsewhere, at rest."""
        body = self.boxes[box_id]
        bullet.move_box(self.client, body.number, pose, body.com_offset)
        pybullet.resetBaseVelocity(body.number, (0, 0, 0), (0, 0, 0), physicsClientId=self.client)

    def name_of(self, number: int) -> str:
        """What people call a body."""
        names = {body.number: f'box {box_id}' for box_id, body in self.boxes.items()}
        names |= {number: part for part, numbers in self._parts.items() for number in numbers}
        return 'the arm' if number == self.robot else names.get(number, 'something unknown')

    def pose(self, box_id: str) -> Pose:
        """Pose of a box's geometric centre."""
        body = self.boxes[box_id]
        return bullet.box_pose(self.client, body.number, body.com_offset)

    def step(self, count: int = 1) -> None:
        """Advance by ``count`` steps, at the pace of ``speed``."""
        for _ in range(count):
            pybullet.stepSimulation(physicsClientId=self.client)
            if self.after_step is not None:
                self.after_step()
            if self._dozing:
                self._look_at_dozing()
        self.elapsed_s += count * STEP_S
        if self._speed > 0:
            now = time.monotonic()
            # After a pause (planning, waiting for the belt) the clock starts anew.
            self._due = max(self._due, now - 0.25) + count * STEP_S / self._speed
            if self._due > now + 0.002:
                time.sleep(self._due - now)

    def settle(self, box_ids: Iterable[str], timeout_s: float) -> float:
        """Step until all of ``box_ids`` rest, or ``timeout_s`` of robot time passed; seconds.

        What rests is put to sleep, until something touches it.
        """
        numbers = [self.boxes[box_id].number for box_id in box_ids]
        still = 0
        for count in range(math.ceil(timeout_s / STEP_S)):
            if still >= _REST_STEPS:
                self._let_sleep(numbers)
                return count * STEP_S
            self.step()
            still = still + 1 if all(self._rests(number) for number in numbers) else 0
        return timeout_s

    def doze(self, box_ids: Iterable[str]) -> None:
        """Once all of ``box_ids`` have rested for half a second they sleep, while the arm moves."""
        self._dozing = [self.boxes[box_id].number for box_id in box_ids]
        self._doze_looks = 0

    def _look_at_dozing(self) -> None:
        self._doze_looks += 1
        looks, between = divmod(self._doze_looks, _DOZE_EVERY)
        if between:
            return
        if not all(self._rests(number, _DOZE_SPEED, _DOZE_TURN) for number in self._dozing):
            self._doze_looks = 0
        elif looks >= _DOZE_LOOKS:
            self._let_sleep(self._dozing)
            self._dozing = []

    def _let_sleep(self, numbers: Iterable[int]) -> None:
        for number in numbers:
            pybullet.changeDynamics(
                number,
                -1,
                activationState=pybullet.ACTIVATION_STATE_SLEEP,
                physicsClientId=self.client,
            )

    def _rests(self, number: int, slow: float = _REST_SPEED, turning: float = _REST_TURN) -> bool:
        speed, turn = pybullet.getBaseVelocity(number, physicsClientId=self.client)
        return bool(max(map(abs, speed)) < slow and max(map(abs, turn)) < turning)

    def drive(self, q: Array, qd: Array) -> None:
        """Set what the joints steer for: positions and speeds (7,), within their real torques."""
        pybullet.setJointMotorControlArray(
            self.robot,
            self.joints,
            pybullet.POSITION_CONTROL,
            targetPositions=q.tolist(),
            targetVelocities=qd.tolist(),
            forces=self._torques,
            physicsClientId=self.client,
        )

    def joint_state(self) -> tuple[Array, Array]:
        """Measured joint positions and speeds, (7,) each."""
        states = pybullet.getJointStates(self.robot, self.joints, physicsClientId=self.client)
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def put_arm(self, q: Array) -> None:
        """Set the joints without motion; only while the world is being made."""
        for joint, value in zip(self.joints, q.tolist(), strict=True):
            pybullet.resetJointState(self.robot, joint, value, physicsClientId=self.client)
        self.drive(q, np.zeros(len(q)))

    def tool_pose(self) -> Pose:
        """Measured pose of the pad's face."""
        state = pybullet.getLinkState(
            self.robot, self.links['tcp'], computeForwardKinematics=1, physicsClientId=self.client
        )
        return Pose(tuple(state[4]), tuple(state[5]))

    def close(self) -> None:
        """End the client."""
        pybullet.disconnect(physicsClientId=self.client)


def _metres(values_mm: Vec3) -> Vec3:
    x, y, z = values_mm
    return (x / 1000, y / 1000, z / 1000)
