"""Answers check_placements on a thread of its own, so that the arm can move meanwhile.

An arm that can predict does so first, and only what that lets through is planned. While a goal
runs, candidates are judged by what the bins will be when it has succeeded, and their
motions start where the running one ends.
"""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from arm_executor.bins.records import placed_of
from arm_executor.goals.admission import AdmissionState, admit
from arm_executor.goals.arm_request import request_of
from arm_executor.goals.outputs import Checked, Output, Replied, Said, Ticket
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.goals.placing import Placing, Tools
from arm_executor.goals.waiting import waiting_for
from arm_executor.model.arm_interface import (
    MotionError,
    MotionUnderWay,
    PlaceRequest,
    PredictingArm,
)
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.geometry.resting import resting_pose, with_measured, with_poses
from pack_msgs_py.picking import expected_pick

#: More candidates of one request than this are answered with BUSY, and those after so many whose
#: motion was planned, since that is slow.
MAX_CANDIDATES, MAX_PLANNED = 64, 8


@dataclass(frozen=True)
class CandidateView:
    """What candidates are judged by at this moment; ``tools`` is ``None`` until the arm is there.

    ``after`` is the motion that is under way; ``in_step`` says that the arm's world holds the bins
    of the book.
    """

    state: AdmissionState
    tools: Tools | None
    after: MotionUnderWay | None = None
    in_step: bool = True


def foresee(view: CandidateView, placing: Placing | None, *, under_way: bool) -> CandidateView:
    """``view`` as it will be when the motion of ``placing`` has succeeded, if one is under way."""
    plan = None if placing is None else placing.plan
    if placing is None or plan is None:
        return view
    decision = placing.goal.decision
    now = view.state.bins
    target = now.find(decision.bin_id)
    if target is None:
        return view
    poses = now.poses
    idle = replace(view.state, mode=Mode.IDLE, busy_with='')
    if any(placed.box.id == decision.box.id for placed in target.boxes):
        # measured and written down already; only the report is still to come
        return replace(view, state=idle)
    if not under_way:
        return view
    placed = placed_of(decision)
    rest = resting_pose(placed, decision.target, with_poses(target.boxes, poses))
    # As the planner expects it: with its top where it will be, not where it was planned.
    boxes = (*target.boxes, with_measured(placed, rest))
    expected = replace(target, boxes=boxes, revision=target.revision + 1)
    bins = replace(
        now,
        revision=now.revision + 1,
        bins=tuple(expected if bin_.serial == target.serial else bin_ for bin_ in now.bins),
        poses={**poses, decision.box.id: rest},
    )
    ids = {*view.state.ids_in_bins, decision.box.id}
    state = replace(idle, bins=bins, ids_in_bins=ids)
    return replace(view, state=state, after=MotionUnderWay(plan, rest))


class CandidateChecker:
    """A thread that asks the arm about candidates; ``emit`` takes a list of :class:`Checked`."""

    def __init__(self, view: Callable[[], CandidateView], emit: Callable[[Output], None]) -> None:
        self._view = view
        self._emit = emit
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name='checks', daemon=True)
        self._ended = threading.Event()
        self._planned = 0

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def end(self, timeout_s: float) -> bool:
        """Finish the candidate at hand and stop; whether that happened in time."""
        self._ended.set()
        self._jobs.put(None)
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def check(self, ticket: Ticket, goals: Sequence[PlaceGoal], enough_s: float = 0.0) -> None:
        """Answer for each of ``goals``; the first within ``enough_s`` is the last looked at."""
        self._jobs.put(lambda: self._answer(ticket, goals, enough_s))

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None and not self._ended.is_set():
            job()

    def _answer(self, ticket: Ticket, goals: Sequence[PlaceGoal], enough_s: float) -> None:
        answers: list[Checked] = []
        self._planned = 0
        try:
            while len(answers) < len(goals) and not self._ended.is_set():
                answer = self._checked(len(answers), goals[len(answers)], enough_s)
                answers.append(answer)
                if answer.code is ErrorCode.NONE and answer.motion_s <= enough_s:
                    text = f'not looked at, since candidate {len(answers)} will do'
                    answers += [Checked(ErrorCode.BUSY, text)] * (len(goals) - len(answers))
        except Exception:
            self._emit(Said('error', f'check_placements failed\n{traceback.format_exc()}'))
            failed = Checked(ErrorCode.UNKNOWN, 'the executor failed; see its log')
            answers += [failed] * (len(goals) - len(answers))
        self._emit(Replied(ticket, answers))

    def _checked(self, index: int, goal: PlaceGoal, enough_s: float) -> Checked:
        if index >= MAX_CANDIDATES:
            text = f'candidate {index + 1}: at most {MAX_CANDIDATES} are looked at in one request'
            return Checked(ErrorCode.BUSY, text)
        view = self._view()
        refusal = admit(goal, view.state, with_deadline=False)
        if refusal is not None:
            return Checked(refusal.code, refusal.message)
        bins = view.state.bins
        target = bins.find(goal.decision.bin_id)
        if view.tools is None or not view.in_step or target is None:
            return Checked(ErrorCode.BUSY, 'a bin is just being changed; ask again')
        tools = view.tools
        try:
            sigmas = tools.settings.profile.size_sigmas
            scan, box_id = view.state.scan, goal.decision.box.id
            refused = tools.settings.pick_area.refusal_now(box_id, goal.pick, scan)
            if refused:
                text = f'box {box_id!r} cannot be taken where the belt holds it, at {refused}'
                return Checked(ErrorCode.BOX_NOT_PRESENTED, text)
            goal = replace(goal, pick=expected_pick(goal.pick, box_id, scan))
            request = request_of(goal, target.station, scan, sigmas)
            tray_s = _tray_s(goal, view, tools)
            if isinstance(tools.arm, PredictingArm):
                unlikely = _unlikely(tools.arm, request, view.after, tray_s, enough_s)
                if unlikely is not None:
                    return unlikely
            if self._planned >= MAX_PLANNED:
                text = f'at most {MAX_PLANNED} motions are planned in one request'
                return Checked(ErrorCode.BUSY, text)
            self._planned += 1
            plan = tools.plans.plan(tools.arm, request, bins.poses, view.after)
        except MotionError as error:
            return Checked(error.code, str(error))
        return Checked(ErrorCode.NONE, '', plan.predicted_s + tray_s)


def _tray_s(goal: PlaceGoal, view: CandidateView, tools: Tools) -> float:
    """How long the arm would wait for the tilt tray, seconds."""
    hidden_s = tools.clock.elapsed_s() if view.after is None else view.after.plan.after_pick_s
    box_id, tilt_time_s = goal.decision.box.id, tools.settings.tilt_time_s
    return waiting_for(box_id, goal.pick, view.state.scan, hidden_s, tilt_time_s).tray_s


def _unlikely(
    arm: PredictingArm,
    request: PlaceRequest,
    after: MotionUnderWay | None,
    tray_s: float,
    enough_s: float,
) -> Checked | None:
    """Why planning is not worth while, with the seconds that are predicted; else ``None``."""
    try:
        seconds = arm.predict(request, after) + tray_s
    except MotionError as error:
        return Checked(error.code, str(error), predicted=True)
    if enough_s <= 0 or seconds <= enough_s:
        return None
    text = f'the motion takes about {seconds:.2f} s, {enough_s:.2f} s will do'
    return Checked(ErrorCode.DEADLINE_UNREACHABLE, text, seconds, predicted=True)
