"""The two books of a run, read together."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from arm_executor.bins.journal import FILE_NAME as JOURNAL
from arm_executor.bins.journal_reader import ALL, JournalError, read_journal
from arm_executor.bins.records import Attempt
from conveyor_sim.ledger.ledger import FILE_NAME as LEDGER
from pack_msgs_py.alarm_table import AlarmTable, KeptAlarm
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.codes import Reason
from pack_msgs_py.operations import OPERATION_COLUMNS, Operation, operation_of
from pack_msgs_py.values import Bin


class BooksError(ValueError):
    """The books of a run cannot be read; the text names the file and says why."""


@dataclass(frozen=True)
class FedBox:
    """A box by the belt's book: its place in the stream, where it is, and why."""

    ordinal: int
    box_id: str
    place: str
    laps: int
    reason: Reason
    text: str


@dataclass(frozen=True)
class AskedFor:
    """What somebody has asked a node for: ``'arm'`` or ``'belt'``."""

    node: str
    operation: Operation


@dataclass(frozen=True)
class RaisedAlarm:
    """An alarm or a warning of a node: ``'arm'`` or ``'belt'``."""

    node: str
    kept: KeptAlarm


@dataclass(frozen=True)
class RunBooks:
    """What both books say.

    Attributes
    ----------
    bins : every bin, in the order of opening.
    bin_times : when each was opened and closed, by serial, seconds since the epoch.
    attempts : every placement that was begun.
    steps : of each placement, by its number, what it came to and when.
    events : what happened to boxes, as others were told.
    fed : the boxes that the belt was given; ``None`` where its book cannot be read now.
    operations : what people have asked for, oldest first.
    alarms : alarms and warnings of the arm and the belt, and what became of each.
    """

    bins: tuple[Bin, ...]
    bin_times: dict[int, tuple[float, float | None]]
    attempts: tuple[Attempt, ...]
    steps: dict[int, list[tuple[str, float]]]
    events: tuple[BoxEvent, ...]
    fed: tuple[FedBox, ...] | None
    operations: tuple[AskedFor, ...] = ()
    alarms: tuple[RaisedAlarm, ...] = ()


def state_folder(folder: Path) -> Path:
    """Where the books of the run in ``folder`` are; :class:`BooksError` when there are none."""
    folder = folder.expanduser()
    for place in (folder / 'state', folder):
        if (place / JOURNAL).is_file() or (place / LEDGER).is_file():
            return place
    msg = f'{folder} holds no books of a run: neither {JOURNAL} nor {LEDGER} in it or in state/'
    raise BooksError(msg)


def read_run_books(folder: Path) -> RunBooks:
    """The books of the run in ``folder``, which may be under way.

    Raises
    ------
    BooksError
        There are none, or the arm's one cannot be read.
    """
    state = state_folder(folder)
    try:
        with read_journal(state / JOURNAL) as journal:
            if not journal.is_begun:
                belt = (_fed(state), tuple(_asked_of_belt(state)), tuple(_alarms_of_belt(state)))
                return RunBooks((), {}, (), {}, (), *belt)
            alarms = [RaisedAlarm('arm', kept) for kept in journal.alarms()]
            asked = [AskedFor('arm', operation) for operation in journal.operations()]
            bins = (*journal.closed_bins(ALL), *journal.open_bins())
            return RunBooks(
                tuple(sorted(bins, key=lambda known: known.serial)),
                journal.bin_times(),
                tuple(journal.all_attempts()),
                journal.steps(),
                journal.events(ALL),
                _fed(state),
                tuple(sorted([*asked, *_asked_of_belt(state)], key=_asked_s)),
                tuple(sorted([*alarms, *_alarms_of_belt(state)], key=_raised_s)),
            )
    except JournalError as error:
        raise BooksError(str(error)) from None


def _fed(state: Path) -> tuple[FedBox, ...] | None:
    if not (state / LEDGER).exists():
        return ()
    try:
        with opened(state / LEDGER) as db:
            rows = db.execute(
                'SELECT ordinal, box_id, place, laps, reason, text FROM boxes ORDER BY ordinal'
            ).fetchall()
    except sqlite3.Error:
        return None  # its conveyor holds it while it works
    return tuple(
        FedBox(ordinal, box_id, place, laps, Reason(reason), text)
        for ordinal, box_id, place, laps, reason, text in rows
    )


def _asked_of_belt(state: Path) -> list[AskedFor]:
    try:
        with opened(state / LEDGER) as db:
            rows = db.execute(f'SELECT {OPERATION_COLUMNS} FROM operation').fetchall()
    except sqlite3.Error:
        return []
    return [AskedFor('belt', operation_of(row)) for row in rows]


def _alarms_of_belt(state: Path) -> list[RaisedAlarm]:
    try:
        with opened(state / LEDGER) as db:
            kept = AlarmTable(lambda *statement: db.execute(*statement).fetchall()).kept()
    except sqlite3.Error:
        return []
    return [RaisedAlarm('belt', alarm) for alarm in kept]


def _raised_s(raised: RaisedAlarm) -> float:
    return raised.kept.alarm.raised_s


def _asked_s(asked: AskedFor) -> float:
    return asked.operation.stamp_s


@contextmanager
def opened(path: Path) -> Iterator[sqlite3.Connection]:
    """The database in a file, as it was when the block begins."""
    db = sqlite3.connect(path, isolation_level=None, timeout=0.5)
    try:
        db.execute('BEGIN')
        yield db
    finally:
        db.close()
