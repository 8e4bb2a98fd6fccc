"""The arm that really moves: a robot model in PyBullet under position control.

Two physics clients: one is the world, where boxes have mass and fall; the other only answers
whether a configuration would touch anything. Fulfils :class:`arm_executor.model.arm_interface.Arm`.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.physics.driver import ArmDriver
from arm_executor.arms.physics.execution import Held, Interrupted, Run
from arm_executor.arms.physics.gripper import SuctionGripper
from arm_executor.arms.physics.render import Camera, save_picture
from arm_executor.arms.physics.standing_bins import SETTLE_TIMEOUT_S, Stand, Stands
from arm_executor.arms.physics.tolerances import Tolerances
from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.arms.true_boxes import Truth, mismatch
from arm_executor.model.arm_interface import (
    Ahead,
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
    PlaceRequest,
)
from arm_executor.model.layout import Layout, check_layout, conveyor_block
from arm_executor.model.pose_error import corner_distance, folded, turn_between
from arm_executor.model.robot_data import find_robot
from arm_executor.model.suction import check_grip
from arm_executor.model.tree import CELL_JOINT_NAMES
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.grasp import as_taken
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.stances import GRIP_S, RELEASE_S
from arm_executor.motion.template import metres
from arm_executor.motion.timing import Load, MotionLimits
from arm_executor.motion.way_back import Leg, reversed_path, ways_out
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.values import Bin, BinSpec, Box

#: A box brought back to the belt is there when it stands this near to where it was, metres.
_BACK_ON_BELT = 0.02
#: A box that comes off the pad so near to its place has met what is under it, metres.
_LANDED = 0.03
#: The arm need not move to where it is already, radians and metres of its joints.
_THERE = 1e-3


class PhysicsArm:
    """A robot arm with its cell in PyBullet.

    Parameters
    ----------
    layout : which robot it is, and where everything stands.
    speed : robot seconds per wall-clock second; 0 as fast as possible.
    bin_spec : kind of bin that every station is checked for; ``None`` to check when bins come.
    tolerance_mm, angle_tolerance_deg, others_tolerance_mm : what counts as placed.
    limits : assumed limits of motion.
    truth : what the boxes really are; without it they are as scanned.

    Raises
    ------
    LayoutError
        The layout cannot be built with these bins.
    ValueError
        There is no such robot.
    MotionError
        ``START_STATE_INVALID``: the robot cannot reach the pick point from its rail.
    """

    def __init__(
        self,
        layout: Layout | None = None,
        speed: float = 0.0,
        bin_spec: BinSpec | None = None,
        tolerance_mm: float = 5.0,
        angle_tolerance_deg: float = 1.0,
        others_tolerance_mm: float = 5.0,
        limits: MotionLimits | None = None,
        truth: Truth | None = None,
    ) -> None:
        self._truth = truth or Truth()
        self.layout = layout or Layout()
        robot = find_robot(self.layout.robot)
        check_layout(self.layout, {} if bin_spec is None else dict.fromkeys('ABC', bin_spec))
        self._tolerances = Tolerances(
            tolerance_mm / 1000, math.radians(angle_tolerance_deg), others_tolerance_mm / 1000
        )
        self.world = PhysicsWorld(robot, self.layout, speed)
        self.gripper = SuctionGripper(self.world, self.layout.tool)
        self._planning = PlanningWorld(robot, self.layout)
        self._planning.set_block(conveyor_block(self.layout))
        self._planner = MotionPlanner(
            robot, self.layout, limits or MotionLimits(), self._planning, STEP_S
        )
        self._stands = Stands(self.layout, self.world, self._planning)
        self._driver = ArmDriver(self.world, self.gripper, self._planner.home())
        self._presented: str | None = None
        self._held: Held | None = None
        # The motion that is under way or ended early, and where in it the arm is.
        self._under_way: tuple[PlannedMotion, Leg] | None = None
        # The world for planning is used by the thread that moves and by one that plans ahead.
        self._planning_lock = threading.RLock()

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """See :meth:`arm_executor.model.arm_interface.Arm.set_bins`.

        Raises
        ------
        LayoutError
            A station is not known, or a bin of this size does not fit there.
        ValueError
            A box has no pose.
        """
        box_ids = {placed.box.id for one in bins for placed in one.boxes}
        for box_id in box_ids & {self.gripper.box_id, self._presented}:
            self._take_away(box_id)
        self._truth.keep(box_ids)
        bins = [
            replace(one, boxes=tuple(replace(p, box=self._truth.box(p.box)) for p in one.boxes))
            for one in bins
        ]
        with self._planning_lock:
            return self._stands.set_bins(bins, poses)

    def plan(self, request: PlaceRequest, ahead: Ahead | None = None) -> MotionPlan:
        """See :meth:`arm_executor.model.arm_interface.Arm.plan`."""
        with self._planning_lock:
            return self._planned(request, ahead)

    def _planned(self, request: PlaceRequest, ahead: Ahead | None) -> MotionPlan:
        begun = time.perf_counter()
        stand = self._stands.find(request.station)
        if stand is None:
            msg = f'no bin stands at station {request.station!r}; open one there first'
            raise MotionError(ErrorCode.INVALID_GOAL, msg)
        if ahead is not None:
            with self._stands.expecting(stand, ahead) as site:
                motion = self._planner.plan(request, ahead.plan.detail.retreat.q[-1], site)
            return MotionPlan(request, motion.duration, time.perf_counter() - begun, motion)
        if self.gripper.box_id is not None:
            msg = f'the arm still holds box {self.gripper.box_id}; return it to the belt first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        check_grip(self.layout.tool, request.box)
        motion = self._planner.plan(request, self._driver.commanded, self._stands.site(stand))
        return MotionPlan(request, motion.duration, time.perf_counter() - begun, motion)

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """See :meth:`arm_executor.model.arm_interface.Arm.execute`."""
        motion: PlannedMotion = plan.detail
        stand = self._stands.find(plan.request.station)
        if stand is None:
            msg = f'the bin at station {plan.request.station!r} has gone since this was planned'
            return MotionResult(ErrorCode.INVALID_GOAL, msg)
        if np.abs(motion.approach.q[0] - self._driver.commanded).max() > 1e-6:
            msg = 'the arm has moved since this was planned; plan it again'
            return MotionResult(ErrorCode.START_STATE_INVALID, msg)
        astray = self._driver.astray(motion.approach.q[0])
        if astray:
            return MotionResult(ErrorCode.START_STATE_INVALID, astray)
        run = Run(plan, hooks, stop)
        before = {box_id: self.world.pose(box_id) for box_id in stand.box_ids}
        try:
            self._place(run, motion, stand)
        except Interrupted as end:
            return self._ended_early(run, stand, before, end)
        return self._measured(run, stand, before)

    def _place(self, run: Run, motion: PlannedMotion, stand: Stand) -> None:
        request, driver = run.plan.request, self._driver
        box = request.box
        self._bring(box, request.pick)
        self._under_way = motion, Leg.APPROACH
        driver.follow(motion.approach, run, [(0.0, Phase.APPROACHING)])
        run.enter(Phase.GRASPING)
        driver.rest(run, GRIP_S)
        taken = as_taken(request)
        tilts = taken is not request
        if not self.gripper.attach(box.id, metres(taken.box.size_mm) if tilts else None):
            gap, face = 1000 * self.gripper.gap(box.id), 'front' if tilts else 'top'
            msg = f'box {box.id}: no vacuum builds up, the pad is {gap:.1f} mm from its {face}'
            raise Interrupted(ErrorCode.GRASP_FAILED, msg)
        self._presented = None
        size = metres(taken.box.size_mm)
        load = Load(box.weight_kg, size, metres(taken.box.com_offset_mm), tilts)
        self._held = Held(self.world.pose(box.id), motion.carry_path, load)
        self._truth.picked(box.id)
        run.hooks.picked()
        wrong = mismatch(box, self._truth.box(box))
        if wrong:
            raise Interrupted(ErrorCode.BOX_MISMATCH, wrong)
        lowering = (motion.lowering_s, Phase.LOWERING)
        self._under_way = motion, Leg.CARRY
        try:
            driver.follow(motion.carry, run, [(0.0, Phase.TRANSFERRING), lowering])
        except Interrupted as end:
            pose = stand.frame.from_cell(self.world.pose(box.id))
            near = corner_distance(folded(pose, request.target), request.target, size) < _LANDED
            if end.code is not ErrorCode.BOX_LOST or not near:
                raise
            self._landed(run, stand)
            return
        run.enter(Phase.RELEASING)
        driver.rest(run, RELEASE_S / 2)
        run.hooks.releasing()
        self.gripper.release()
        self._held = None
        stand.box_ids.append(box.id)
        self._under_way = motion, Leg.RETREAT
        run.hooks.released()
        self.world.doze(stand.box_ids)
        driver.rest(run, RELEASE_S / 2)
        driver.follow(motion.retreat, run, [(0.0, Phase.RETREATING)])
        self._under_way = None

    def _landed(self, run: Run, stand: Stand) -> None:
        """The box came off the pad on what is under it: it stands in the bin; the arm goes back."""
        run.enter(Phase.RELEASING)
        run.hooks.releasing()
        self.gripper.release()
        self._held = None
        stand.box_ids.append(run.plan.request.box.id)
        run.hooks.released()
        self.withdraw()

    def present(self, box: Box, pick: Pose) -> None:
        """Put ``box`` on the belt at ``pick``, frame `cell`, in place of what was there."""
        if self._presented is not None:
            self._take_away(self._presented)
        self._take_away(box.id)
        self.world.add_box(box, pick)
        self._presented = box.id

    def _bring(self, box: Box, pick: Pose) -> None:
        """As the belt does: have ``box``, as it really is, at the pick point."""
        true = self._truth.find(box.id)
        if true is not None:
            self.present(true.box, true.pose)
        elif self._presented == box.id:
            self.world.move_box(box.id, pick)
        else:
            self.present(box, pick)
        self.gripper.approach(box.id)

    def _take_away(self, box_id: str) -> None:
        """The box is in neither world any more."""
        if self.gripper.box_id == box_id:
            self.gripper.release()
            self._held = None
        if self._presented == box_id:
            self._presented = None
        with self._planning_lock:
            self._stands.forget(box_id)

    def _measured(self, run: Run, stand: Stand, before: Mapping[str, Pose]) -> MotionResult:
        """Let everything settle and compare with what was asked."""
        request, world = run.plan.request, self.world
        box_id = request.box.id
        run.finish()
        run.enter(Phase.SETTLING)
        settling = world.settle(stand.box_ids, SETTLE_TIMEOUT_S)
        run.tick(round(settling / STEP_S))
        size = world.boxes[box_id].size
        measured = stand.frame.from_cell(world.pose(box_id))
        if not stand.contains(measured, size):
            self._take_away(box_id)
            others, moved = self._others(stand, before)
            x, y, z = measured.position
            msg = (
                f'box {box_id} came to rest at ({x:.2f}, {y:.2f}, {z:.2f}) m of bin frame '
                f'{stand.station}, outside the bin; it was taken out of the cell'
            )
            return run.result(ErrorCode.BOX_LOST, msg, None, others, moved)
        measured = folded(measured, request.target)
        others, moved = self._others(stand, before)
        error = corner_distance(measured, request.target, size)
        angle = turn_between(measured, request.target)
        code, text = self._tolerances.judged(request, error, angle, moved)
        return run.result(code, text, measured, others, moved)

    def _others(self, stand: Stand, before: Mapping[str, Pose]) -> tuple[dict[str, Pose], float]:
        """Poses of the boxes that were there before, and how far the worst of them moved."""
        moved, others = 0.0, {}
        for box_id, was in before.items():
            pose = self.world.pose(box_id)
            others[box_id] = stand.frame.from_cell(pose)
            moved = max(moved, corner_distance(pose, was, self.world.boxes[box_id].size))
        with self._planning_lock:
            self._stands.show_planner(stand)
        return others, moved

    def _ended_early(
        self, run: Run, stand: Stand, before: Mapping[str, Pose], end: Interrupted
    ) -> MotionResult:
        """The result of a motion that was interrupted; a box that fell is taken out of the cell."""
        box_id = run.plan.request.box.id
        run.finish()
        if box_id in stand.box_ids:
            # The pad has let go: what counts now is how the box stands.
            placed = self._measured(run, stand, before)
            return replace(placed, code=placed.code or end.code, message=placed.message or str(end))
        code, text, on_belt = end.code, str(end), False
        if code is ErrorCode.BOX_LOST:
            self.gripper.release()
            self.world.settle([box_id, *stand.box_ids], SETTLE_TIMEOUT_S)
            on_belt = self._held is not None and self._is_back(box_id, self._held.taken_at)
            if on_belt:
                self._presented = box_id
                code = ErrorCode.BOX_MISMATCH
                text += '; it stands on the belt where it was, so it is not what the scan says'
            else:
                self._take_away(box_id)
            self._held = None
        others, moved = self._others(stand, before)
        return replace(run.result(code, text, None, others, moved), on_belt=on_belt)

    def return_to_belt(self) -> bool:
        """Back along the path it came, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        held, box_id = self._held, self.gripper.box_id
        if held is None or box_id is None:
            return False
        back = reversed_path(held.path, self._driver.commanded)
        with self._planning_lock:
            timed = self._planner.timing.trajectory(back, held.load, STEP_S)
        if timed is not None:
            try:
                self._driver.follow(timed)
            except Interrupted as end:
                if end.code is ErrorCode.BOX_LOST:
                    self._take_away(box_id)
                return False
        self._driver.hold(RELEASE_S)
        self.gripper.release()
        self._presented, self._held = box_id, None
        self.world.settle([box_id], SETTLE_TIMEOUT_S)
        if self._under_way is not None:
            self._under_way = self._under_way[0], Leg.APPROACH
        return self._is_back(box_id, held.taken_at)

    def _is_back(self, box_id: str, taken_at: Pose) -> bool:
        size = self.world.boxes[box_id].size
        return corner_distance(self.world.pose(box_id), taken_at, size) < _BACK_ON_BELT

    def withdraw(self) -> bool:
        """Along a way checked before, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        if self._under_way is None:
            return True
        if self.gripper.box_id is not None:
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
        with self._planning_lock:
            timed = self._planner.timing.trajectory(path, None, STEP_S)
        return timed is not None and self._driver.came_along(timed)

    def holds(self) -> str | None:
        """See :meth:`arm_executor.model.arm_interface.Arm.holds`."""
        return self.gripper.box_id

    def hold_still(self, seconds: float) -> None:
        """Let ``seconds`` of robot time pass with the arm where it is."""
        self._driver.hold(seconds)

    def tracking_error(self) -> float:
        """See :meth:`arm_executor.model.arm_interface.Arm.tracking_error`."""
        return self._driver.tracking_error

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """See :meth:`arm_executor.model.arm_interface.Arm.joint_positions`."""
        return CELL_JOINT_NAMES, self._driver.positions

    def render(
        self, path: Path, width: int = 960, height: int = 640, camera: Camera | None = None
    ) -> None:
        """Save a picture of the cell as it is now, PNG."""
        save_picture(self.world, path, width, height, camera)

    def close(self) -> None:
        """See :meth:`arm_executor.model.arm_interface.Arm.close`."""
        self.world.close()
        self._planning.close()
