"""The planner's state machine: when to decide, announce, send, close a bin, and when to wait.

It knows no ROS: inputs arrive as method calls, what it wants done goes through :class:`Outputs`,
and time is a steady clock that is passed in. Every wait ends by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_msgs_py.values import Bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.coordination.answers import TRANSIENT, CheckAnswer
from pack_planner.coordination.awaited_bins import AwaitedBins
from pack_planner.coordination.bin_answers import BinAnswers
from pack_planner.coordination.doing import Doing, what_is_done
from pack_planner.coordination.inputs import Heartbeat, Inputs, same_content
from pack_planner.coordination.negotiation import (
    COUNTED_TIMEOUT_S,
    HIDDEN_TIMEOUT_S,
    LEAST_S,
    Asking,
    Talk,
    choose,
    learn,
)
from pack_planner.coordination.patience import Patience
from pack_planner.coordination.requests import CheckRequest, Outputs, PlanRequest, ReadyDecision
from pack_planner.coordination.running_goal import Failures, RunningGoal
from pack_planner.decision.pick_point import lies_oddly
from pack_planner.decision.planner import (
    CloseStep,
    PlaceStep,
    PlannerStep,
    RejectStep,
    WaitStep,
    expected_bins,
    refreshed_target,
)
from pack_planner.decision.policy import DecisionState
from pack_planner.decision.refusals import Refusals

#: Backstop behind the QoS events of the heartbeat.
SILENCE_S = 2.0


class Coordinator:
    """See the module. All methods are called from one thread."""

    def __init__(
        self,
        outputs: Outputs,
        clock: Callable[[], float],
        look_ahead: int,
        asking: Asking | None = None,
        patience: Patience | None = None,
    ) -> None:
        self.look_ahead = look_ahead
        self._patience = patience or Patience(look_ahead)
        self.asking = asking or Asking()
        self._out = outputs
        self._clock = clock
        self._in = Inputs()
        self._refusals = Refusals()
        self._answers = BinAnswers()
        self._failures = Failures()
        self._alive = self._was_lost = False
        self._heard_s = -math.inf
        self._numbers = 0
        self._plan: PlanRequest | None = None
        self._asked: CheckRequest | None = None
        self._ahead: ReadyDecision | None = None
        self._goal: RunningGoal | None = None
        self._free_s = -math.inf
        self._hidden_s = 0.0  # what the last motion hides of planning that is counted
        self._last_box = ''
        self._stale_inputs = False
        self._awaited_bins = AwaitedBins()
        self._held = ''

    # --- inputs ------------------------------------------------------------------------------

    def on_scan(self, scan: Scan, unusable: int = 0) -> None:
        """A snapshot of the belt; ``unusable`` boxes of it had to be left out."""
        self._in.scan, self._in.unusable = scan, unusable
        self._stale_inputs = False
        self.step()

    def on_bins(self, snapshot: BinSnapshot) -> None:
        """The current content of the bins."""
        self._in.bins = snapshot
        self._refusals.forget_old(snapshot.bins)
        self._answers.forget_gone(snapshot.bins)
        self._stale_inputs = False
        self.step()

    @property
    def lacks_bins(self) -> bool:
        """Whether the arm is there and its bins are not known."""
        return self._alive and self._in.bins is None

    def hold(self, why: str, *, quiet: bool = False) -> None:
        """Nothing new is begun for this reason; go on when it is empty. Logged unless ``quiet``."""
        if why and not self._held and not quiet:
            self._out.warn(f'nothing new is begun: {why}')
        elif self._held and not why and not quiet:
            self._out.info('goes on')
        self._held = why

    def on_heartbeat(self, heartbeat: Heartbeat) -> None:
        """The executor is alive."""
        now = self._clock()
        self._heard_s = now
        if not self._alive:
            self._alive = True
            self._out.info(f'the arm is there, mode {heartbeat.mode.name}')
            if self._was_lost:
                self._out.refresh_bins()
        self._in.heartbeat = heartbeat
        if self._goal is not None:
            self._goal.hear(heartbeat, now)
        self.step()

    def on_executor_lost(self) -> None:
        """The executor is dead or hangs: forget its goal and its bins."""
        if not self._alive:
            return
        self._alive, self._was_lost = False, True
        held = f'; goal for box {self._goal.decision.box.id!r} forgotten' if self._goal else ''
        self._out.warn(f'the arm is silent{held}; waiting for it to come back')
        self._goal = self._ahead = self._plan = self._asked = None
        self._awaited_bins = AwaitedBins()
        self._in.bins = self._in.heartbeat = None

    def on_event(self, event: BoxEvent) -> None:
        """Something happened to a box."""
        self._in.add_event(event)
        if event.event is BoxEventKind.RETURNED and self._in.is_available(event.box_id):
            self._stale_inputs = False
        goal = self._goal
        if goal is not None and event.box_id == goal.decision.box.id:
            last = self._in.last_event(event.box_id)
            goal.picked = last in (BoxEventKind.PICKED, BoxEventKind.PLACED)
        self.step()

    def on_report(self, report: Report) -> None:
        """Outcome of a goal, from the topic or from the action's result."""
        goal = self._goal
        if goal is not None and goal.matches(report) and goal.report is None:
            goal.report, goal.reported_s = report, self._clock()
        self.step()

    def on_answer(self, goal_id: bytes, *, accepted: bool) -> None:
        """The executor accepted or refused the goal; a report says why."""
        goal = self._goal
        if goal is not None and goal.goal_id == goal_id:
            goal.accepted, goal.answered_s = accepted, self._clock()
        self.step()

    def on_result(self, goal_id: bytes, report: Report | None) -> None:
        """The action ended; ``report`` is the copy in its result."""
        goal = self._goal
        if goal is not None and goal.goal_id == goal_id:
            goal.has_result = True
            if report is not None:
                self.on_report(replace(report, goal_id=goal_id))
        self.step()

    def on_swapped(self, *, success: bool, message: str) -> None:
        """Answer of `swap_bin`."""
        target = self._awaited_bins.swap_answered()
        if target is None:
            return
        if success:
            self._awaited_bins.await_change(target.id, target.revision, self._clock())
        else:
            self._out.warn(f'bin {target.id!r} was not swapped: {message}')
            self._stale_inputs = True
        self.step()

    def on_planned(self, number: int, planned: Planned | None, error: str = '') -> None:
        """A decision is ready; ``None`` with ``error`` when computing it failed."""
        plan = self._plan
        if plan is None or plan.number != number or self._asked is not None:
            return
        if planned is None:
            self._plan = None
            self._out.warn(f'no decision: {error}')
            self._stale_inputs = True
        else:
            planned = planned.limited(self.asking.candidates)
            plan = replace(plan, talk=plan.talk.thought(planned, self.asking.time))
            if self.asking.candidates and planned.candidates():
                self._ask(plan, planned)
                return
            self._settle(planned.outcome, plan)
        self.step()

    def _ask(self, plan: PlanRequest, planned: Planned) -> None:
        """Ask the arm which of the candidates it can do."""
        hidden_s = math.inf if plan.ahead and self._goal is not None else self._hidden_s
        limit_s = plan.talk.limit_s(self.asking.deadline_s, hidden_s)
        self._plan = plan
        self._asked = CheckRequest(plan, planned, limit_s, self._clock())
        self._out.check(plan.number, planned.candidates(), max(LEAST_S, limit_s))

    def on_checked(self, number: int, answers: Sequence[CheckAnswer] | None) -> None:
        """What the arm says of each candidate; ``None`` when it cannot be asked."""
        asked = self._asked
        if asked is None or asked.plan.number != number:
            return
        self._asked = None
        candidates, plan = asked.planned.candidates(), asked.plan
        chosen: Decision | None = candidates[0]
        seconds = self._clock() - asked.asked_s
        talk = plan.talk.heard(answers or (), seconds, asked.limit_s, self.asking.time)
        talk = talk.weighed(candidates, answers or (), asked.limit_s)
        plan = replace(plan, talk=talk)
        if answers is not None:
            deadline_s = self.asking.deadline_s
            learn(self._refusals, plan.bins, candidates, answers, deadline_s, self._in.scan)
            self._answers.heard(candidates, answers, deadline_s)
            chosen = choose(candidates, answers, asked.limit_s, deadline_s)
        if chosen is not None:
            self._settle(PlaceStep(plan.talk.written_into(chosen)), plan)
        else:
            self._start_plan(plan.bins, ahead=plan.ahead, talk=plan.talk)
        self.step()

    def _settle(self, outcome: PlannerStep, plan: PlanRequest) -> None:
        """The decision is made: carry it out, now or when the arm is free."""
        self._plan = None
        if self._held:
            return
        if isinstance(outcome, RejectStep):
            self._reject(outcome, plan)
        elif plan.ahead:
            if isinstance(outcome, PlaceStep):
                outcome = PlaceStep(self._announce(outcome.decision, plan))
            self._ahead = ReadyDecision(outcome, plan, self._clock())
        elif self._still_holds(outcome, plan.bins):
            self._carry_out(outcome, plan, announced=False)

    def doing(self) -> Doing:
        """What is done, and what is waited for."""
        return what_is_done(
            self._in,
            self._goal,
            alive=self._alive,
            plans=self._plan is not None,
            asks=self._asked is not None,
            swaps=bool(self._awaited_bins),
            stale=self._stale_inputs,
            held=self._held,
        )

    # --- what to do now ----------------------------------------------------------------------

    def step(self) -> None:
        """Do what can be done now; called after each input and a few times a second."""
        now = self._clock()
        self._time_outs(now)
        if self._goal is not None:
            ended = self._goal.end(now)
            if ended is not None:
                self._conclude(self._goal, *ended)
        waiting = self._plan or self._awaited_bins or self._stale_inputs or self._held
        if waiting or not self._alive or self._in.scan is None or not self._has_bins():
            return
        if self._goal is not None:
            self._plan_ahead(self._goal)
        elif self._arm_is_free():
            self._when_free()

    def _time_outs(self, now: float) -> None:
        if self._alive and now - self._heard_s > SILENCE_S:
            self.on_executor_lost()
        bins = self._in.bins.bins if self._in.bins is not None else ()
        for warning in self._awaited_bins.update(bins, now):
            self._out.warn(warning)
        asked = self._asked
        if asked is not None:
            since_s = max(asked.asked_s, self._free_s)
            patience_s = len(asked.planned.candidates()) * self.asking.timeout_s
            if self.asking.time.is_counted:
                patience_s = COUNTED_TIMEOUT_S
            elif self._goal is not None:
                patience_s = HIDDEN_TIMEOUT_S
            if now - since_s > patience_s:
                self._out.warn('no answer to check_placements; going on with the first choice')
                self.on_checked(asked.plan.number, None)

    def _arm_is_free(self) -> bool:
        heartbeat = self._in.heartbeat
        if heartbeat is None:
            return False
        if heartbeat.mode is Mode.EXECUTING and heartbeat.active_box_id == self._last_box:
            # the heartbeat is older than the report of our own goal
            return self._clock() - self._free_s < 0.5
        return heartbeat.mode is Mode.IDLE

    def _when_free(self) -> None:
        ahead, self._ahead = self._ahead, None
        if ahead is not None and self._still_holds(ahead.outcome, ahead.plan.bins):
            self._carry_out(ahead.outcome, ahead.plan, announced=True, ready_s=ahead.ready_s)
        elif self._patience.over(self._in, self._clock()):
            self._start_plan(self._bins(), ahead=False)

    def _plan_ahead(self, goal: RunningGoal) -> None:
        if not goal.picked or goal.report is not None:
            return
        ahead = self._ahead
        if ahead is not None:
            ids = tuple(box.id for box in self._in.available())
            if isinstance(ahead.outcome, PlaceStep):
                if ahead.outcome.decision.box.id in ids:
                    return
            elif ids == ahead.plan.box_ids:
                return
            self._ahead = None
        if any(item.box.id == goal.decision.box.id for item in self._scan().boxes):
            return
        if self._patience.enough(self._in):
            self._start_plan(expected_bins(self._bins(), goal.decision), ahead=True)

    def _start_plan(self, bins: tuple[Bin, ...], *, ahead: bool, talk: Talk | None = None) -> None:
        """Have a decision computed; ``talk`` is what was said when the arm refused the last one."""
        self._reject_failed(bins)
        boxes = self._in.available()[: self.look_ahead]
        self._numbers += 1
        self._plan = PlanRequest(
            self._numbers,
            bins,
            tuple(box.id for box in boxes),
            self._scan().sequence,
            ahead,
            talk or Talk(self._in.newest_stamp_s()),
        )
        forbidden, laps = self._refusals.snapshot(bins), self._in.laps(boxes)
        # Mostly the arm can do the first choice; only then more are worth their computing.
        count = self.asking.candidates if talk is not None else 1
        self._out.plan(self._numbers, DecisionState(boxes, bins, forbidden, laps), count)

    def _reject_failed(self, bins: tuple[Bin, ...]) -> None:
        for box in self._in.available():
            decision = self._failures.reject(box)
            if decision is not None:
                talk = Talk(self._in.newest_stamp_s())
                plan = PlanRequest(0, bins, (), self._scan().sequence, ahead=False, talk=talk)
                self._reject(RejectStep(decision), plan)

    def _still_holds(self, outcome: PlannerStep, bins: tuple[Bin, ...]) -> bool:
        """Whether ``outcome`` is still right for the bins and the belt as they are now."""
        if self._in.bins is None or not same_content(bins, self._bins()):
            return False
        if isinstance(outcome, PlaceStep):
            return self._in.is_available(outcome.decision.box.id)
        return True

    def _carry_out(
        self, outcome: PlannerStep, plan: PlanRequest, *, announced: bool, ready_s: float = math.inf
    ) -> None:
        if isinstance(outcome, PlaceStep):
            decision = outcome.decision
            target = self._in.open_bin(decision.bin_id)
            if announced:
                decision = refreshed_target(decision, target)
            else:
                decision = self._announce(decision, plan)
            unhidden_s = plan.talk.unhidden_s(self._hidden_s)
            if announced and not self.asking.time.is_counted:
                unhidden_s = min(unhidden_s, max(0.0, ready_s - self._free_s))
            goal_id = self._out.send(decision, target, unhidden_s)
            self._goal = RunningGoal(decision, target, goal_id, self._clock())
        elif isinstance(outcome, CloseStep):
            target = self._in.open_bin(outcome.target.id)
            reason = self._answers.reason(outcome, plan.bins, plan.box_ids)
            self._out.info(f'closing bin {target.id!r} at {target.fill_rate:.1%}: {reason.text}')
            self._out.closing(reason)
            self._hidden_s = 0.0
            self._awaited_bins.await_swap(target, self._clock())
            self._out.swap(target, outcome.destination)
        elif isinstance(outcome, WaitStep):
            self._stale_inputs = True

    def _announce(self, decision: Decision, plan: PlanRequest) -> Decision:
        stamped = replace(
            decision, scan_sequence=plan.scan_sequence, trigger_stamp_s=plan.talk.trigger_s
        )
        return self._out.announce(stamped, plan.bins)

    def _reject(self, outcome: RejectStep, plan: PlanRequest) -> None:
        decision = self._announce(outcome.decision, plan)
        self._in.rejected.add(decision.box.id)
        self._out.warn(f'rejected: {decision.reason}')

    def _conclude(self, goal: RunningGoal, code: ErrorCode, message: str) -> None:
        """The goal is over: what follows from how it ended."""
        self._goal = None
        self._free_s = self._clock()
        motion_s = 0.0 if goal.report is None else goal.report.motion_s
        self._hidden_s = self.asking.time.hidden_by(motion_s)
        decision = goal.decision
        self._last_box = decision.box.id
        if code.box_is_in_bin:
            self._awaited_bins.await_change(decision.bin_id, decision.bin_revision, self._free_s)
            self._time_outs(self._clock())
            return
        self._ahead = self._plan = self._asked = None
        bins = self._in.bins.bins if self._in.bins is not None else ()
        self._refusals.forget_expected(bins)
        asked = (decision.bin_id, decision.bin_revision)
        known = asked in [(target.id, target.revision) for target in bins]
        # the bins that explain a refusal may have come before it
        self._stale_inputs = known
        if known and code is ErrorCode.STALE_BIN_REVISION:
            # A state is sent once, on its change; that message is late, or was lost.
            self._out.refresh_bins()
        where = f'box {decision.box.id!r} into bin {decision.bin_id!r} at {decision.corner_mm} mm'
        self._out.warn(f'{code.name} ({code.value}), {where}: {message}')
        self._failures.add(decision.box.id, code, message)
        if code is ErrorCode.DUPLICATE_BOX:
            self._in.rejected.add(decision.box.id)
            return
        if code not in TRANSIENT:
            # a motion that failed is likely to fail again: to be avoided like a refused one
            odd = lies_oddly(decision.box, self._in.scan)
            self._refusals.learn(goal.target, decision, code, lies_oddly=odd)
        self._in.doubt(decision.box, goal.report)
        if code >= ErrorCode.GRASP_FAILED:
            self._stale_inputs = not self._in.is_available(decision.box.id)
        elif code not in TRANSIENT:
            # the refusal itself is new: nothing else has to change before the next try
            self._stale_inputs = False

    def _scan(self) -> Scan:
        assert self._in.scan is not None
        return self._in.scan

    def _has_bins(self) -> bool:
        return self._in.bins is not None and bool(self._in.bins.bins)

    def _bins(self) -> tuple[Bin, ...]:
        assert self._in.bins is not None
        return self._in.bins.bins
