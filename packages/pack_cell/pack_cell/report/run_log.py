"""What the recorder has heard, on disk: a run that is gone on with has one summary.

SQLite in write-ahead mode. A commit does not wait for the disk: a killed process loses nothing, a
power cut the last moments at most. Boxes and bins are in the books of conveyor and executor, which
do wait; here are the times and counts.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

FILE_NAME = 'recorder.sqlite'
_SCHEMA_VERSION = 1
_SCHEMA = """
CREATE TABLE session (
    number INTEGER PRIMARY KEY,
    began_s REAL NOT NULL,
    first_decision_s REAL,
    wall_s REAL,
    complete INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE message (
    sequence INTEGER PRIMARY KEY,
    session INTEGER NOT NULL,
    elapsed_s REAL NOT NULL,
    topic TEXT NOT NULL,
    content BLOB NOT NULL
);
"""


class RunLogError(RuntimeError):
    """The log cannot be used; the text names the file and says why."""


@dataclass(frozen=True)
class RunSession:
    """One start of ``cell run``: the first, or one that went on.

    ``began_s`` is seconds since the epoch; ``first_decision_s`` and ``wall_s`` are seconds since
    then, the latter until its end or, where it was cut, until the last that was heard.
    """

    began_s: float
    first_decision_s: float | None
    wall_s: float

    @property
    def working_s(self) -> float:
        """Seconds since its first decision; 0 where there was none."""
        return 0.0 if self.first_decision_s is None else self.wall_s - self.first_decision_s


class RunLog:
    """Opens or makes the log in ``folder``; ``began_s`` is when this session began, steady clock.

    Raises
    ------
    RunLogError
        From any method: the file cannot be read or written, or is of another version.
    """

    def __init__(self, folder: Path, began_s: float) -> None:
        self.path = folder / FILE_NAME
        self._began_s = began_s
        with self._explained():
            self._db = sqlite3.connect(self.path, isolation_level=None)
            self._db.execute('PRAGMA journal_mode = WAL')
            self._db.execute('PRAGMA synchronous = NORMAL')
            version = self._db.execute('PRAGMA user_version').fetchone()[0]
            if version == 0:
                self._db.executescript(
                    f'BEGIN; {_SCHEMA} PRAGMA user_version = {_SCHEMA_VERSION}; COMMIT;'
                )
            elif version != _SCHEMA_VERSION:
                msg = f'{self.path} has version {version}, this program reads {_SCHEMA_VERSION}'
                raise RunLogError(msg)
            row = self._db.execute('SELECT coalesce(max(number), 0) FROM session').fetchone()
            self._number = int(row[0]) + 1
            values = (self._number, time.time() - self._elapsed_s())
            self._db.execute('INSERT INTO session VALUES (?, ?, NULL, NULL, 0)', values)

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def add(self, topic: str, content: bytes) -> None:
        """Remember a message of ``topic`` in its serialized form."""
        with self._explained():
            self._db.execute(
                'INSERT INTO message (session, elapsed_s, topic, content) VALUES (?, ?, ?, ?)',
                (self._number, self._elapsed_s(), topic, content),
            )

    def messages(self) -> Iterator[tuple[str, bytes]]:
        """Topic and content of every message of earlier sessions, in the order they were heard."""
        with self._explained():
            yield from self._db.execute(
                'SELECT topic, content FROM message WHERE session < ? ORDER BY sequence',
                (self._number,),
            )

    def decided(self) -> None:
        """The first decision of this session was heard."""
        self._set('first_decision_s')

    def ended(self) -> None:
        """The nodes of this session have ended."""
        self._set('wall_s')

    def completed(self) -> None:
        """Every box has come to its end, and the summary is written."""
        with self._explained():
            self._db.execute('UPDATE session SET complete = 1 WHERE number = ?', (self._number,))

    def sessions(self) -> tuple[RunSession, ...]:
        """Every session so far, this one included, oldest first."""
        with self._explained():
            rows = self._db.execute(
                'SELECT began_s, first_decision_s, coalesce(wall_s, (SELECT max(elapsed_s) '
                'FROM message WHERE session = number), first_decision_s, 0) '
                'FROM session ORDER BY number'
            ).fetchall()
        return tuple(RunSession(*row) for row in rows)

    def _set(self, column: str) -> None:
        with self._explained():
            values = (self._elapsed_s(), self._number)
            self._db.execute(f'UPDATE session SET {column} = ? WHERE number = ?', values)

    def _elapsed_s(self) -> float:
        return time.monotonic() - self._began_s

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            msg = f'{self.path} cannot be used: {error}'
            raise RunLogError(msg) from error


def is_complete(folder: Path) -> bool:
    """Whether the log in ``folder`` says that its run is complete; ``False`` without a log."""
    path = folder / FILE_NAME
    if not path.exists():
        return False
    try:
        db = sqlite3.connect(path)
        try:
            row = db.execute('SELECT coalesce(max(complete), 0) FROM session').fetchone()
        finally:
            db.close()
    except sqlite3.Error:
        return False
    return bool(row[0])
