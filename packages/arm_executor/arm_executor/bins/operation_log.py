"""What operators asked for and which alarms came up, kept in the executor's journal."""

from __future__ import annotations

import threading

from arm_executor.bins.journal import Journal
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.codes import Command, Severity
from pack_msgs_py.operations import (
    OPERATION_COLUMNS,
    OPERATION_INSERT,
    OPERATION_TABLE,
    Operation,
    operation_of,
)

_ALARMS = """
CREATE TABLE IF NOT EXISTS alarm (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    raised_s REAL NOT NULL,
    severity INTEGER NOT NULL,
    code TEXT NOT NULL,
    message TEXT NOT NULL,
    action TEXT NOT NULL,
    box_id TEXT NOT NULL,
    bin_id TEXT NOT NULL,
    over_s REAL
)"""


class OperationLog:
    """The tables ``operation`` and ``alarm`` of ``journal``; ``lock`` guards its connection."""

    def __init__(self, journal: Journal, lock: threading.RLock) -> None:
        self._journal = journal
        self._lock = lock
        with lock, journal.transaction():
            for table in (OPERATION_TABLE, _ALARMS):
                journal.execute(table)

    def write(self, operation: Operation) -> None:
        """Remember a request and its answer."""
        with self._lock, self._journal.transaction():
            self._journal.execute(OPERATION_INSERT, operation.row())

    def operations(self) -> list[Operation]:
        """Every request, oldest first."""
        with self._lock:
            rows = self._journal.execute(
                f'SELECT {OPERATION_COLUMNS} FROM operation ORDER BY sequence'
            )
        return [operation_of(row) for row in rows]

    def pause(self) -> Operation | None:
        """The request that has paused the arm; ``None`` when it is not paused."""
        words = (Command.PAUSE.name, Command.RESUME.name)
        with self._lock:
            rows = self._journal.execute(
                f'SELECT {OPERATION_COLUMNS} FROM operation '
                'WHERE done AND command IN (?, ?) ORDER BY sequence DESC LIMIT 1',
                words,
            )
        last = [operation_of(row) for row in rows]
        return last[0] if last and last[0].command == Command.PAUSE.name else None

    def raise_alarm(self, alarm: Alarm) -> None:
        """An alarm or a warning has come up."""
        row = (
            *(alarm.raised_s, int(alarm.severity), alarm.code, alarm.message, alarm.action),
            *(alarm.box_id, alarm.bin_id),
        )
        with self._lock, self._journal.transaction():
            self._journal.execute(
                'INSERT INTO alarm (raised_s, severity, code, message, action, box_id, bin_id) '
                'VALUES (?, ?, ?, ?, ?, ?, ?)',
                row,
            )

    def acknowledge(self, now_s: float) -> None:
        """All that stands is over."""
        with self._lock, self._journal.transaction():
            self._journal.execute('UPDATE alarm SET over_s = ? WHERE over_s IS NULL', (now_s,))

    def standing(self) -> tuple[Alarm, ...]:
        """Alarms that nobody has acknowledged, oldest first; warnings end with the process."""
        with self._lock:
            rows = self._journal.execute(
                'SELECT code, message, severity, action, box_id, bin_id, raised_s FROM alarm '
                'WHERE over_s IS NULL AND severity = ? ORDER BY sequence',
                (int(Severity.ALARM),),
            )
        return tuple(Alarm(row[0], row[1], Severity(row[2]), *row[3:]) for row in rows)
