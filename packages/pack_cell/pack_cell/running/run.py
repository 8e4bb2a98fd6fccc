"""``cell run``: start the nodes, watch the run, stop them, write the summary."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from arm_executor.bins.journal import JournalError
from arm_executor.bins.start_bins import read_start_bins
from conveyor_sim.streams import BOXES_FILE, Stream, write_boxes
from pack_cell.files import error_text, full_disk, naming
from pack_cell.journal.verify import book_errors
from pack_cell.options.run_options import RunOptions, open_stream
from pack_cell.report.accounts import read_books
from pack_cell.report.archive import Archive
from pack_cell.report.ended_run import EndedRun, execution_profile
from pack_cell.report.offline_packing import offline_bins
from pack_cell.report.record import RunRecord
from pack_cell.report.run_log import RunLog, RunLogError, is_complete
from pack_cell.report.summary import is_clean, summarize, write_run
from pack_cell.report_page.command import report_trouble
from pack_cell.running.books_of_bins import BooksOfBins, books_of_bins
from pack_cell.running.display import RunDisplay
from pack_cell.running.folder_lock import FolderLock, FolderTaken
from pack_cell.running.kept_run import FILE_NAME, KeptRun, is_begun
from pack_cell.running.memory import MemoryWatch
from pack_cell.running.node_commands import RECORDER, node_specs, write_parameters
from pack_cell.running.ros_domain import DomainLock, DomainTaken, hold_domain, loopback_trouble
from pack_cell.running.start_up import START_PATIENCE_S, StartUp
from pack_cell.running.supervisor import Supervisor
from pack_cell.running.viewing import PageProcess
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.codes import Condition
from pack_msgs_py.one_source import NAMED_SOURCES, new_session
from pack_msgs_py.profiles import Profile
from pack_msgs_py.signals import signal_name
from pack_msgs_py.values import Box

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


def run_folder(out: Path | None) -> Path:
    """The folder of this run: ``out``, or a fresh ``runs/<time>`` in the working directory."""
    if out is not None:
        return out.resolve()
    base = Path(os.environ.get('PACK_CELL_RUNS', 'runs')).resolve()
    name = datetime.now().strftime('%Y%m%d-%H%M%S')
    folder, number = base / name, 2
    while folder.exists():
        folder, number = base / f'{name}-{number}', number + 1
    return folder


def run(options: RunOptions, command: Sequence[str]) -> int:
    """Run a whole cell as ``options`` say; return the exit code."""
    began = time.monotonic()
    folder = run_folder(options.out)
    if is_begun(folder):
        return _refused(
            f'{folder} already holds a run: go on with it by --resume {folder}, '
            'or choose another --out'
        )
    _keep_private()
    folder.mkdir(parents=True, exist_ok=True)
    kept = KeptRun(folder, options, tuple(command))
    return _run_in_domain(kept, began)


def resume(kept: KeptRun) -> int:
    """Go on with a run that was cut or stopped; return the exit code."""
    began = time.monotonic()
    _keep_private()
    if is_complete(kept.folder / 'state'):
        print(f'the run in {kept.folder} is complete: see its summary.json and report.html')
        return EXIT_OK
    return _run_in_domain(kept, began, resumed=True)


def _keep_private() -> None:
    """What this process and its nodes write can be read by their user alone."""
    os.umask(os.umask(0o077) | 0o077)


def _refused(why: str) -> int:
    print(f'cell run: {why}', file=sys.stderr)
    return EXIT_USAGE


def _run_in_domain(kept: KeptRun, began: float, *, resumed: bool = False) -> int:
    """Hold a ROS domain and the folder while the cell runs."""
    try:
        domain = hold_domain()
    except (DomainTaken, ValueError) as error:
        return _refused(str(error))
    os.environ['ROS_DOMAIN_ID'] = str(domain.number)
    lock: FolderLock | None = None
    try:
        if not resumed:
            kept.write()
        lock = FolderLock(kept.folder / 'state')
        wrong = book_errors(kept.folder / 'state', old_too=True) if resumed else []
        if wrong:
            print(*wrong, sep='\n', file=sys.stderr)
            return _refused(
                f'the books in {kept.folder / "state"} are not as they were written, see above: '
                'bring them back from a copy; what is in the bins now is known to nobody else'
            )
        return _run(kept, began, domain)
    except FolderTaken as error:
        return _refused(str(error))
    except (OSError, RunLogError, JournalError) as error:
        why = '; '.join(filter(None, [error_text(error), full_disk(kept.folder)]))
        print(f'cell run: {why}', file=sys.stderr)
        print(f'cell run: {what_is_kept(kept.folder)}', file=sys.stderr)
        return EXIT_PROBLEM
    finally:
        if lock is not None:
            lock.release()
        domain.release()


def what_is_kept(folder: Path) -> str:
    """What a run that cannot write leaves behind, and how to go on with it."""
    if not (folder / 'config' / FILE_NAME).exists():
        return f'nothing was begun; when that is mended, remove {folder} and begin again'
    return (
        f'what was done until then is kept in {folder / "state"}; when that is mended, go on by '
        f'cell run --resume {folder}'
    )


def _run(kept: KeptRun, began: float, domain: DomainLock) -> int:
    """Start the nodes, watch them, stop them, and write what came of it."""
    options, folder, state = kept.used, kept.folder, kept.folder / 'state'
    stream = open_stream(options)
    stop = StopRequest()
    # For the recorder here and, by inheritance, for the nodes, all of which start after this.
    os.environ[NAMED_SOURCES] = str(new_session())
    supervisor = Supervisor(
        node_specs(folder, write_parameters(folder, options)),
        {'ROS_DOMAIN_ID': str(domain.number), 'PYTHONUNBUFFERED': '1'},
        respawn=options.respawn,
    )
    rules = execution_profile(options)
    start = () if options.start_bins is None else read_start_bins(options.start_bins)
    record = RunRecord(
        archive=Archive(folder / 'placements.jsonl', rules),
        start_ids=frozenset(placed.box.id for first in start for placed in first.bin.boxes),
    )
    log = RunLog(state, began)
    watch = RunWatch(options, supervisor, record, stop, began, folder, log)
    with RunDisplay(record, quiet=options.quiet) as display:
        if domain.number:
            display.say(
                f'this cell runs in ROS domain {domain.number}: export ROS_DOMAIN_ID to join'
            )
        for note in (*stream.notes, *unheeded(stream, rules)):
            display.console.tell(f'boxes: {note}', 'yellow')
        # What the executor knows before it is started: all of it, where topics repeat the latest.
        known = books_of_bins(state)
        supervisor.start()
        write_pids(folder, supervisor)
        if options.view:
            watch.page = PageProcess(options.view_port, folder / 'log' / 'view.log')
        try:
            ending = watch.until_done(display, known)
        finally:
            if watch.page is not None:
                watch.page.close()
            supervisor.stop()
            watch.close()
    log.ended()
    sessions = log.sessions()
    fed, in_bins = min(record.supplied, len(stream)), record.ids_in_bins()
    entries = map(stream.__getitem__, range(fed))
    placed = (box for box in entries if isinstance(box, Box) and box.id in in_bins)
    problems = [*watch.problems, *([ending.reason] if ending.reason and ending.code else [])]
    summary = summarize(
        EndedRun(
            record,
            kept.asked,
            kept.command,
            wall_time_s=sum(session.wall_s for session in sessions),
            first_decision_s=sessions[0].first_decision_s,
            problems_seen=problems,
            books=read_books(state),
            memory_mb=watch.memory.summary(),
            offline=offline_bins(placed, options.bin_spec, rules),
            sessions=sessions,
        )
    )
    write_run(folder, summary, record)
    with naming(folder / BOXES_FILE):
        write_boxes(folder / BOXES_FILE, map(stream.__getitem__, range(fed)))
    trouble = report_trouble(folder)
    if not ending.reason:
        log.completed()
    log.close()
    display.summary(summary, folder)
    if trouble:
        display.console.problem(f'cell run: {trouble}')
    for line in ending.details:
        display.console.problem(f'  | {line}')
    if ending.reason:
        display.console.tell(f'to go on with it: cell run --resume {folder}')
    if ending.code:
        display.console.problem(f'cell run: {ending.reason}')
        return ending.code
    if ending.reason:
        display.console.tell(ending.reason)
    return EXIT_OK if ending.interrupted or is_clean(summary) else EXIT_PROBLEM


def unheeded(stream: Stream, rules: Profile) -> Iterator[str]:
    """What the boxes ask for and these rules do not heed."""
    boxes = (entry for entry in stream.first_round if isinstance(entry, Box))
    loads = sum(box.max_top_load_n is not None for box in boxes)
    if loads and not rules.check_top_load:
        yield f'{loads} may carry little or nothing, which profile {rules.name} does not heed'


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
            return RunEnding(EXIT_OK, f'{state.summary} {self._left()} were not fed')
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
        return 'others' if scan is None or scan.remaining < 0 else f'{scan.remaining} boxes'

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
        left = f'{self.record.supplied - self.record.settled} boxes have not come to an end'
        return '; '.join(filter(None, [left, full_disk(self.folder)]))

    def _measure(self) -> None:
        """Look at the memory of the nodes now and then."""
        now_s = time.monotonic()
        expected = self.record.expected
        if now_s - self._measured_s < MEMORY_PERIOD_S or not expected:
            return
        self._measured_s = now_s
        self.memory.measure(self.supervisor.pids(), self.record.settled / expected)
