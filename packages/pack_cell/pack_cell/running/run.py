"""``cell run``: start the nodes, watch the run, stop them, write the summary."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

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
from pack_cell.running.books_of_bins import books_of_bins
from pack_cell.running.display import RunDisplay
from pack_cell.running.folder_lock import FolderLock, FolderTaken
from pack_cell.running.kept_run import FILE_NAME, KeptRun, is_begun
from pack_cell.running.node_commands import node_specs, write_parameters
from pack_cell.running.ros_domain import DomainLock, DomainTaken, hold_domain
from pack_cell.running.run_watch import (
    EXIT_OK,
    EXIT_PROBLEM,
    EXIT_USAGE,
    RunWatch,
    StopRequest,
    write_pids,
)
from pack_cell.running.supervisor import Supervisor
from pack_cell.running.viewing import PageProcess
from pack_msgs_py.one_source import NAMED_SOURCES, new_session
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import Box


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
