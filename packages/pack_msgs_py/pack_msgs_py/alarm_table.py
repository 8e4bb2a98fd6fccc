"""Alarms and warnings as a node's book keeps them: when each came and went, and who has looked.

A row is written before anybody hears of the alarm, and stays when it is over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pack_msgs_py.alarms import Alarm
from pack_msgs_py.codes import Severity

_TABLE = """
CREATE TABLE IF NOT EXISTS alarm (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    raised_s REAL NOT NULL,
    severity INTEGER NOT NULL,
    code TEXT NOT NULL,
    message TEXT NOT NULL,
    action TEXT NOT NULL,
    box_id TEXT NOT NULL,
    bin_id TEXT NOT NULL,
    over_s REAL,
    ended_s REAL,
    over_by TEXT,
    over_why TEXT
)"""
#: Columns that a book of an earlier version lacks.
_ADDED = {'ended_s': 'REAL', 'over_by': 'TEXT', 'over_why': 'TEXT'}
_ALARM = 'code, message, severity, action, box_id, bin_id, raised_s'

Execute = Callable[..., list[tuple[Any, ...]]]


@dataclass(frozen=True)
class KeptAlarm:
    """An alarm or warning, and what became of it.

    Attributes
    ----------
    alarm : what came up, and when.
    ended_s : when its cause was over, where the node can tell; seconds since the epoch.
    over_s : when somebody acknowledged it; ``None`` while nobody has.
    over_by, over_why : who that was, and why, as they gave it.
    """

    alarm: Alarm
    ended_s: float | None = None
    over_s: float | None = None
    over_by: str = ''
    over_why: str = ''


class AlarmTable:
    """The table ``alarm`` of a SQLite file.

    ``execute`` carries out one statement with its values and returns the rows; who writes does so
    within a transaction.
    """

    def __init__(self, execute: Execute) -> None:
        self._execute = execute

    def make(self) -> None:
        """Make the table, or bring that of an earlier version up to date."""
        self._execute(_TABLE)
        missing = _ADDED.keys() - self._columns()
        for column in sorted(missing):
            self._execute(f'ALTER TABLE alarm ADD COLUMN {column} {_ADDED[column]}')
        if missing:
            # Every row is another one now, which the hash chain must take in.
            self._execute('UPDATE alarm SET over_s = over_s')

    def raise_alarm(self, alarm: Alarm) -> int:
        """One has come up; returns its number."""
        row = (
            *(alarm.raised_s, int(alarm.severity), alarm.code, alarm.message, alarm.action),
            *(alarm.box_id, alarm.bin_id),
        )
        self._execute(
            'INSERT INTO alarm (raised_s, severity, code, message, action, box_id, bin_id) '
            'VALUES (?, ?, ?, ?, ?, ?, ?)',
            row,
        )
        return int(self._execute('SELECT last_insert_rowid()')[0][0])

    def end(self, number: int, now_s: float) -> None:
        """The cause of one is over; it may still wait to be acknowledged."""
        self._execute('UPDATE alarm SET ended_s = ? WHERE sequence = ?', (now_s, number))

    def acknowledge(self, now_s: float, who: str, why: str) -> None:
        """Somebody has looked at all that stand."""
        self._execute(
            'UPDATE alarm SET over_s = ?, over_by = ?, over_why = ? WHERE over_s IS NULL',
            (now_s, who, why),
        )

    def not_ended(self, code: str) -> int | None:
        """The number of the last one with ``code``, if its cause lasts."""
        rows = self._execute(
            'SELECT sequence, ended_s FROM alarm WHERE code = ? ORDER BY sequence DESC LIMIT 1',
            (code,),
        )
        return None if not rows or rows[0][1] is not None else int(rows[0][0])

    def standing(self) -> tuple[Alarm, ...]:
        """Alarms that nobody has acknowledged, oldest first; warnings end with the process."""
        rows = self._execute(
            f'SELECT {_ALARM} FROM alarm WHERE over_s IS NULL AND severity = ? ORDER BY sequence',
            (int(Severity.ALARM),),
        )
        return tuple(map(_alarm, rows))

    def kept(self) -> list[KeptAlarm]:
        """Every alarm and warning, oldest first; also from a table of an earlier version."""
        there = self._columns()
        if not there:
            return []
        added = ', '.join(name if name in there else 'NULL' for name in _ADDED)
        rows = self._execute(f'SELECT {_ALARM}, over_s, {added} FROM alarm ORDER BY sequence')
        return [
            KeptAlarm(_alarm(row[:7]), ended_s, over_s, over_by or '', over_why or '')
            for row in rows
            for over_s, ended_s, over_by, over_why in (row[7:],)
        ]

    def _columns(self) -> set[str]:
        return {name for (name,) in self._execute("SELECT name FROM pragma_table_info('alarm')")}


def _alarm(row: tuple[Any, ...]) -> Alarm:
    code, message, severity, *others = row
    return Alarm(code, message, Severity(severity), *others)
