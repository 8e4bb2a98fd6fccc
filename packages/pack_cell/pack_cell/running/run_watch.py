"""Watch a run until it is complete, stopped, broken or stalled, and say how it ended."""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from pack_cell.files import full_disk, naming
from pack_cell.options.run_options import RunOptions
from pack_cell.report.record import RunRecord
from pack_cell.report.run_log import RunLog
from pack_cell.running.books_of_bins import BooksOfBins
from pack_cell.running.display import RunDisplay
from pack_cell.running.memory import MemoryWatch
from pack_cell.running.node_commands import RECORDER
from pack_cell.running.ros_domain import loopback_trouble
from pack_cell.running.start_up import START_PATIENCE_S, StartUp
from pack_cell.running.supervisor import Supervisor
from pack_cell.running.viewing import PageProcess
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.codes import Condition
from pack_msgs_py.signals import signal_name
from pack_msgs_py.wording import how_many

if TYPE_CHECKING:
    from pack_cell.ros.recorder import SteppedRecorder

EXIT_OK = 0
EXIT_PROBLEM = 1
EXIT_USAGE = 2
EXIT_NODE_DIED = 3
EXIT_STALLED = 4

#: How long the nodes get to hear of the last box, and are listened to after their end.
LAST_WORDS_S = 0.5
#: How often the memory of the nodes is measured.
MEMORY_PERIOD_S = 1.0
#: A belt that an operator has drained is empty for so long before the run ends.
DRAINED_S = 1.5
#: Conditions in which the cell waits for people, however long that takes.
WAITS_FOR_PEOPLE = (Condition.PAUSED, Condition.STOPPED, Condition.ALARM)
#: The report of a box follows its event within milliseconds, unless the executor died between.
REPORT_PATIENCE_S = 1.0


@dataclass(frozen=True)
class RunEnding:
    """How the watching of a run came to its end: an exit code and, unless all is well, why.

    What is wrong with the books of a run that was ``interrupted`` does not change its exit code.
    """

    code: int
    reason: str = ''
    details: Sequence[str] = ()
    interrupted: bool = False


class StopRequest:
    """Set by SIGINT or SIGTERM, or by SIGHUP when the terminal has gone."""

    def __init__(self) -> None:
        self.signal: int | None = None
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            # Under nohup the end of the terminal is nothing to stop for.
            if number is not signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.signal = number


def write_pids(folder: Path, supervisor: Supervisor) -> None:
    """Write the process id of each node to ``pids.json``, for operators and tests."""
    fresh = folder / 'pids.json.new'
    with naming(fresh):
        fresh.write_text(json.dumps(supervisor.pids()) + '\n')
    fresh.replace(folder / 'pids.json')


@dataclass
class RunWatch:
    """Listens to the cell until the run is complete, stopped, broken or stalled."""

    options: RunOptions
    supervisor: Supervisor
    record: RunRecord
    stop: StopRequest
    began: float
    folder: Path
    log: RunLog
    page: PageProcess | None = None

    def __post_init__(self) -> None:
        self.problems: list[str] = []
        self._recorder: SteppedRecorder | None = None
        self.memory = MemoryWatch()
        self._measured_s = -math.inf
        self._last_change = time.monotonic()
        self._decided = False
        self._start_up = StartUp(self.supervisor.started_s, self._heard_s, self._starts)

    def _heard_s(self, node: str) -> float:
        return -math.inf if self._recorder is None else self._recorder.watch.heard_s(node)

    def _starts(self, node: str) -> bool:
        return self._recorder is not None and self._recorder.watch.starts(node)

    def until_done(self, display: RunDisplay, known: BooksOfBins) -> RunEnding:
        """Spin the recorder and mind the nodes; return how it ended.

        ``known`` is what the executor had written down before.
        """
        # ROS takes half a second to load; the nodes load theirs meanwhile.
        from pack_cell.ros.recorder import SteppedRecorder

        def on_change(kind: str, value: object) -> None:
            self._last_change = time.monotonic()
            if kind == 'decision' and not self._decided:
                self._decided = True
                self.log.decided()
            display.on_change(kind, value)

        self._recorder = recorder = SteppedRecorder(self.record, on_change, self.log)
        known.tell(self.record)
        self._last_change = time.monotonic()
        while True:
            recorder.listen(0.1)
            if self.page is not None and (news := self.page.news()):
                display.say(news)
            ending = self._ending(display)
            if ending is not None:
                return ending

    def close(self) -> None:
        """Hear the last words of the nodes, which have ended, and stop listening."""
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.drain(LAST_WORDS_S)
            self.problems += recorder.close()

    def _ending(self, display: RunDisplay) -> RunEnding | None:
        if self.stop.signal is not None:
            name = signal_name(self.stop.signal)
            reason = f'stopped by {name} before the stream ended'
            return RunEnding(EXIT_OK, reason, interrupted=True)
        for death in self.supervisor.poll():
            if death.attendant:
                display.console.tell(f'       {death}; the cell goes on without it', 'yellow')
                continue
            self.supervisor.tell(RECORDER, signal.SIGUSR1)
            if not death.respawned:
                reason = '; '.join(filter(None, [str(death), full_disk(self.folder)]))
                return RunEnding(EXIT_NODE_DIED, reason, death.tail())
            self._last_change = time.monotonic()
            write_pids(self.folder, self.supervisor)
            display.say(f'       {death}; started again', 'red')
        self._measure()
        state = self._heed_operator(display)
        late = self._coming_up(display, state)
        if late:
            return RunEnding(EXIT_STALLED, late)
        idle = time.monotonic() - self._last_change
        if idle > DRAINED_S and self._drained(state):
            return RunEnding(EXIT_OK, f'{state.summary} Not fed: {self._left()}')
        if self.record.complete():
            reported = self.record.all_reported()
            if idle > (LAST_WORDS_S if reported else REPORT_PATIENCE_S):
                return RunEnding(EXIT_OK)
        if idle > self.options.stall_timeout_s:
            self.supervisor.tell(RECORDER, signal.SIGUSR2)
            return RunEnding(EXIT_STALLED, f'nothing has happened for {idle:.0f} s, {self._why()}')
        return None

    def _coming_up(self, display: RunDisplay, state: CellState) -> str:
        """Hold the clock of the stall while a node comes up; which one does not, else empty."""
        now_s = time.monotonic()
        if not self._start_up.coming(now_s):
            return ''
        self._last_change = now_s
        if news := self._start_up.news(now_s):
            display.say(f'       {news}', 'yellow')
        patience_s = max(START_PATIENCE_S, self.options.stall_timeout_s)
        late = self._start_up.given_up(now_s, patience_s, state)
        if not late:
            return ''
        self.supervisor.tell(RECORDER, signal.SIGUSR2)
        trouble = loopback_trouble() if self.record.scan is None else ''
        why = trouble or f'their logs are in {self.folder / "log"}'
        return '; '.join(filter(None, [late, why, full_disk(self.folder)]))

    def _drained(self, state: CellState) -> bool:
        """Whether an operator has drained the belt, and nothing is left to be packed."""
        scan = self.record.scan
        left = scan is not None and scan.remaining != 0
        return left and state.condition is Condition.ENDED and self.record.drained()

    def _left(self) -> str:
        """The boxes that are still to come, in words."""
        scan = self.record.scan
        return 'others' if scan is None or scan.remaining < 0 else how_many(scan.remaining, 'box')

    def _heed_operator(self, display: RunDisplay) -> CellState:
        """Say when somebody has stopped the cell or must look; then it waits, and is no stall."""
        assert self._recorder is not None
        state = self._recorder.cell_state
        display.on_state(state)
        if state.condition in WAITS_FOR_PEOPLE:
            self._last_change = time.monotonic()
        return state

    def _why(self) -> str:
        """What is known of a stall."""
        open_boxes = self.record.supplied - self.record.settled
        have = 'has' if open_boxes == 1 else 'have'
        left = f'{how_many(open_boxes, "box")} {have} not come to an end'
        return '; '.join(filter(None, [left, full_disk(self.folder)]))

    def _measure(self) -> None:
        """Look at the memory of the nodes now and then."""
        now_s = time.monotonic()
        expected = self.record.expected
        if now_s - self._measured_s < MEMORY_PERIOD_S or not expected:
            return
        self._measured_s = now_s
        self.memory.measure(self.supervisor.pids(), self.record.settled / expected)
