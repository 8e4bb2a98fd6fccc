"""One placement from the admitted goal to its report, on the thread that owns the arm."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from arm_executor.bins.book import BinBook
from arm_executor.bins.book_state import BinHasChanged
from arm_executor.bins.records import Step, placed_of
from arm_executor.goals.arm_request import aside_in_bin, request_of
from arm_executor.goals.belt_view import BeltClock, BeltView
from arm_executor.goals.judging import expected_rest, judge
from arm_executor.goals.outputs import BinsChanged, Happened, Output, Progress, Said
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.goals.plan_cache import PlanCache
from arm_executor.goals.reports import GoalTimes, placement_report
from arm_executor.goals.waiting import Waiting, waiting_for
from arm_executor.model.arm_interface import Arm, MotionError, MotionHooks, MotionPlan, MotionResult
from arm_executor.model.pick_area import as_text
from arm_executor.parameters import ExecutorSettings
from pack_msgs_py.cell_values import MOTION_PLAN_S, Report
from pack_msgs_py.codes import ErrorCode, Phase, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import resting_pose, with_poses
from pack_msgs_py.picking import expected_pick
from pack_msgs_py.values import Bin

#: Why a box goes back to the belt, when it is not because a motion failed.
_WHY_RETURNED = {
    ErrorCode.CANCELED: Reason.OPERATOR,
    ErrorCode.BOX_MISMATCH: Reason.INVALID_DATA,
}
#: A motion takes up to this much longer than predicted: trajectories run in whole steps.
EXECUTION_SLACK_S = 0.05
#: Progress is told at each new phase, and then at each further share of the whole.
PROGRESS_STEP = 0.05


@dataclass(frozen=True)
class Tools:
    """What a placement works with.

    Attributes
    ----------
    arm, book : what moves, and where it is written down.
    belt, clock : the latest scan, and the robot time that the belt has had.
    plans : motions that were planned before.
    settings : how the core works.
    emit : takes what there is to tell.
    steady, wall : clocks, seconds of no particular origin and since the epoch.
    """

    arm: Arm
    book: BinBook
    belt: BeltView
    clock: BeltClock
    plans: PlanCache
    settings: ExecutorSettings
    emit: Callable[[Output], None]
    steady: Callable[[], float]
    wall: Callable[[], float]


class Placing:
    """A goal that was admitted; it came at ``received_s``, seconds since the epoch.

    ``stop`` ends it, or :meth:`halt`: the arm comes to rest, and the box goes back to the belt,
    unless the pad has already let go. :attr:`remaining_s` and :attr:`plan`, the motion once it is
    under way, may be read from any thread. When :attr:`abandoned` is set the box stays where it is,
    and the next start of the executor finds it in the journal.
    """

    def __init__(self, goal: PlaceGoal, tools: Tools, received_s: float) -> None:
        self.goal = goal
        self._tools = tools
        self._arm, self._book, self._belt = tools.arm, tools.book, tools.belt
        self._emit = tools.emit
        self.stop = threading.Event()
        self.remaining_s = 0.0
        self.plan: MotionPlan | None = None
        self.heard_s = math.inf
        self.needs_reset = False
        self.abandoned = False
        self._received_s = tools.steady()
        self._budget_s = goal.deadline_s - received_s
        self._planning_s = 0.0
        self._waited = Waiting()
        self._told: tuple[Phase, float] | None = None
        self._halted: tuple[ErrorCode, str] | None = None

    def halt(self, code: ErrorCode, text: str) -> None:
        """Stop for another reason than a request to cancel; the first one counts."""
        self._halted = self._halted or (code, text)
        self.stop.set()

    def run(self) -> Report:
        """Do it, whatever comes, and say how it ended."""
        self._tell(Phase.PLANNING, 0.0)
        if not self._tools.settings.counts:
            self._planning_s = self._tools.steady() - self._received_s
        try:
            self._look()
            # While the belt still brings the box.
            self._waited = self._waiting()
            self._plan()
            self._wait()
            # With all on the belt as it lies now; mostly it is the same plan.
            plan = self._plan()
        except MotionError as error:
            code, text = self._stopped(error.code, str(error))
            self.needs_reset = code is ErrorCode.PROTECTIVE_STOP
            return self._report(code, text, MotionResult(code))
        try:
            self._book.begin(self.goal.decision, self.goal.goal_id)
        except BinHasChanged as error:
            # Boxes that people have put in or taken out were measured meanwhile.
            code = ErrorCode.STALE_BIN_REVISION
            return self._report(code, str(error), MotionResult(code))
        self.plan, self.heard_s = plan, self._tools.steady()
        result = self._arm.execute(plan, self._hooks(plan), self.stop)
        self.heard_s = math.inf
        code, text = self._stopped(result.code, result.message)
        result = replace(result, code=code, message=text)
        self._tools.plans.moved(plan, as_planned=result.code.box_is_in_bin)
        if self.abandoned:
            return self._report(ErrorCode.CANCELED, 'the executor was ended', result)
        report = self._resolve(result)
        if not self.needs_reset:
            # Where a motion ended early is no place to plan the next one from.
            if not self._arm.withdraw():
                text = 'the arm cannot go back to where it waits; it stays where the motion ended'
                self._emit(Said('warning', text))
            if not result.code.box_is_in_bin:
                self._tools.plans.clear()
        return report

    def _stopped(self, code: ErrorCode, text: str) -> tuple[ErrorCode, str]:
        """Code and message of an end, which was no request to cancel when it was :meth:`halt`."""
        if code is ErrorCode.CANCELED and self._halted is not None:
            return self._halted
        return code, text

    def _look(self) -> None:
        """Where the box will lie when it is taken; ``MotionError`` where the arm cannot take it."""
        goal, scan = self.goal, self._belt.scan
        box_id = goal.decision.box.id
        refusal = self._tools.settings.pick_area.refusal_now(box_id, goal.pick, scan)
        if refusal:
            msg = f'box {box_id!r} cannot be taken where the belt holds it, at {refusal}'
            raise MotionError(ErrorCode.BOX_NOT_PRESENTED, msg)
        self.goal = replace(goal, pick=expected_pick(goal.pick, box_id, scan))

    def _plan(self) -> MotionPlan:
        """Plan the motion; ``MotionError`` when there is none, or none that is short enough."""
        started, counts = self._tools.steady(), self._tools.settings.counts
        spent_s = MOTION_PLAN_S
        try:
            sigmas = self._tools.settings.profile.size_sigmas
            request = request_of(self.goal, self._bin().station, self._belt.scan, sigmas)
            plan = self._tools.plans.plan(self._arm, request, self._book.state.poses)
            spent_s = MOTION_PLAN_S if plan.planning_s else 0.0
        finally:
            self._planning_s += spent_s if counts else self._tools.steady() - started
        self.remaining_s = plan.predicted_s
        tray_s = self._waited.tray_s
        needed_s = self._planning_s + tray_s + plan.predicted_s + EXECUTION_SLACK_S
        if self._tools.settings.enforce_deadline and needed_s > self._budget_s:
            tray = f', the tray keeps it waiting for {tray_s:.2f} s' if tray_s else ''
            text = (
                f'planning took {self._planning_s:.3f} s and the motion needs '
                f'{plan.predicted_s:.2f} s{tray}, the deadline leaves {self._budget_s:.2f} s'
            )
            raise MotionError(ErrorCode.DEADLINE_UNREACHABLE, text)
        return plan

    def _bin(self) -> Bin:
        target = self._book.state.find(self.goal.decision.bin_id)
        if target is None:
            msg = f'bin {self.goal.decision.bin_id!r} was taken away while it was in use'
            raise RuntimeError(msg)
        return target

    def _wait(self) -> None:
        """Until the belt holds the box at the pick point; ``MotionError`` if it does not come."""
        box_id, pick = self.goal.decision.box.id, self.goal.pick
        self._tell(Phase.WAITING, 0.0)
        timeout_s = self._tools.settings.present_timeout_s
        waited = self._waiting()
        scanned = self._belt.wait_presented(box_id, pick, timeout_s, self.stop.is_set)
        if self.stop.is_set():
            msg = f'canceled before box {box_id!r} was picked'
            raise MotionError(ErrorCode.CANCELED, msg)
        if scanned is None:
            shown = None if self._belt.scan is None else self._belt.scan.find(box_id)
            why = 'left the belt'
            if shown is not None:
                why = f'did not come to the pick point, lying as asked, within {timeout_s:g} s'
                if shown.pick_open_s is not None:
                    why += f'; it is at {as_text(shown.pose, pick)} from that'
            msg = f'box {box_id!r} {why}'
            raise MotionError(ErrorCode.BOX_NOT_PRESENTED, msg)
        self._waited = waited
        self._look()

    def _waiting(self) -> Waiting:
        """How long the belt and the tray keep the arm waiting, from now on."""
        goal, hidden_s = self.goal, self._tools.clock.elapsed_s(self._planning_s)
        tilt_time_s = self._tools.settings.tilt_time_s
        box_id, scan = goal.decision.box.id, self._belt.scan
        return waiting_for(box_id, goal.pick, scan, hidden_s, tilt_time_s)

    def _hooks(self, plan: MotionPlan) -> MotionHooks:
        def phase(now: Phase, fraction: float) -> None:
            self.heard_s = self._tools.steady()
            self.remaining_s = plan.predicted_s * (1.0 - fraction)
            spent = self._planning_s + self._waited.tray_s + plan.predicted_s * fraction
            self._tell(now, fraction, spent)

        return MotionHooks(
            phase=phase,
            picked=lambda: self._emit(Happened(self._book.picked())),
            releasing=self._book.releasing,
            released=self._book.placed,
        )

    def _tell(self, phase: Phase, fraction: float, spent_s: float = 0.0) -> None:
        told = self._told
        if told is not None and told[0] is phase and fraction < told[1] + PROGRESS_STEP:
            return
        self._told = (phase, fraction)
        self._emit(Progress(self.goal.goal_id, phase, fraction, self._budget_s - spent_s))

    # -- how it ended ---------------------------------------------------------------------------

    def _resolve(self, result: MotionResult) -> Report:
        """Where is the box? What the arm holds, and the last step written down, say it."""
        attempt = self._book.attempt
        step = Step.PLANNED if attempt is None else attempt.step
        if step is not Step.PLANNED:
            self._tools.clock.motion_ended(result.split_s)
        self.needs_reset = result.code is ErrorCode.PROTECTIVE_STOP
        held = self._arm.holds()
        if result.on_belt:
            return self._returned(result, result.message)
        if step is Step.PLANNED and held is None:
            if result.code is ErrorCode.NONE:
                msg = 'the arm reports success but has not picked the box'
                raise RuntimeError(msg)
            self._book.forgotten()
            return self._report(result.code, result.message, result)
        if step.in_bin and held is None:
            return self._in_bin(result)
        if held is not None:
            return self._held(result)
        return self._lost(result)

    def _held(self, result: MotionResult) -> Report:
        """The box is in the gripper: back to the belt with it, unless a person must look first."""
        if self.needs_reset:
            return self._report(result.code, result.message, result)
        text = result.message or f'the motion ended with {result.code.name}'
        why = 'the box could not be brought back to the belt'
        try:
            if self._arm.return_to_belt():
                return self._returned(result, text)
        except MotionError as error:
            why = str(error)
        text = f'{text}; {why}'
        if self._arm.holds() is None:
            return self._lost(replace(result, message=text))
        self.needs_reset = True
        text = f'{text}; the box is in the gripper'
        return self._report(ErrorCode.PROTECTIVE_STOP, text, result)

    def _returned(self, result: MotionResult, text: str) -> Report:
        reason = _WHY_RETURNED.get(result.code, Reason.FAULT)
        self._emit(Happened(self._book.returned(reason, text)))
        return self._report(result.code, text, result)

    def _lost(self, result: MotionResult) -> Report:
        """Nobody knows where the box is, and what it did to the others: measure them again."""
        serial = self._bin().serial
        box_id = self.goal.decision.box.id
        text = result.message or f'box {box_id!r} is neither in the gripper nor in its bin'
        self._emit(Happened(self._book.lost(text)))
        self._emit(Said('error', f'box {box_id!r} is lost: {text}'))
        state = self._book.state
        self._book.settled(self._arm.set_bins(state.bins, state.poses), frozenset({serial}))
        self._emit(BinsChanged(self._book.state))
        return self._report(ErrorCode.BOX_LOST, text, result)

    def _in_bin(self, result: MotionResult) -> Report:
        decision = self.goal.decision
        placed = placed_of(decision)
        target = self._bin()
        if result.measured is None:
            result = self._measure(result)
        standing = with_poses(target.boxes, self._book.state.poses)
        sigmas = self._tools.settings.profile.size_sigmas
        aside = aside_in_bin(decision.box, self.goal.pick, decision.target, sigmas)
        rest = resting_pose(placed, decision.target, standing)
        expected = expected_rest(rest, aside, result.measured)
        slack_s = self._budget_s - self._planning_s - self._waited.tray_s - result.motion_s
        code, text = judge(
            result,
            placed,
            expected,
            self._tools.settings.tolerance,
            size_sigmas=sigmas,
            slack_s=slack_s,
        )
        known = {other.box.id for other in target.boxes}
        others = {key: pose for key, pose in result.others.items() if key in known}
        self._emit(Happened(self._book.verified(result.measured, others)))
        self._emit(BinsChanged(self._book.state))
        return self._report(code, text, result, expected)

    def _measure(self, result: MotionResult) -> MotionResult:
        """The motion ended after the release but before the measurement: do it now."""
        placed, state = placed_of(self.goal.decision), self._book.state
        target = self._bin()
        bins = tuple(
            replace(bin_, boxes=(*bin_.boxes, placed)) if bin_.serial == target.serial else bin_
            for bin_ in state.bins
        )
        poses = {**state.poses, placed.box.id: self.goal.decision.target}
        settled = self._arm.set_bins(bins, poses)
        return replace(
            result,
            measured=settled[placed.box.id],
            others={other.box.id: settled[other.box.id] for other in target.boxes},
        )

    def _report(
        self, code: ErrorCode, text: str, result: MotionResult, expected: Pose | None = None
    ) -> Report:
        ended = replace(result, code=code, message=text)
        times = GoalTimes(self._budget_s, self._planning_s, self._waited)
        return placement_report(self.goal, ended, times, self._tools.wall(), expected)
