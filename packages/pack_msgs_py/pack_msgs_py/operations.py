"""What operators ask of a node, as its journal keeps it: who, when, why, and what came of it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

#: Who has asked, where nobody says it.
SOMEBODY = 'an operator'

#: The table in a node's SQLite file, and a row of it.
OPERATION_TABLE = """
CREATE TABLE IF NOT EXISTS operation (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    stamp_s REAL NOT NULL,
    command TEXT NOT NULL,
    subject TEXT NOT NULL,
    who TEXT NOT NULL,
    why TEXT NOT NULL,
    done INTEGER NOT NULL,
    answer TEXT NOT NULL
)"""
OPERATION_INSERT = (
    'INSERT INTO operation (stamp_s, command, subject, who, why, done, answer) '
    'VALUES (?, ?, ?, ?, ?, ?, ?)'
)
OPERATION_COLUMNS = 'stamp_s, command, subject, who, why, done, answer'


@dataclass(frozen=True)
class Operation:
    """One request of an operator, done or refused.

    Attributes
    ----------
    stamp_s : when, seconds since the epoch.
    command : name of a :class:`~pack_msgs_py.codes.Command`, or INSERT_BOX or REMOVE_BOX.
    subject : the bin or box that it is about, empty for none.
    who, why : as the operator gave them.
    done, answer : whether it was done, and what the operator was told.
    """

    stamp_s: float
    command: str
    subject: str = ''
    who: str = SOMEBODY
    why: str = ''
    done: bool = True
    answer: str = ''

    def row(self) -> tuple[Any, ...]:
        """Values of :data:`OPERATION_INSERT`."""
        return (
            *(self.stamp_s, self.command, self.subject, self.who, self.why),
            *(int(self.done), self.answer),
        )

    def says(self, what: str) -> str:
        """For people: ``what`` was done by whom, since when and why."""
        since = time.strftime('%H:%M:%S', time.localtime(self.stamp_s))
        why = f': {self.why}' if self.why else ''
        return f'{what} by {self.who} (since {since}){why}'


def operation_of(row: tuple[Any, ...]) -> Operation:
    """The request that a row with :data:`OPERATION_COLUMNS` tells of."""
    stamp_s, command, subject, who, why, done, answer = row
    return Operation(stamp_s, command, subject, who, why, bool(done), answer)
