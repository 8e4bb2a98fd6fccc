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

from conveyor_sim.streams import BOXES_FILE, Stream, write_boxes
from pack_cell.options.run_options import RunOptions, open_stream
from pack_cell.report.accounts import read_books
from pack_cell.report.archive import Archive
from pack_cell.report.ended_run import EndedRun, execution_profile
from pack_cell.report.offline_packing import offline_bins
from pack_cell.report.record import RunRecord
from pack_cell.report.summary import is_clean, summarize, write_run
from pack_cell.report_page.command import report_trouble
from pack_cell.running.display import RunDisplay
from pack_cell.running.memory import MemoryWatch
from pack_cell.running.node_commands import RECORDER, node_specs, write_parameters
from pack_cell.running.ros_domain import DomainTaken, hold_domain, loopback_trouble
from pack_cell.running.supervisor import Supervisor
from pack_msgs_py.profiles import Profile
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
#: The report of a box follows its event within milliseconds, unless the executor died between.
REPORT_PATIENCE_S = 1.0


@dataclass(frozen=True)
class RunEnding:
    """How the watching of a run came to its end: an exit code and, unless all is well, why."""

    code: int
    reason: str = ''
    details: Sequence[str] = ()


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
    if (folder / 'state').exists():
        print(
            f'cell run: {folder} already holds a run; choose another --out, or remove it',
            file=sys.stderr,
        )
        return EXIT_USAGE
    try:
        lock = hold_domain()
    except (DomainTaken, ValueError) as error:
        print(f'cell run: {error}', file=sys.stderr)
        return EXIT_USAGE
    os.environ['ROS_DOMAIN_ID'] = str(lock.number)
    # Opened once: its file may be gone at the end.
    stream = open_stream(options)
    folder.mkdir(parents=True, exist_ok=True)
    stop = StopRequest()
    supervisor = Supervisor(
        node_specs(folder, write_parameters(folder, options)),
        {'ROS_DOMAIN_ID': str(lock.number), 'PYTHONUNBUFFERED': '1'},
        respawn=options.respawn,
    )
    rules = execution_profile(options)
    record = RunRecord(archive=Archive(folder / 'placements.jsonl', rules))
    watch = RunWatch(options, supervisor, record, stop, began, folder)
    with RunDisplay(record, quiet=options.quiet) as display:
        if lock.number:
            display.say(f'this cell runs in ROS domain {lock.number}: export ROS_DOMAIN_ID to join')
        for note in (*stream.notes, *unheeded(stream, rules)):
            display.console.tell(f'boxes: {note}', 'yellow')
        supervisor.start()
        write_pids(folder, supervisor)
        try:
            ending = watch.until_done(display)
        finally:
            supervisor.stop()
            watch.close()
            lock.release()
    wall_time_s = time.monotonic() - began
    fed, in_bins = min(record.supplied, len(stream)), record.ids_in_bins()
    entries = map(stream.__getitem__, range(fed))
    placed = (box for box in entries if isinstance(box, Box) and box.id in in_bins)
    problems = [*watch.problems, *([ending.reason] if ending.reason and ending.code else [])]
    summary = summarize(
        EndedRun(
            record,
            options,
            command,
            wall_time_s=wall_time_s,
            first_decision_s=watch.first_decision_s,
            problems_seen=problems,
            books=read_books(folder / 'state'),
            memory_mb=watch.memory.summary(),
            offline=offline_bins(placed, options.bin_spec, rules),
        )
    )
    write_run(folder, summary, record)
    write_boxes(folder / BOXES_FILE, map(stream.__getitem__, range(fed)))
    trouble = report_trouble(folder)
    display.summary(summary, folder)
    if trouble:
        display.console.problem(f'cell run: {trouble}')
    for line in ending.details:
        display.console.problem(f'  | {line}')
    if ending.code:
        display.console.problem(f'cell run: {ending.reason}')
        return ending.code
    if ending.reason:
        display.console.tell(ending.reason)
        return EXIT_OK
    return EXIT_OK if is_clean(summary) else EXIT_PROBLEM


def unheeded(stream: Stream, rules: Profile) -> Iterator[str]:
    """What the boxes ask for and these rules do not heed."""
    boxes = (entry for entry in stream.first_round if isinstance(entry, Box))
    loads = sum(box.max_top_load_n is not None for box in boxes)
    if loads and not rules.check_top_load:
        yield f'{loads} may carry little or nothing, which profile {rules.name} does not heed'


def write_pids(folder: Path, supervisor: Supervisor) -> None:
    """Write the process id of each node to ``pids.json``, for operators and tests."""
    fresh = folder / 'pids.json.new'
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
    first_decision_s: float | None = None

    def __post_init__(self) -> None:
        self.problems: list[str] = []
        self._recorder: SteppedRecorder | None = None
        self.memory = MemoryWatch()
        self._measured_s = -math.inf
        self._last_change = time.monotonic()

    def until_done(self, display: RunDisplay) -> RunEnding:
        """Spin the recorder and mind the nodes; return how it ended."""
        # ROS takes half a second to load; the nodes load theirs meanwhile.
        from pack_cell.ros.recorder import SteppedRecorder

        def on_change(kind: str, value: object) -> None:
            self._last_change = time.monotonic()
            if kind == 'decision' and self.first_decision_s is None:
                self.first_decision_s = self._last_change - self.began
            display.on_change(kind, value)

        self._recorder = recorder = SteppedRecorder(self.record, on_change)
        while True:
            recorder.listen(0.1)
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
            name = signal.Signals(self.stop.signal).name
            return RunEnding(EXIT_OK, f'stopped by {name} before the stream ended')
        for death in self.supervisor.poll():
            if death.attendant:
                display.console.tell(f'       {death}; the cell goes on without it', 'yellow')
                continue
            self.supervisor.tell(RECORDER, signal.SIGUSR1)
            if not death.respawned:
                return RunEnding(EXIT_NODE_DIED, str(death), death.tail())
            self._last_change = time.monotonic()
            write_pids(self.folder, self.supervisor)
            display.say(f'       {death}; started again', 'red')
        self._measure()
        idle = time.monotonic() - self._last_change
        if self.record.complete():
            reported = self.record.all_reported()
            if idle > (LAST_WORDS_S if reported else REPORT_PATIENCE_S):
                return RunEnding(EXIT_OK)
        if idle > self.options.stall_timeout_s:
            self.supervisor.tell(RECORDER, signal.SIGUSR2)
            return RunEnding(EXIT_STALLED, f'nothing has happened for {idle:.0f} s, {self._why()}')
        return None

    def _why(self) -> str:
        """What is known of a stall."""
        if self.record.scan is None:
            trouble = loopback_trouble() or f'their logs are in {self.folder / "log"}'
            return f'and no node was heard at all: {trouble}'
        left = self.record.supplied - self.record.settled
        return f'{left} boxes have not come to an end'

    def _measure(self) -> None:
        """Look at the memory of the nodes now and then."""
        now_s = time.monotonic()
        expected = self.record.expected
        if now_s - self._measured_s < MEMORY_PERIOD_S or not expected:
            return
        self._measured_s = now_s
        self.memory.measure(self.supervisor.pids(), self.record.settled / expected)
