"""The heart of the executor: one goal at a time, on one thread that owns the arm.

Nothing here knows ROS. Calls come from one outside thread and return at once; what happens is
told through ``emit`` in the order in which it must be heard, from either thread.
"""

from __future__ import annotations

import queue
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace

from arm_executor.bins.book import BinBook, BookError
from arm_executor.bins.journal import JournalError
from arm_executor.bins.operation_log import OperationLog
from arm_executor.bins.records import Step
from arm_executor.goals.admission import AdmissionState, Refusal, admit
from arm_executor.goals.after_stop import clear_gripper
from arm_executor.goals.belt_view import BeltClock, BeltView
from arm_executor.goals.candidates import CandidateChecker, CandidateView, foresee
from arm_executor.goals.condition import ExecutorCondition, trouble_of
from arm_executor.goals.early_goals import EarlyGoals
from arm_executor.goals.motion_clock import MotionClock
from arm_executor.goals.operator_panel import OperatorPanel
from arm_executor.goals.outputs import (
    BinClosed,
    BinsChanged,
    Failed,
    Finished,
    Happened,
    Output,
    Replied,
    Said,
    Status,
    Ticket,
    closed_with,
    contents,
)
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.goals.placing import Placing, Tools
from arm_executor.goals.plan_cache import PlanCache
from arm_executor.goals.recovering import recover
from arm_executor.goals.reports import refusal_report
from arm_executor.goals.resolving import resolve_box
from arm_executor.model.arm_interface import Arm, ClockedArm, MotionError
from arm_executor.model.layout import LayoutError
from arm_executor.parameters import ExecutorSettings
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin

#: An arm that does not come to rest so long after the watchdog stopped it is a fault.
HUNG_S = 3.0


class ExecutorCore:
    """Admits goals, lets the arm carry them out, keeps the book of bins.

    Parameters
    ----------
    book : the bins, for as long as the core lives.
    settings : how it works.
    make_arm : called once, on the thread that will own the arm.
    emit : takes every output; called from two threads, must not block.
    wall, steady : clocks, seconds since the epoch and of no particular origin.
    """

    def __init__(
        self,
        book: BinBook,
        settings: ExecutorSettings,
        make_arm: Callable[[], Arm],
        emit: Callable[[Output], None],
        *,
        wall: Callable[[], float] = time.time,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._book, self._settings, self._make_arm = book, settings, make_arm
        self.emit = emit
        self._wall, self._steady = wall, steady
        self._belt = BeltView(wall)
        self._plans = PlanCache()
        self._tools: Tools | None = None
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name='arm', daemon=True)
        self._checker = CandidateChecker(self._view, emit)
        self._in_world: tuple[int, ...] = ()
        self._placing: Placing | None = None
        self._early = EarlyGoals(self._belt, steady)
        self._clock = MotionClock(settings.speed, steady)
        self.panel = OperatorPanel(
            OperationLog(book.journal, book.lock),
            emit,
            wall,
            acknowledges_itself=settings.acknowledges_itself,
        )
        self._condition = ExecutorCondition()

    # -- from outside ---------------------------------------------------------------------------

    def start(self) -> None:
        """Build the arm and recover the bins, in the background; goals are refused until then."""
        self._jobs.put(self._begin)
        self._thread.start()
        self._checker.start()

    def end(self, timeout_s: float) -> bool:
        """Leave the arm still; ``False`` when it has not come to rest within ``timeout_s``."""
        placing = self._placing
        if placing is not None:
            placing.abandoned = True
        self._stop_motion()
        self._jobs.put(None)
        until_s = self._steady() + timeout_s
        checked = self._checker.end(timeout_s)
        if self._thread.is_alive():
            self._thread.join(max(0.0, until_s - self._steady()))
        return checked and not self._thread.is_alive()

    def status(self) -> Status:
        """Mode and what is being done."""
        tools, placing, attempt = self._tools, self._placing, self._book.attempt
        box = '' if placing is None else placing.goal.decision.box.id
        remaining_s = 0.0 if placing is None else placing.remaining_s
        in_doubt = '' if attempt is None else attempt.placed.box.id
        error = 0.0 if tools is None else tools.arm.tracking_error()
        return replace(
            self._condition.status(box, remaining_s, in_doubt, self.panel),
            last_fault=self._condition.last_fault,
            tracking_error=error,
            paused=self.panel.paused,
        )

    def set_active(self, *, active: bool) -> None:
        """Take goals, or none from now on; one that is under way is brought to its end."""
        self._condition.inactive = '' if active else 'to be activated'

    def joints(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """Names and positions of the joints; empty when there are none."""
        tools = self._tools
        return ((), ()) if tools is None else tools.arm.joint_positions()

    def robot_time(self) -> float:
        """Robot seconds since the start; see :class:`MotionClock`."""
        arm = None if self._tools is None else self._tools.arm
        return self._clock.at(arm.robot_time() if isinstance(arm, ClockedArm) else None)

    def on_scan(self, scan: Scan) -> None:
        """The belt is now like this."""
        self._belt.update(scan)
        self.tick()

    def tick(self) -> None:
        """Go on with goals that came before their scan, watch the motion; call it now and then."""
        self._watch()
        trouble = trouble_of(self._tools)
        if trouble and not self._condition.stops:
            self.protective_stop(trouble)
        for goal in self._early.due():
            self._admit(goal)

    def submit(self, goal: PlaceGoal) -> None:
        """Admit ``goal`` and have it done, or refuse it; either way it ends in one report."""
        if not self._early.kept(goal):
            self._admit(goal)

    def _watch(self) -> None:
        """The watchdog: a motion that makes no progress is stopped, one that goes on is a fault."""
        placing, allowed_s = self._placing, self._settings.watchdog_s
        quiet_s = 0.0 if placing is None else self._steady() - placing.heard_s
        if placing is None or quiet_s <= allowed_s:
            return
        text = f'the motion has made no progress for {quiet_s:.1f} s, {allowed_s:g} s are allowed'
        placing.halt(ErrorCode.MOTION_OVERDUE, text)
        if quiet_s > allowed_s + HUNG_S and not placing.abandoned:
            placing.abandoned = True
            self._fail(RuntimeError(f'{text}, and the arm does not stop'))

    def protective_stop(self, text: str) -> None:
        """Stand still until :meth:`reset`, whatever goes on; a held box stays in the gripper."""
        placing = self._placing
        self._condition.stop_wanted = text
        if placing is None:
            self._condition.protective_stop = text
        else:
            placing.halt(ErrorCode.PROTECTIVE_STOP, text)
            self._belt.wake()

    def _admit(self, goal: PlaceGoal) -> None:
        now_s = self._came_s(goal)
        refusal = admit(goal, self._admission_state(now_s))
        if refusal is not None:
            self.refuse(goal, refusal)
            return
        placing = Placing(goal, self._ready(), now_s)
        self._placing = placing
        self._jobs.put(lambda: self._place(placing))

    def _came_s(self, goal: PlaceGoal) -> float:
        """When ``goal`` came, seconds since the epoch; when it was sent where no clock counts."""
        now_s = self._wall()
        return goal.sent_s if self._settings.counts and 0.0 < goal.sent_s < now_s else now_s

    def refuse(self, goal: PlaceGoal, refusal: Refusal) -> None:
        """End ``goal`` before anything moves."""
        self.emit(Finished(refusal_report(goal, refusal, self._wall())))

    def cancel(self, goal_id: bytes) -> None:
        """Stop the goal; its report says how it ended. Too late once the pad lets go."""
        placing = self._placing
        if placing is not None and placing.goal.goal_id == goal_id:
            self._stop_motion()
        for goal in self._early.removed(goal_id):
            self.refuse(goal, Refusal(ErrorCode.CANCELED, 'canceled before it was looked at'))

    def check(self, ticket: Ticket, goals: Sequence[PlaceGoal], enough_s: float = 0.0) -> None:
        """Ask the arm; see :meth:`~arm_executor.goals.candidates.CandidateChecker.check`."""
        self._checker.check(ticket, goals, enough_s)

    def _view(self) -> CandidateView:
        # First what is under way, then what there is: the other way round a placement that ends
        # in between would be neither.
        placing, attempt = self._placing, self._book.attempt
        state = self._admission_state(self._wall())
        serials = tuple(bin_.serial for bin_ in state.bins.bins)
        view = CandidateView(state, self._tools, in_step=serials == self._in_world)
        return foresee(view, placing, under_way=attempt is not None)

    def swap(self, bin_id: str, revision: int, destination: str = '') -> Bin:
        """Close a bin and open an empty one; :class:`BookError` says why not."""
        self.check_usable()
        if bin_id == self.bin_in_use():
            msg = f'a box is being placed into bin {bin_id!r}'
            raise BookError(msg)
        poses = self._book.state.poses
        try:
            old, new = self._book.swap(bin_id, revision, destination)
        except JournalError as error:
            self._fail(error)
            raise BookError(str(error)) from error
        self.emit(BinClosed(old, poses))
        self.bins_worked_on()
        self.emit(Said('info', f'{closed_with(old)}, {new.id} open'))
        return new

    def check_usable(self) -> None:
        """:class:`BookError` when the bins cannot be changed now, since the arm is not there."""
        if self._condition.fault or self._tools is None:
            status = self.status()
            msg = f'the executor is in mode {status.mode.name}: {status.message}'
            raise BookError(msg)

    def bin_in_use(self) -> str:
        """Id of the bin into which a box is on its way; empty for none."""
        placing = self._placing
        return self._book.bin_in_use() if placing is None else placing.goal.decision.bin_id

    def bins_worked_on(self, measure: frozenset[int] = frozenset()) -> None:
        """The book was changed by hand: the arm's world follows.

        ``measure`` are serials of bins whose boxes may have moved.
        """
        self._jobs.put(lambda: self._sync(measure))
        self.emit(BinsChanged(self._book.state))

    def reset(self, ticket: Ticket) -> None:
        """After a protective stop: box back to the belt, and on. Answers (success, message)."""
        self._jobs.put(lambda: self._reset(ticket))

    def resolve(self, ticket: Ticket, box_id: str, *, placed: bool, text: str) -> None:
        """A person has looked for a box in doubt. Answers (success, message)."""
        self._jobs.put(lambda: self._resolve(ticket, box_id, placed, text))

    def _admission_state(self, now_s: float) -> AdmissionState:
        status = self.status()
        placing = self._placing
        return AdmissionState(
            bins=self._book.state,
            ids_in_bins=self._book.ids_in_bins,
            profile=self._settings.profile,
            scan=self._belt.scan,
            mode=status.mode,
            busy_with='' if placing is None else placing.goal.decision.box.id,
            now_s=now_s,
        )

    def _stop_motion(self) -> None:
        placing = self._placing
        if placing is not None:
            placing.stop.set()
            self._belt.wake()

    # -- on the arm's thread --------------------------------------------------------------------

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception as error:
                self._fail(error)
        tools = self._tools
        if tools is not None:
            tools.arm.close()

    def _begin(self) -> None:
        try:
            arm = self._make_arm()
            recover(self._book, arm, self.panel, self.emit, self._wall())
            self._in_world = tuple(bin_.serial for bin_ in self._book.state.bins)
        except Exception as error:
            self._condition.fault = f'cannot start: {error}'
            # What an arm says of its cell is enough; anything else is a fault of the code.
            told = isinstance(error, (MotionError, LayoutError))
            trace = '' if told else f'\n{traceback.format_exc()}'
            self.emit(Failed(f'cannot start: {error}{trace}'))
            return
        self._tools = Tools(
            arm=arm,
            book=self._book,
            belt=self._belt,
            clock=BeltClock(self._settings.speed, self._steady),
            plans=self._plans,
            settings=self._settings,
            emit=self.emit,
            steady=self._steady,
            wall=self._wall,
        )
        self._condition.ready = True
        self.emit(BinsChanged(self._book.state))
        self.emit(Said('info', f'ready; open bins: {contents(self._book.state.bins)}'))

    def _ready(self) -> Tools:
        if self._tools is None:
            msg = 'the arm is not there yet'
            raise RuntimeError(msg)
        return self._tools

    def _place(self, placing: Placing) -> None:
        report = placing.run()
        if placing.abandoned:
            return
        self.panel.report(report)
        self._condition.ended(report, needs_reset=placing.needs_reset)
        self._placing = None
        self.emit(Finished(report))

    def _sync(self, measure: frozenset[int] = frozenset()) -> None:
        """Make the arm's world hold the bins of the book; ``measure``: serials of bins to write."""
        self._plans.clear()
        state = self._book.state
        poses = self._ready().arm.set_bins(state.bins, state.poses)
        self._in_world = tuple(bin_.serial for bin_ in state.bins)
        if measure:
            self._book.settled(poses, measure)
            self.emit(BinsChanged(self._book.state))

    def _reset(self, ticket: Ticket) -> None:
        try:
            self.emit(Replied(ticket, self._leave_protective_stop()))
        except Exception:
            self.emit(Replied(ticket, (False, 'the executor failed; see its log')))
            raise

    def _resolve(self, ticket: Ticket, box_id: str, placed: bool, text: str) -> None:
        try:
            self.check_usable()
        except BookError as error:
            self.emit(Replied(ticket, (False, str(error))))
        else:
            answer = resolve_box(self._ready(), box_id, placed=placed, text=text)
            self.emit(Replied(ticket, answer))

    def _leave_protective_stop(self) -> tuple[bool, str]:
        if not self._condition.protective_stop:
            return False, f'mode is {self.status().mode.name}; only a protective stop can be reset'
        trouble = trouble_of(self._tools)
        if trouble:
            return False, f'{trouble}; make the robot ready first, then reset'
        cleared, text = clear_gripper(self._ready())
        if cleared:
            self._condition.protective_stop = self._condition.stop_wanted = ''
        return cleared, text

    def _fail(self, error: Exception) -> None:
        """Something that should not happen has: stand still, say so, wait for a person."""
        self._stop_motion()
        self._condition.failed(error)
        self.emit(Said('error', f'the executor failed, arm stopped\n{traceback.format_exc()}'))
        placing, self._placing = self._placing, None
        attempt = self._book.attempt
        if attempt is not None and attempt.step is not Step.PLANNED:
            try:
                self.emit(Happened(self._book.unknown(self._condition.fault)))
            except Exception as second:
                self.emit(Said('error', f'the journal cannot be written: {second}'))
        if placing is not None:
            self.refuse(placing.goal, Refusal(ErrorCode.UNKNOWN, self._condition.fault))
