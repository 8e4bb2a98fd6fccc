"""Reading the executor's journal, by its owner or by anybody who wants to know."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from arm_executor.bins.records import Attempt, Step
from pack_msgs_py.alarm_table import AlarmTable, KeptAlarm
from pack_msgs_py.box_codec import placed_from_json, pose_from_json
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.operations import OPERATION_COLUMNS, Operation, operation_of
from pack_msgs_py.values import Bin, bin_called

_ATTEMPT = 'id, bin_serial, goal_id, placed, target, measured, step'
#: More than any run has.
ALL = 2**62


class JournalError(Exception):
    """The journal cannot be used; the text says why and what to do."""


class JournalReader:
    """What the journal in the open database ``db`` holds; ``path`` is for messages."""

    def __init__(self, db: sqlite3.Connection, path: Path | None) -> None:
        self._db = db
        self.path = path

    def _meta(self, key: str) -> str:
        row = self._db.execute('SELECT value FROM meta WHERE key = ?', (key,)).fetchone()
        return str(row[0])

    @property
    def is_begun(self) -> bool:
        """Whether anything is written down at all: a crash may come between file and tables."""
        return bool(self._db.execute('PRAGMA user_version').fetchone()[0])

    def revision(self) -> int:
        """Revision of all bins together; grows over restarts."""
        return int(self._meta('revision'))

    def last_serial(self) -> int:
        """Serial of the bin opened last; 0 when there was none."""
        return int(self._db.execute('SELECT coalesce(max(serial), 0) FROM bin').fetchone()[0])

    def open_bins(self) -> tuple[Bin, ...]:
        """Bins that stand in the cell, with every box whose release was begun, oldest first."""
        return self._bins('closed_s IS NULL ORDER BY serial')

    def closed_bins(self, limit: int) -> tuple[Bin, ...]:
        """The ``limit`` bins closed last, oldest first."""
        newest_first = self._bins(f'closed_s IS NOT NULL ORDER BY serial DESC LIMIT {int(limit)}')
        return newest_first[::-1]

    def _bins(self, condition: str) -> tuple[Bin, ...]:
        rows = self._db.execute(
            'SELECT serial, id, type, size_mm, station, destination, revision '
            f'FROM bin WHERE {condition}'
        ).fetchall()
        return tuple(
            Bin(
                id=name,
                serial=serial,
                spec=bin_called(kind, tuple(json.loads(size))),
                boxes=tuple(attempt.in_bin for attempt in self.attempts_in(serial)),
                station=station,
                revision=revision,
                destination=destination,
            )
            for serial, name, kind, size, station, destination, revision in rows
        )

    def attempts_in(self, serial: int) -> list[Attempt]:
        """Placements whose box is in bin ``serial``, in order of placement."""
        return self._attempts(
            "bin_serial = ? AND step IN ('releasing', 'placed', 'verified')", (serial,)
        )

    def all_attempts(self) -> list[Attempt]:
        """Every placement that was ever begun, in order."""
        return self._attempts('1', ())

    def steps(self) -> dict[int, list[tuple[str, float]]]:
        """Of each placement, by its number, what it came to and when, seconds since the epoch."""
        steps: dict[int, list[tuple[str, float]]] = {}
        rows = self._db.execute('SELECT attempt, step, stamp_s FROM step ORDER BY rowid')
        for attempt, step, stamp_s in rows:
            steps.setdefault(attempt, []).append((step, stamp_s))
        return steps

    def bin_times(self) -> dict[int, tuple[float, float | None]]:
        """When each bin, by its serial, was opened and closed, seconds since the epoch."""
        rows = self._db.execute('SELECT serial, opened_s, closed_s FROM bin ORDER BY serial')
        return {serial: (opened_s, closed_s) for serial, opened_s, closed_s in rows}

    def operations(self) -> list[Operation]:
        """What operators have asked for, oldest first."""
        if not self._has('operation'):
            return []
        rows = self._db.execute(f'SELECT {OPERATION_COLUMNS} FROM operation ORDER BY sequence')
        return [operation_of(row) for row in rows]

    def alarms(self) -> list[KeptAlarm]:
        """Every alarm and warning of the arm, oldest first, and what became of it."""
        return AlarmTable(lambda *statement: self._db.execute(*statement).fetchall()).kept()

    def _has(self, table: str) -> bool:
        """Whether the node has come to make a table that is not of the bins."""
        found = self._db.execute(
            "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?", (table,)
        )
        return found.fetchone() is not None

    def pending(self) -> list[Attempt]:
        """Placements that were under way when the journal was last written."""
        return self._attempts("step IN ('planned', 'picked', 'releasing', 'placed')", ())

    def unknown(self) -> list[Attempt]:
        """Placements of which nobody knows whether the box is in its bin."""
        return self._attempts("step = 'unknown'", ())

    def _attempts(self, condition: str, values: Iterable[Any]) -> list[Attempt]:
        rows = self._db.execute(
            f'SELECT {_ATTEMPT} FROM attempt WHERE {condition} ORDER BY id', tuple(values)
        )
        return [self._attempt(*row) for row in rows]

    def _attempt(
        self,
        number: int,
        serial: int,
        goal_id: bytes,
        placed: str,
        target: str,
        measured: str | None,
        step: str,
    ) -> Attempt:
        """One row of the table."""
        try:
            return Attempt(
                id=number,
                placed=placed_from_json(placed),
                bin_serial=serial,
                target=pose_from_json(target),
                step=Step(step),
                measured=None if measured is None else pose_from_json(measured),
                goal_id=bytes(goal_id),
            )
        except ValueError as error:
            msg = (
                f'cannot read placement {number} of journal {self.path}: {error}; '
                'move the file away to start anew'
            )
            raise JournalError(msg) from error

    def box_ids_in_bins(self) -> set[str]:
        """Ids of all boxes in bins, open or closed."""
        rows = self._db.execute(
            "SELECT box_id FROM attempt WHERE step IN ('releasing', 'placed', 'verified')"
        )
        return {row[0] for row in rows}

    def events(self, limit: int) -> tuple[BoxEvent, ...]:
        """The ``limit`` youngest events, oldest first, with their original stamps."""
        rows = self._db.execute(
            'SELECT box_id, event, reason, text, bin_id, bin_serial, stamp_s FROM event '
            'ORDER BY sequence DESC LIMIT ?',
            (limit,),
        ).fetchall()
        return tuple(
            BoxEvent(box_id, BoxEventKind(kind), Reason(reason), text, bin_id, serial, stamp_s)
            for box_id, kind, reason, text, bin_id, serial, stamp_s in reversed(rows)
        )


@contextmanager
def read_journal(path: Path) -> Iterator[JournalReader]:
    """The journal in file ``path``, to be read only; its executor may be at work.

    Raises
    ------
    JournalError
        There is none, or it cannot be read, now or while the block reads it.
    """
    if not path.is_file():
        msg = f'there is no journal {path}'
        raise JournalError(msg)
    try:
        # Not read-only: what a crash has left in the write-ahead log could then not be taken up.
        db = sqlite3.connect(path, isolation_level=None)
        try:
            yield JournalReader(db, path)
        finally:
            db.close()
    except (sqlite3.Error, ValueError) as error:
        msg = f'journal {path} cannot be read: {error}'
        raise JournalError(msg) from error
