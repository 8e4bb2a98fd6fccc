"""What operators asked for and which alarms came up, kept in the executor's journal."""

from __future__ import annotations

import threading

from arm_executor.bins.journal import Journal
from pack_msgs_py.alarm_table import AlarmTable
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.codes import Command
from pack_msgs_py.operations import (
    OPERATION_COLUMNS,
    OPERATION_INSERT,
    OPERATION_TABLE,
    Operation,
    operation_of,
)


class OperationLog:
    """The tables ``operation`` and ``alarm`` of ``journal``; ``lock`` guards its connection."""

    def __init__(self, journal: Journal, lock: threading.RLock) -> None:
        self._journal = journal
        self._lock = lock
        self._alarms = AlarmTable(journal.execute)
        with lock, journal.transaction():
            journal.execute(OPERATION_TABLE)
            self._alarms.make()

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
        with self._lock, self._journal.transaction():
            self._alarms.raise_alarm(alarm)

    def acknowledge(self, now_s: float, who: str, why: str) -> None:
        """Somebody has looked at all that stands."""
        with self._lock, self._journal.transaction():
            self._alarms.acknowledge(now_s, who, why)

    def standing(self) -> tuple[Alarm, ...]:
        """Alarms that nobody has acknowledged, oldest first; warnings end with the process."""
        with self._lock:
            return self._alarms.standing()
