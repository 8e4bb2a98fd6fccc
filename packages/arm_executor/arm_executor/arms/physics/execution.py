"""Execution by the physics arm: planned motions run in the world, measured, and taken back.

Whatever the world does ends in a :class:`~arm_executor.model.arm_interface.MotionResult`; a box
that fell out of every place where it could be is taken out of the cell.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.physics.driver import ArmDriver
from arm_executor.arms.physics.gripper import SuctionGripper
from arm_executor.arms.physics.motion_run import Interrupted, MotionRun
from arm_executor.arms.physics.planning import PhysicsPlanning
from arm_executor.arms.physics.standing_bins import SETTLE_TIMEOUT_S, StandingBin, StandingBins
from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.arms.true_boxes import Truth, mismatch
from arm_executor.model.arm_interface import (
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
)
from arm_executor.motion.grasp import as_taken, by_front
from arm_executor.motion.path import JointPath
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.stances import GRIP_S, RELEASE_S
from arm_executor.motion.timing import Load
from arm_executor.motion.way_back import Leg, reversed_path, ways_out
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose, corner_distance, folded, metres
from pack_msgs_py.values import Box

#: A box brought back to the belt is there when it stands this near to where it was, metres.
_BACK_ON_BELT = 0.02
#: A box that comes off the pad so near to its place has met what is under it, metres.
_LANDED = 0.03
#: The arm need not move to where it is already, radians and metres of its joints.
_THERE = 1e-3


@dataclass(frozen=True)
class HeldBox:
    """What it takes to bring a held box back the way it came.

    ``taken_at`` is where its centre was when it was grasped, frame `cell`.
    """

    taken_at: Pose
    path: JointPath
    load: Load


class PhysicsExecution:
    """Runs plans of :class:`~arm_executor.arms.physics.planning.PhysicsPlanning`, one at a time.

    Parameters
    ----------
    world, gripper, driver : what moves.
    bins : what stands in the cell.
    planning : times the ways back.
    truth : what the boxes really are.
    """

    def __init__(
        self,
        world: PhysicsWorld,
        gripper: SuctionGripper,
        driver: ArmDriver,
        bins: StandingBins,
        planning: PhysicsPlanning,
        truth: Truth,
    ) -> None:
        self._world = world
        self._gripper = gripper
        self._driver = driver
        self._bins = bins
        self._planning = planning
        self._truth = truth
        self._presented: str | None = None
        self._held: HeldBox | None = None
        # The motion that is under way or ended early, and where in it the arm is.
        self._under_way: tuple[PlannedMotion, Leg] | None = None

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """See :meth:`arm_executor.model.arm_interface.Arm.execute`."""
        motion: PlannedMotion = plan.detail
        target = self._bins.find(plan.request.station)
        if target is None:
            msg = f'the bin at station {plan.request.station!r} has gone since this was planned'
            return MotionResult(ErrorCode.INVALID_GOAL, msg)
        if np.abs(motion.approach.q[0] - self._driver.commanded).max() > 1e-6:
            msg = 'the arm has moved since this was planned; plan it again'
            return MotionResult(ErrorCode.START_STATE_INVALID, msg)
        astray = self._driver.astray(motion.approach.q[0])
        if astray:
            return MotionResult(ErrorCode.START_STATE_INVALID, astray)
        run = MotionRun(plan, hooks, stop)
        before = {box_id: self._world.pose(box_id) for box_id in target.box_ids}
        try:
            self._place(run, motion, target)
        except Interrupted as end:
            return self._ended_early(run, target, before, end)
        return self._measured(run, target, before)

    # -- the motion -----------------------------------------------------------------------------

    def _place(self, run: MotionRun, motion: PlannedMotion, target: StandingBin) -> None:
        driver = self._driver
        self._bring(run.plan.request.box, run.plan.request.pick)
        self._under_way = motion, Leg.APPROACH
        driver.follow(motion.approach, run, [(0.0, Phase.APPROACHING)])
        self._grasp(run, motion)
        lowering = (motion.lowering_s, Phase.LOWERING)
        self._under_way = motion, Leg.CARRY
        try:
            driver.follow(motion.carry, run, [(0.0, Phase.TRANSFERRING), lowering], self._load())
        except Interrupted as end:
            if not self._has_landed(run, target, end):
                raise
            run.enter(Phase.RELEASING)
            self._let_go(run, target)
            self.withdraw()
            return
        run.enter(Phase.RELEASING)
        driver.rest(run, RELEASE_S / 2)
        self._let_go(run, target)
        self._under_way = motion, Leg.RETREAT
        self._world.doze(target.box_ids)
        driver.rest(run, RELEASE_S / 2)
        driver.follow(motion.retreat, run, [(0.0, Phase.RETREATING)])
        self._under_way = None

    def _grasp(self, run: MotionRun, motion: PlannedMotion) -> None:
        """Take the box; :class:`Interrupted` when it cannot be held, or is not what was scanned."""
        request = run.plan.request
        box, taken, tilts = request.box, as_taken(request), by_front(request)
        size = metres(taken.box.size_mm)
        run.enter(Phase.GRASPING)
        self._driver.rest(run, GRIP_S)
        if not self._gripper.attach(box.id):
            gap, face = 1000 * self._gripper.gap(box.id), 'front' if tilts else 'top'
            msg = f'box {box.id}: no vacuum builds up, the pad is {gap:.1f} mm from its {face}'
            raise Interrupted(ErrorCode.GRASP_FAILED, msg)
        self._presented = None
        # As the gripper's scale has it: one heavier than scanned must come back, too.
        weight_kg = max(box.weight_kg, self._truth.box(box).weight_kg)
        load = Load(weight_kg, size, metres(taken.box.com_offset_mm), tilts)
        self._held = HeldBox(self._world.pose(box.id), motion.carry_path, load)
        self._truth.picked(box.id)
        run.hooks.picked()
        wrong = mismatch(box, self._truth.box(box))
        if wrong:
            raise Interrupted(ErrorCode.BOX_MISMATCH, wrong)

    def _load(self) -> Load | None:
        return None if self._held is None else self._held.load

    def _has_landed(self, run: MotionRun, target: StandingBin, end: Interrupted) -> bool:
        """Whether a box that came off the pad did so on what is under its place."""
        request = run.plan.request
        pose = target.frame.from_cell(self._world.pose(request.box.id))
        size = metres(request.box.size_mm)
        away = corner_distance(folded(pose, request.target), request.target, size)
        return end.code is ErrorCode.BOX_LOST and away < _LANDED

    def _let_go(self, run: MotionRun, target: StandingBin) -> None:
        """The box is the bin's from here on."""
        run.hooks.releasing()
        self._gripper.release()
        self._held = None
        target.box_ids.append(run.plan.request.box.id)
        run.hooks.released()

    # -- boxes on the belt ----------------------------------------------------------------------

    def present(self, box: Box, pick: Pose) -> None:
        """Put ``box`` on the belt at ``pick``, frame `cell`, in place of what was there."""
        if self._presented is not None:
            self.take_away(self._presented)
        self.take_away(box.id)
        self._world.add_box(box, pick)
        self._presented = box.id

    def _bring(self, box: Box, pick: Pose) -> None:
        """As the belt does: have ``box``, as it really is, at the pick point."""
        true = self._truth.lying(box.id, pick)
        if true is not None:
            self.present(true.box, true.pose)
        elif self._presented == box.id:
            self._world.move_box(box.id, pick)
        else:
            self.present(box, pick)
        self._gripper.approach(box.id)

    def free(self, box_ids: set[str]) -> None:
        """Those of ``box_ids`` that are in the gripper or on the belt are there no more."""
        for box_id in box_ids & {self._gripper.box_id, self._presented}:
            self.take_away(box_id)

    def take_away(self, box_id: str) -> None:
        """The box is in neither world any more."""
        if self._gripper.box_id == box_id:
            self._gripper.release()
            self._held = None
        if self._presented == box_id:
            self._presented = None
        self._bins.forget(box_id)

    # -- how it ended ---------------------------------------------------------------------------

    def _measured(
        self, run: MotionRun, target: StandingBin, before: Mapping[str, Pose]
    ) -> MotionResult:
        """Let everything settle and measure where it is then."""
        request, world = run.plan.request, self._world
        box_id = request.box.id
        run.finish()
        run.enter(Phase.SETTLING)
        settling_s = world.settle(target.box_ids, SETTLE_TIMEOUT_S)
        run.tick(round(settling_s / STEP_S))
        size = world.boxes[box_id].size
        measured = target.frame.from_cell(world.pose(box_id))
        if not target.contains(measured, size):
            self.take_away(box_id)
            others, moved_m = self._others(target, before)
            x, y, z = measured.position
            msg = (
                f'box {box_id} came to rest at ({x:.2f}, {y:.2f}, {z:.2f}) m of bin frame '
                f'{target.station}, outside the bin; it was taken out of the cell'
            )
            return run.result(ErrorCode.BOX_LOST, msg, None, others, moved_m)
        measured = folded(measured, request.target)
        others, moved_m = self._others(target, before)
        return run.result(ErrorCode.NONE, '', measured, others, moved_m)

    def _others(
        self, target: StandingBin, before: Mapping[str, Pose]
    ) -> tuple[dict[str, Pose], float]:
        """Poses of the boxes that were there before, and how far the worst of them moved."""
        moved_m, others = 0.0, {}
        for box_id, was in before.items():
            pose = self._world.pose(box_id)
            others[box_id] = target.frame.from_cell(pose)
            moved_m = max(moved_m, corner_distance(pose, was, self._world.boxes[box_id].size))
        self._bins.show_planner(target)
        return others, moved_m

    def _ended_early(
        self, run: MotionRun, target: StandingBin, before: Mapping[str, Pose], end: Interrupted
    ) -> MotionResult:
        """The result of a motion that was interrupted; a box that fell is taken out of the cell."""
        box_id = run.plan.request.box.id
        run.finish()
        if box_id in target.box_ids:
            # The pad has let go: what counts now is how the box stands.
            placed = self._measured(run, target, before)
            return replace(placed, code=placed.code or end.code, message=placed.message or str(end))
        code, text, on_belt = end.code, str(end), False
        if code is ErrorCode.BOX_LOST:
            self._gripper.release()
            self._world.settle([box_id, *target.box_ids], SETTLE_TIMEOUT_S)
            on_belt = self._held is not None and self._is_back(box_id, self._held.taken_at)
            if on_belt:
                self._presented = box_id
                code = ErrorCode.BOX_MISMATCH
                text += '; it stands on the belt where it was, so it is not what the scan says'
            else:
                self.take_away(box_id)
            self._held = None
        others, moved_m = self._others(target, before)
        return replace(run.result(code, text, None, others, moved_m), on_belt=on_belt)

    # -- the way back ---------------------------------------------------------------------------

    def return_to_belt(self) -> bool:
        """Back along the path it came, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        held, box_id = self._held, self._gripper.box_id
        if held is None or box_id is None:
            return False
        back = reversed_path(held.path, self._driver.commanded)
        timed = self._planning.timed(back, held.load)
        if timed is None:
            msg = f'no way back is within the limits of the arm with box {box_id} in the gripper'
            raise MotionError(ErrorCode.LIMITS_EXCEEDED, msg)
        lost = ''
        try:
            self._driver.follow(timed, load=held.load)
            self._driver.hold(RELEASE_S)
        except Interrupted as end:
            if end.code is not ErrorCode.BOX_LOST:
                raise MotionError(end.code, f'on the way back: {end}') from end
            lost = str(end)
        self._gripper.release()
        self._held = None
        self._world.settle([box_id], SETTLE_TIMEOUT_S)
        if self._under_way is not None and not lost:
            self._under_way = self._under_way[0], Leg.APPROACH
        if self._is_back(box_id, held.taken_at):
            self._presented = box_id
            return True
        where = self._world.pose(box_id).position
        self.take_away(box_id)
        x, y, z = where
        lost = lost or f'it came to rest at ({x:.2f}, {y:.2f}, {z:.2f}) m, not where it was'
        raise MotionError(ErrorCode.BOX_LOST, f'on the way back: {lost}')

    def _is_back(self, box_id: str, taken_at: Pose) -> bool:
        size = self._world.boxes[box_id].size
        return corner_distance(self._world.pose(box_id), taken_at, size) < _BACK_ON_BELT

    def withdraw(self) -> bool:
        """Along a way checked before, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        if self._under_way is None:
            return True
        if self._gripper.box_id is not None:
            return False
        for way in ways_out(*self._under_way, self._driver.commanded):
            if all(self._followed(path) for path in way):
                self._under_way = None
                return True
        return False

    def _followed(self, path: NDArray[np.float64]) -> bool:
        """Whether the empty arm came along ``path`` (n, 7)."""
        if np.abs(path[-1] - self._driver.commanded).max() < _THERE:
            return True
        timed = self._planning.timed(path, None)
        return timed is not None and self._driver.came_along(timed)
