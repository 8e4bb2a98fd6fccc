"""Drives the arm along trajectories in physics, watches it, and stops it.

Radians, metres, seconds of robot time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.physics.contacts import collision, touched_by
from arm_executor.arms.physics.gripper import SLIP_DISTANCE, SuctionGripper
from arm_executor.arms.physics.motion_run import Interrupted, MotionRun
from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.model.tree import CELL_JOINT_NAMES
from arm_executor.motion.stopping import stopped
from arm_executor.motion.timing import Load, Timing, Trajectory
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.values import Box

_GRAVITY = 9.81

Array = NDArray[np.float64]

#: Limits of the tracking error: metres of the rail, radians of the joints.
_TRACKING = np.array([0.03, 0.05, 0.05, 0.05, 0.08, 0.08, 0.08])
#: Slower joints are at rest, m/s and rad/s.
_AT_REST = 0.05
#: The arm gets this long to come to rest at the end of a trajectory, and after a stop.
_REST_S, _REST_AFTER_STOP_S = 0.02, 0.15
#: Steps of physics between two looks at joints and grasp, and at what is touched.
_LOOK_EVERY, _FEEL_EVERY = 6, 1
#: An arm that runs into something goes back to where it was so many steps before: it would go on
#: pressing, off the middle of the box, and the pad would peel.
_BACK_OFF = 5
#: In the last moment of a trajectory, its last centimetre, the held box may meet what it is to
#: stand on: boxes are not quite as high as they were scanned.
_LANDING_S = 0.06


class ArmDriver:
    """Position control of the joints in one :class:`PhysicsWorld`.

    ``timing`` says how fast the arm may stop with what it holds. ``commanded`` (7,) is where the
    joints are meant to be; ``positions`` is where they were measured last, at ``measured_at_s`` of
    the world's time; both are safe to read from any thread.
    """

    def __init__(
        self, world: PhysicsWorld, gripper: SuctionGripper, timing: Timing, start: Array
    ) -> None:
        self._world = world
        self._gripper = gripper
        self._timing = timing
        self.commanded = start
        self.positions: tuple[float, ...] = tuple(start.tolist())
        self.measured_at_s = 0.0
        self.tracking_error = 0.0
        world.put_arm(start)

    def astray(self, start: Array) -> str:
        """Why a motion from ``start`` (7,), at rest, cannot begin; empty when it can.

        When the joints are elsewhere, that is where the next motion has to be planned from.
        """
        position, speed = self._world.joint_state()
        error = np.abs(position - start)
        worst = int((error / _TRACKING).argmax())
        unit = 'm' if worst == 0 else 'rad'
        if error[worst] > _TRACKING[worst] / 2:
            self.commanded = position
            return (
                f'{CELL_JOINT_NAMES[worst]} is {error[worst]:.3f} {unit} away from where the '
                f'motion starts, {_TRACKING[worst] / 2:g} {unit} are allowed; plan it again'
            )
        fastest = int(np.abs(speed).argmax())
        if abs(speed[fastest]) > _AT_REST:
            return (
                f'{CELL_JOINT_NAMES[fastest]} still moves at {speed[fastest]:.3f} per second, '
                f'{_AT_REST:g} are allowed; wait until the arm is at rest'
            )
        return ''

    def follow(
        self,
        timed: Trajectory,
        run: MotionRun | None = None,
        phases: Sequence[tuple[float, Phase]] = (),
        load: Load | None = None,
    ) -> None:
        """Run a trajectory with ``load`` on the pad; each of ``phases`` begins at its time.

        Raises
        ------
        Interrupted
            With the arm at rest: ``CANCELED`` after a stop, ``PATH_TOLERANCE_VIOLATED`` when a
            joint strays, ``BOX_LOST`` when the box comes off the pad.
        """
        upcoming = list(phases)
        for index, time_s in enumerate(timed.times):
            if run is not None:
                while upcoming and time_s >= upcoming[0][0] - 1e-9:
                    run.enter(upcoming.pop(0)[1])
                if run.stop.is_set():
                    self._slow_down(timed, index, load)
                    self._check_grasp('while it was stopped on request')
                    raise Interrupted(ErrorCode.CANCELED, 'the motion was stopped on request')
            self.commanded = timed.q[index]
            self._world.drive(timed.q[index], timed.qd[index])
            self._world.step()
            if run is not None:
                run.tick()
            if index % _LOOK_EVERY == 0:
                self._look(timed, index, load)
            if run is not None and index % _FEEL_EVERY == 0:
                landing = timed.duration - time_s < _LANDING_S
                back = timed.q[max(0, index - _BACK_OFF)]
                self._feel(run.plan.request.box, back, landing=landing)
        self.hold(_REST_S)

    def came_along(self, timed: Trajectory) -> bool:
        """:meth:`follow` with nothing held; whether it came to the end."""
        try:
            self.follow(timed)
        except Interrupted:
            return False
        return True

    def rest(self, run: MotionRun, seconds: float) -> None:
        """Stand still for ``seconds``; :class:`Interrupted` when a stop is asked for."""
        self.hold(seconds)
        run.tick(round(seconds / STEP_S))
        if run.stop.is_set():
            raise Interrupted(ErrorCode.CANCELED, 'the motion was stopped on request')

    def hold(self, seconds: float) -> None:
        """Let robot time pass with the arm where it is meant to be."""
        self._world.drive(self.commanded, np.zeros(7))
        self._world.step(max(1, round(seconds / STEP_S)))
        self._note(self._world.joint_state()[0])

    def _note(self, position: Array) -> None:
        self.positions, self.measured_at_s = tuple(position.tolist()), self._world.elapsed_s

    def _look(self, timed: Trajectory, index: int, load: Load | None) -> None:
        position, _ = self._world.joint_state()
        self._note(position)
        error = np.abs(position - timed.q[index])
        worst = int((error / _TRACKING).argmax())
        self.tracking_error = max(self.tracking_error, float(error[worst] / _TRACKING[worst]))
        if error[worst] > _TRACKING[worst]:
            self._halt(position)
            self._check_grasp()
            unit = 'm' if worst == 0 else 'rad'
            msg = (
                f'{CELL_JOINT_NAMES[worst]} strayed {error[worst]:.3f} {unit} from its path, '
                f'{_TRACKING[worst]:g} {unit} are allowed; look what is in the way'
            )
            raise Interrupted(ErrorCode.PATH_TOLERANCE_VIOLATED, msg)
        if self._lost():
            self._slow_down(timed, index, load)
            self._check_grasp()

    def _lost(self) -> bool:
        return bool(self._gripper.lost_because) or self._gripper.slipped() > SLIP_DISTANCE

    def _feel(self, box: Box, back: Array, *, landing: bool) -> None:
        """:class:`Interrupted` with ``COLLISION`` when the arm or its box runs into something.

        The arm goes ``back`` (7,) then.
        """
        held = self._gripper.box_id == box.id and not landing
        body = self._world.boxes.get(box.id)
        # A box heavier than announced presses on the belt with what it really weighs.
        weight_kg = box.weight_kg if body is None else body.mass
        hit = collision(self._world, box.id, weight_kg * _GRAVITY, held=held)
        if hit is not None:
            self._halt(back)
            self._check_grasp()
            raise Interrupted(ErrorCode.COLLISION, f'{hit}; look what is in the way')

    def _check_grasp(self, when: str = '') -> None:
        """:class:`Interrupted` with ``BOX_LOST`` when the box came off the pad, and ``when``."""
        if self._lost():
            slipped = self._gripper.slipped()
            why = self._gripper.lost_because or 'no force on the pad was too much'
            box_id = self._gripper.box_id or ''
            where = touched_by(self._world, box_id)
            when = f' {when}' if when else ''
            msg = (
                f'box {box_id} came off the pad{when}, {1000 * slipped:.0f} mm: {why}; '
                f'it now touches {where}'
            )
            raise Interrupted(ErrorCode.BOX_LOST, msg)

    def _slow_down(self, timed: Trajectory, index: int, load: Load | None) -> None:
        """Come to rest along the path, as fast as the load bears."""
        stop = stopped(self._timing, timed, float(timed.times[index]), load)
        for q, qd in zip(stop.q, stop.qd, strict=True):
            self.commanded = q
            self._world.drive(q, qd)
            self._world.step()
        self.hold(_REST_AFTER_STOP_S)

    def _halt(self, position: Array) -> None:
        """Come to rest at ``position`` (7,): what is in the way may not be pushed."""
        self.commanded = position
        self.hold(_REST_AFTER_STOP_S)
        self.commanded, _ = self._world.joint_state()
        self.hold(_REST_AFTER_STOP_S)
