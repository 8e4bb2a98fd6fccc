"""The arm that really moves: a robot model in PyBullet under position control.

Two physics clients: one is the world, where boxes have mass and fall; the other only answers
whether a configuration would touch anything. Fulfils :class:`arm_executor.arm.Arm`.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arm_executor.arm import (
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
    PlaceRequest,
)
from arm_executor.gripper import SLIP_DISTANCE, SuctionGripper
from arm_executor.layout import BinFrame, Layout, bin_blocks, bin_frame, check_layout
from arm_executor.layout import conveyor_block
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.path import JointPath
from arm_executor.motion.planner import (
    GRIP_S,
    RELEASE_S,
    MotionPlanner,
    PlannedMotion,
    reversed_path,
)
from arm_executor.motion.template import Site, Standing
from arm_executor.motion.timing import Load, MotionLimits, Trajectory
from arm_executor.pose_error import corner_distance, folded, turn_between
from arm_executor.robot.parameters import find_arm
from arm_executor.robot.urdf import CELL_JOINT_NAMES
from arm_executor.world import STEP_S, PhysicsWorld
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.values import Bin, BinSpec, Box, Vec3

Array = NDArray[np.float64]

#: Limits of the tracking error: metres of rail, radians of the joints.
_TRACKING = np.array([0.03, 0.05, 0.05, 0.05, 0.08, 0.08, 0.08])
#: A stop brings the arm to rest along its path within this time, seconds.
_STOP_S = 0.30
_CHECK_EVERY = 6
_PHASE_EVERY = 24
_SETTLE_TIMEOUT_S = 3.0
#: A box closer than this to where it is said to be is left alone, metres and radians.
_SAME_PLACE, _SAME_TURN = 0.002, 0.01


@dataclass(frozen=True)
class Tolerances:
    """What counts as placed: metres and radians."""

    position_m: float = 0.005
    angle_rad: float = math.radians(1.0)
    others_m: float = 0.005


@dataclass
class _Stand:
    """A station that holds a bin."""

    bin_id: str
    spec: BinSpec
    frame: BinFrame
    box_ids: list[str]


class _Interrupted(Exception):
    """The motion ended early; the arm is at rest."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code


class PhysicsArm:
    """A robot arm with its cell in PyBullet.

    Parameters
    ----------
    layout : where everything stands.
    robot : name of the arm, see :mod:`arm_executor.robot.parameters`.
    speed : robot seconds per wall-clock second; 0 as fast as possible.
    bin_spec : kind of bin that every station is checked for; ``None`` to check when bins come.
    tolerance_mm, angle_tolerance_deg, others_tolerance_mm : what counts as placed.
    limits : assumed limits of motion.

    Raises
    ------
    LayoutError
        The layout cannot be built with these bins.
    ValueError
        There is no such robot.
    """

    def __init__(
        self,
        layout: Layout | None = None,
        robot: str = 'ur20',
        speed: float = 0.0,
        bin_spec: BinSpec | None = None,
        tolerance_mm: float = 5.0,
        angle_tolerance_deg: float = 1.0,
        others_tolerance_mm: float = 5.0,
        limits: MotionLimits | None = None,
    ) -> None:
        self.layout = layout or Layout()
        arm = find_arm(robot)
        check_layout(self.layout, {} if bin_spec is None else dict.fromkeys('ABC', bin_spec))
        self._tolerances = Tolerances(
            tolerance_mm / 1000, math.radians(angle_tolerance_deg), others_tolerance_mm / 1000
        )
        self.world = PhysicsWorld(arm, self.layout, speed)
        self.gripper = SuctionGripper(self.world)
        self._planning = PlanningWorld(arm, self.layout)
        self._planning.set_block(conveyor_block(self.layout))
        self.planner = MotionPlanner(
            arm, self.layout, limits or MotionLimits(), self._planning, STEP_S
        )
        self._stands: dict[str, _Stand] = {}
        self._commanded: Array = self.planner.home()
        self.world.put_arm(self._commanded)
        self._held_load: Load | None = None
        self._presented: str | None = None
        self._way_back: tuple[JointPath, PlaceRequest] | None = None
        self._positions: tuple[float, ...] = tuple(self._commanded.tolist())

    # -- bins ------------------------------------------------------------------------------------

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """See :meth:`arm_executor.arm.Arm.set_bins`; raises ``LayoutError`` for a bad station."""
        check_layout(self.layout, {one.station: one.spec for one in bins})
        wanted = {one.station: one for one in bins}
        for station in list(self._stands):
            stand, new = self._stands[station], wanted.get(station)
            if new is None or (new.id, new.spec) != (stand.bin_id, stand.spec):
                self._remove_stand(station)
        changed: list[str] = []
        for station, new in wanted.items():
            if station not in self._stands:
                self._add_stand(station, new)
            changed += self._fill(station, new, poses)
        if changed:
            everywhere = [one for stand in self._stands.values() for one in stand.box_ids]
            self.world.settle(everywhere, _SETTLE_TIMEOUT_S)
            for station in self._stands:
                self._show_planner(station)
        return {
            one: stand.frame.from_cell(self.world.pose(one))
            for stand in self._stands.values()
            for one in stand.box_ids
        }

    def _add_stand(self, station: str, new: Bin) -> None:
        blocks = bin_blocks(self.layout, station, new.spec)
        self.world.add_part(f'bin {station}', blocks)
        for block in blocks:
            self._planning.set_block(block)
        frame = bin_frame(self.layout, station, new.spec)
        self._stands[station] = _Stand(new.id, new.spec, frame, [])

    def _remove_stand(self, station: str) -> None:
        stand = self._stands.pop(station)
        for box_id in stand.box_ids:
            self.world.remove_box(box_id)
            self._planning.remove(_in_bin(box_id))
        self.world.remove_part(f'bin {station}')
        for block in bin_blocks(self.layout, station, stand.spec):
            self._planning.remove(block.name)

    def _fill(self, station: str, new: Bin, poses: Mapping[str, Pose]) -> list[str]:
        """Make a stand hold exactly the boxes of ``new``; ids of those added or moved."""
        stand = self._stands[station]
        wanted = {one.box.id: one.box for one in new.boxes}
        changed = []
        for box_id in [one for one in stand.box_ids if one not in wanted]:
            self._forget(box_id)
            changed += [one for one in stand.box_ids]
        for box_id, box in wanted.items():
            if box_id not in poses:
                msg = f'box {box_id} of bin {new.id} has no pose; give one for every box'
                raise ValueError(msg)
            pose = stand.frame.to_cell(poses[box_id])
            if box_id in stand.box_ids:
                if _same(self.world.pose(box_id), pose, self.world.boxes[box_id].size):
                    continue
                self.world.move_box(box_id, pose)
            else:
                self._forget(box_id)
                self.world.add_box(box, pose)
                stand.box_ids.append(box_id)
            changed.append(box_id)
        return changed

    def _forget(self, box_id: str) -> None:
        """Take a box out of the world, wherever it is."""
        if self.gripper.box_id == box_id:
            self.gripper.release()
        for stand in self._stands.values():
            if box_id in stand.box_ids:
                stand.box_ids.remove(box_id)
        if self._presented == box_id:
            self._presented = None
        self.world.remove_box(box_id)
        self._planning.remove(_in_bin(box_id))

    def _show_planner(self, station: str) -> None:
        for box_id in self._stands[station].box_ids:
            body = self.world.boxes[box_id]
            self._planning.set_box(_in_bin(box_id), body.size, self.world.pose(box_id))

    # -- planning --------------------------------------------------------------------------------

    def plan(self, request: PlaceRequest) -> MotionPlan:
        """See :meth:`arm_executor.arm.Arm.plan`."""
        begun = time.perf_counter()
        stand = self._stands.get(request.station)
        if stand is None:
            msg = f'there is no bin at station {request.station}; open one there first'
            raise MotionError(ErrorCode.INVALID_GOAL, msg)
        if self.gripper.box_id is not None:
            msg = f'the arm still holds box {self.gripper.box_id}; return it to the belt first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        standing = [
            _standing(one, self.world.boxes[one].size, self.world.pose(one))
            for one in stand.box_ids
        ]
        site = Site(request.station, stand.spec, stand.frame, standing)
        motion = self.planner.plan(request, self._commanded, site)
        return MotionPlan(request, motion.duration, time.perf_counter() - begun, motion)

    # -- motion ----------------------------------------------------------------------------------

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """See :meth:`arm_executor.arm.Arm.execute`."""
        motion: PlannedMotion = plan.detail
        run = _Run(plan, hooks, stop)
        if np.abs(motion.approach.q[0] - self._commanded).max() > 1e-6:
            msg = 'the arm moved since this was planned; plan it again'
            return MotionResult(ErrorCode.START_STATE_INVALID, msg)
        stand = self._stands.get(plan.request.station)
        if stand is None:
            msg = f'there is no bin at station {plan.request.station} any more'
            return MotionResult(ErrorCode.INVALID_GOAL, msg)
        before = {one: self.world.pose(one) for one in stand.box_ids}
        try:
            self._place(run, motion)
            result = self._measured(run, stand, before)
        except _Interrupted as end:
            result = self._interrupted(run, stand, before, end)
        return result

    def _place(self, run: _Run, motion: PlannedMotion) -> None:
        request = run.plan.request
        box = request.box
        self._present(box, request.pick)
        self._follow(run, motion.approach, [(0.0, Phase.APPROACHING)])
        run.enter(Phase.GRASPING)
        self._rest(run, GRIP_S)
        if not self.gripper.attach(box.id):
            gap = 1000 * self.gripper.gap(box.id)
            msg = f'box {box.id}: the pad is {gap:.1f} mm from its top, so no vacuum builds up'
            raise _Interrupted(ErrorCode.GRASP_FAILED, msg)
        self._presented = None
        size = self.world.boxes[box.id].size
        self._held_load = Load(box.weight_kg, size, self.world.boxes[box.id].com_offset)
        self._way_back = (motion.carry_path, request)
        run.hooks.picked()
        phases = [(0.0, Phase.TRANSFERRING), (motion.lowering_s, Phase.LOWERING)]
        self._follow(run, motion.carry, phases)
        run.enter(Phase.RELEASING)
        self._rest(run, RELEASE_S / 2)
        run.hooks.releasing()
        self.gripper.release()
        self._stands[request.station].box_ids.append(box.id)
        self._held_load = self._way_back = None
        run.hooks.released()
        self._rest(run, RELEASE_S / 2)
        self._follow(run, motion.retreat, [(0.0, Phase.RETREATING)])

    def _present(self, box: Box, pick: Pose) -> None:
        """Have ``box``, and no other, at the pick point, as the belt brought it."""
        if self._presented is not None and self._presented != box.id:
            self._forget(self._presented)
        if self._presented != box.id:
            self._forget(box.id)
            self.present(box, pick)
        else:
            self.world.move_box(box.id, pick)

    def present(self, box: Box, pick: Pose) -> None:
        """Put a box on the belt at ``pick``, frame `cell`."""
        self.world.add_box(box, pick)
        self._presented = box.id

    def _follow(
        self, run: _Run | None, timed: Trajectory, phases: Sequence[tuple[float, Phase]]
    ) -> None:
        """Run a trajectory; :class:`_Interrupted`, with the arm at rest, when it goes wrong."""
        world = self.world
        upcoming = list(phases)
        for index in range(len(timed.times)):
            if run is not None:
                while upcoming and timed.times[index] >= upcoming[0][0] - 1e-9:
                    run.enter(upcoming.pop(0)[1])
                if run.stop.is_set():
                    self._stop(timed, index)
                    raise _Interrupted(ErrorCode.CANCELED, 'stopped on request')
            self._commanded = timed.q[index]
            world.drive(timed.q[index], timed.qd[index])
            world.step()
            if run is not None:
                run.tick()
            if index % _CHECK_EVERY == 0:
                self._watch(timed, index)
        self._commanded = timed.q[-1]
        self._hold(0.02)

    def _watch(self, timed: Trajectory, index: int) -> None:
        """Publish where the joints are; stop when one strays or the box slips."""
        position, _ = self.world.joint_state()
        self._positions = tuple(position.tolist())
        stray = np.abs(position - timed.q[index]) / _TRACKING
        if stray.max() > 1.0:
            worst = int(stray.argmax())
            error = abs(float(position[worst] - timed.q[index][worst]))
            self._halt()
            msg = (
                f'{CELL_JOINT_NAMES[worst]} is {error:.3f} from its path, '
                f'more than {_TRACKING[worst]:.3f}; something is in the way'
            )
            raise _Interrupted(ErrorCode.PATH_TOLERANCE_VIOLATED, msg)
        if self.gripper.slipped() > SLIP_DISTANCE:
            msg = f'box {self.gripper.box_id} came off the pad'
            self._stop(timed, index)
            raise _Interrupted(ErrorCode.BOX_LOST, msg)

    def _stop(self, timed: Trajectory, index: int) -> None:
        """Come to rest along the path: the time along it runs slower and slower."""
        at = float(timed.times[index])
        steps = math.ceil(_STOP_S / STEP_S)
        for step in range(1, steps + 1):
            rate = 1.0 - step / steps
            at = min(at + rate * STEP_S, timed.duration)
            q = np.array([np.interp(at, timed.times, timed.q[:, k]) for k in range(7)])
            qd = np.array([np.interp(at, timed.times, timed.qd[:, k]) for k in range(7)])
            self._commanded = q
            self.world.drive(q, qd * rate)
            self.world.step()
        self._hold(0.1)

    def _halt(self) -> None:
        """Come to rest where the joints are now."""
        position, _ = self.world.joint_state()
        self._commanded = position
        self._hold(0.3)
        self._commanded, _ = self.world.joint_state()

    def _hold(self, seconds: float) -> None:
        self.world.drive(self._commanded, np.zeros(7))
        self.world.step(max(1, round(seconds / STEP_S)))
        self._positions = tuple(self.world.joint_state()[0].tolist())

    def hold(self, seconds: float) -> None:
        """Let robot time pass with the arm where it is."""
        self._hold(seconds)

    def _rest(self, run: _Run, seconds: float) -> None:
        self._hold(seconds)
        run.tick(round(seconds / STEP_S))
        if run.stop.is_set():
            raise _Interrupted(ErrorCode.CANCELED, 'stopped on request')

    # -- outcome ---------------------------------------------------------------------------------

    def _measured(self, run: _Run, stand: _Stand, before: Mapping[str, Pose]) -> MotionResult:
        """Let everything settle and compare with what was asked."""
        request = run.plan.request
        run.finish()
        run.enter(Phase.SETTLING)
        settling = self.world.settle(stand.box_ids, _SETTLE_TIMEOUT_S)
        run.tick(round(settling / STEP_S))
        box_id = request.box.id
        size = self.world.boxes[box_id].size
        measured = stand.frame.from_cell(self.world.pose(box_id))
        if not _inside(measured, size, stand.spec):
            self._forget(box_id)
            others, moved = self._others(stand, before)
            msg = f'box {box_id} is not in bin {request.station} after its release'
            return run.result(ErrorCode.BOX_LOST, msg, None, others, moved)
        measured = folded(measured, request.target)
        others, moved = self._others(stand, before)
        error = corner_distance(measured, request.target, size)
        angle = turn_between(measured, request.target)
        limits, code, text = self._tolerances, ErrorCode.NONE, ''
        if error > limits.position_m or angle > limits.angle_rad:
            code = ErrorCode.PLACED_OUT_OF_TOLERANCE
            text = (
                f'box {box_id} rests {1000 * error:.1f} mm and {math.degrees(angle):.2f} degrees '
                f'off; allowed are {1000 * limits.position_m:g} mm and '
                f'{math.degrees(limits.angle_rad):g} degrees'
            )
        elif moved > limits.others_m:
            code = ErrorCode.OTHERS_DISTURBED
            text = (
                f'placing box {box_id} moved another box of bin {request.station} by '
                f'{1000 * moved:.1f} mm; allowed are {1000 * limits.others_m:g} mm'
            )
        return run.result(code, text, measured, others, moved)

    def _others(self, stand: _Stand, before: Mapping[str, Pose]) -> tuple[dict[str, Pose], float]:
        """Poses of the boxes that were there before, and how far the worst of them moved."""
        moved, others = 0.0, {}
        for box_id, was in before.items():
            pose = self.world.pose(box_id)
            others[box_id] = stand.frame.from_cell(pose)
            moved = max(moved, corner_distance(pose, was, self.world.boxes[box_id].size))
        self._show_planner(next(s for s, one in self._stands.items() if one is stand))
        return others, moved

    def _interrupted(
        self, run: _Run, stand: _Stand, before: Mapping[str, Pose], end: _Interrupted
    ) -> MotionResult:
        """The result of a motion that ended early; a box that fell is taken out of the cell."""
        request = run.plan.request
        box_id = request.box.id
        run.finish()
        if end.code is ErrorCode.BOX_LOST:
            self.gripper.release()
            self._way_back = self._held_load = None
            self.world.settle([box_id, *stand.box_ids], _SETTLE_TIMEOUT_S)
            self._forget(box_id)
        if box_id in stand.box_ids:
            placed = self._measured(run, stand, before)
            return replace(placed, code=placed.code or end.code, message=placed.message or str(end))
        others, moved = self._others(stand, before)
        return run.result(end.code, str(end), None, others, moved)

    def return_to_belt(self) -> bool:
        """See :meth:`arm_executor.arm.Arm.return_to_belt`: back along the path it came."""
        if self.gripper.box_id is None or self._way_back is None:
            return False
        path, request = self._way_back
        back = reversed_path(path, self._commanded)
        timed = self.planner.timing.trajectory(back, self._held_load, STEP_S)
        if timed is not None:
            try:
                self._follow(None, timed, [])
            except _Interrupted:
                return False
        box_id = self.gripper.box_id
        self._hold(RELEASE_S)
        self.gripper.release()
        self._presented, self._way_back, self._held_load = box_id, None, None
        self.world.settle([box_id], _SETTLE_TIMEOUT_S)
        pose, size = self.world.pose(box_id), self.world.boxes[box_id].size
        return corner_distance(pose, request.pick, size) < 10 * self._tolerances.position_m

    def holds(self) -> str | None:
        """See :meth:`arm_executor.arm.Arm.holds`."""
        return self.gripper.box_id

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """See :meth:`arm_executor.arm.Arm.joint_positions`."""
        return CELL_JOINT_NAMES, self._positions

    def render(self, path: Path, width: int = 960, height: int = 640) -> None:
        """Save a picture of the cell as it is now."""
        from arm_executor.render import save_picture

        save_picture(self.world, path, width, height)

    def close(self) -> None:
        """See :meth:`arm_executor.arm.Arm.close`."""
        self.world.close()
        self._planning.close()


class _Run:
    """One execution: its hooks, its stop event and its clock."""

    def __init__(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> None:
        self.plan, self.hooks, self.stop = plan, hooks, stop
        self._steps: dict[Phase, int] = {}
        self._phase = Phase.APPROACHING
        self._motion_steps: int | None = None

    def enter(self, phase: Phase) -> None:
        self._phase = phase
        self._steps.setdefault(phase, 0)
        self.hooks.phase(phase, self._fraction())

    def tick(self, steps: int = 1) -> None:
        before = self._total()
        self._steps[self._phase] = self._steps.get(self._phase, 0) + steps
        if before // _PHASE_EVERY != self._total() // _PHASE_EVERY:
            self.hooks.phase(self._phase, self._fraction())

    def finish(self) -> None:
        """The motion is over; what follows is waiting for boxes to settle."""
        self._motion_steps = self._total()

    def result(
        self,
        code: ErrorCode,
        message: str,
        measured: Pose | None,
        others: Mapping[str, Pose],
        moved: float,
    ) -> MotionResult:
        steps = self._total() if self._motion_steps is None else self._motion_steps
        split = {phase: count * STEP_S for phase, count in self._steps.items()}
        return MotionResult(code, message, steps * STEP_S, measured, others, moved, split)

    def _total(self) -> int:
        return sum(self._steps.values())

    def _fraction(self) -> float:
        return min(1.0, self._total() * STEP_S / max(self.plan.predicted_s, STEP_S))


def _in_bin(box_id: str) -> str:
    return f'placed box {box_id}'


def _same(one: Pose, other: Pose, size: Vec3) -> bool:
    other = folded(other, one)
    return corner_distance(one, other, size) < _SAME_PLACE and turn_between(one, other) < _SAME_TURN


def _standing(box_id: str, size: Vec3, pose: Pose) -> Standing:
    from arm_executor.pose_error import corners

    points = corners(pose, size)
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return Standing(box_id, (low[0], low[1], low[2]), (high[0], high[1], high[2]))


def _inside(pose: Pose, size: Vec3, spec: BinSpec) -> bool:
    """Whether a box's centre is over the bin's floor and not under it."""
    x, y, z = pose.position
    length, breadth, _ = (edge / 1000 for edge in spec.size_mm)
    return 0 < x < length and 0 < y < breadth and z > min(size) / 4
