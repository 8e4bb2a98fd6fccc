"""The executor's journal: one SQLite file that survives any crash.

Every method is one transaction, and it is on the disk when the method returns. The journal stores
what it is told; what a step means for the bins is decided in :mod:`arm_executor.bins.book`.
"""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from arm_executor.bins.journal_reader import JournalError, JournalReader
from arm_executor.bins.records import Attempt, Step
from pack_msgs_py.box_codec import placed_to_json, pose_to_json
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.hash_chain import HashChain
from pack_msgs_py.values import Bin

__all__ = ['FILE_NAME', 'Journal', 'JournalError']

FILE_NAME = 'executor.sqlite'
#: 2 had no hash chain.
SCHEMA_VERSION, _WITHOUT_CHAIN = 3, 2

_SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE bin (
    serial INTEGER PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    type TEXT NOT NULL,
    size_mm TEXT NOT NULL,
    station TEXT NOT NULL,
    destination TEXT NOT NULL,
    revision INTEGER NOT NULL,
    opened_s REAL NOT NULL,
    closed_s REAL
);
CREATE TABLE attempt (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    box_id TEXT NOT NULL,
    bin_serial INTEGER NOT NULL REFERENCES bin (serial),
    goal_id BLOB NOT NULL,
    placed TEXT NOT NULL,
    target TEXT NOT NULL,
    measured TEXT,
    step TEXT NOT NULL
);
-- A box is in one bin at most, whatever the program does.
CREATE UNIQUE INDEX box_in_one_bin ON attempt (box_id)
    WHERE step IN ('releasing', 'placed', 'verified');
CREATE INDEX attempt_of_bin ON attempt (bin_serial);
CREATE TABLE step (attempt INTEGER NOT NULL, step TEXT NOT NULL, stamp_s REAL NOT NULL);
CREATE TABLE event (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    stamp_s REAL NOT NULL,
    box_id TEXT NOT NULL,
    event INTEGER NOT NULL,
    reason INTEGER NOT NULL,
    text TEXT NOT NULL,
    bin_id TEXT NOT NULL,
    bin_serial INTEGER NOT NULL
);
"""


class Journal(JournalReader):
    """The file ``executor.sqlite`` in ``folder``; in memory when ``folder`` is empty.

    Parameters
    ----------
    folder : created if it is missing.
    config : what the journal is bound to, see :func:`arm_executor.bins.records.configuration`.

    Attributes
    ----------
    health : 'ok', or why it could not be written last.

    Raises
    ------
    JournalError
        The file is not a journal, of another version, of another configuration, or in use.
    """

    def __init__(self, folder: str | Path, config: Mapping[str, Any]) -> None:
        self.path = Path(folder) / FILE_NAME if folder else None
        self.health = 'ok'
        self._lock_fd: int | None = None
        name = ':memory:'
        if self.path is not None:
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                msg = f'cannot create state_dir {str(folder)!r}: {error.strerror}'
                raise JournalError(msg) from error
            self._claim(self.path.with_suffix('.lock'))
            name = str(self.path)
        try:
            # Two threads use it, one at a time: BinBook holds a lock around every call.
            self._db = sqlite3.connect(name, isolation_level=None, check_same_thread=False)
            self._chain = HashChain(self._db)
            self._prepare(dict(config))
        except sqlite3.Error as error:
            self._release()
            msg = f'cannot use journal {name}: {error}; move the file away to start anew'
            raise JournalError(msg) from error
        except JournalError:
            self.close()
            raise

    def _claim(self, path: Path) -> None:
        """Two executors on one journal would each believe to own the bins."""
        try:
            self._lock_fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            fcntl.flock(self._lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._release()
            msg = (
                f'journal {self.path} cannot be locked ({error.strerror}): another executor uses it'
            )
            raise JournalError(msg) from error

    def _release(self) -> None:
        if self._lock_fd is not None:
            os.close(self._lock_fd)
            self._lock_fd = None

    def _prepare(self, config: dict[str, Any]) -> None:
        self._db.execute('PRAGMA journal_mode = WAL')
        # With WAL, NORMAL may lose the last commits when the power fails; then a box that is in a
        # bin would be expected on the belt. FULL waits for the disk at every commit.
        self._db.execute('PRAGMA synchronous = FULL')
        self._db.execute('PRAGMA foreign_keys = ON')
        version = self._db.execute('PRAGMA user_version').fetchone()[0]
        if version == 0:
            with self.transaction():
                for statement in _SCHEMA.split(';\n'):
                    self._db.execute(statement)
                self._set_meta('config', json.dumps(config))
                self._set_meta('revision', '0')
                self._begin_chain()
            return
        if version not in (SCHEMA_VERSION, _WITHOUT_CHAIN):
            msg = (
                f'journal {self.path} has schema version {version}, this program needs '
                f'{SCHEMA_VERSION}; use another state_dir'
            )
            raise JournalError(msg)
        kept = json.loads(self._meta('config'))
        wanted = json.loads(json.dumps(config))
        differing = [
            f'{key} is {kept.get(key)!r} there and {wanted.get(key)!r} here'
            # what is newer than the journal holds from now on
            for key in sorted(kept)
            if kept[key] != wanted.get(key)
        ]
        if differing:
            msg = (
                f'journal {self.path} belongs to another configuration: {"; ".join(differing)}. '
                'Start with that configuration, or with another state_dir'
            )
            raise JournalError(msg)
        if version == _WITHOUT_CHAIN:
            with self.transaction():
                self._begin_chain()
        else:
            self._chain.watch()

    def _begin_chain(self) -> None:
        """Take all rows that there are into a new chain."""
        self._chain.begin()
        self._db.execute(f'PRAGMA user_version = {SCHEMA_VERSION}')

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All or nothing; durable when the block ends. :class:`JournalError` if it cannot be."""
        try:
            self._db.execute('BEGIN IMMEDIATE')
            try:
                yield
                self._chain.seal()
                self._db.execute('COMMIT')
            except BaseException:
                self._chain.forget()
                if self._db.in_transaction:
                    self._db.execute('ROLLBACK')
                raise
        except sqlite3.Error as error:
            msg = f'cannot write journal {self.path or "in memory"}: {error}'
            self.health = msg
            raise JournalError(msg) from error

    def close(self) -> None:
        """Close the file and let another process use it."""
        self._db.close()
        self._release()

    def _set_meta(self, key: str, value: str) -> None:
        self._db.execute('INSERT OR REPLACE INTO meta VALUES (?, ?)', (key, value))

    def execute(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """Carry out one statement of those who keep tables of their own here; its rows."""
        return self._db.execute(statement, tuple(values)).fetchall()

    # -- written inside a transaction of the caller ------------------------------------------

    def set_revision(self, revision: int) -> None:
        """Revision of all bins together."""
        self._set_meta('revision', str(revision))

    def add_bin(self, opened: Bin, stamp_s: float) -> None:
        """A bin was opened."""
        row = (
            opened.serial,
            opened.id,
            opened.spec.name,
            json.dumps(opened.spec.size_mm),
            opened.station,
        )
        self._db.execute(
            'INSERT INTO bin VALUES (?, ?, ?, ?, ?, ?, ?, ?, NULL)',
            (*row, opened.destination, opened.revision, stamp_s),
        )

    def close_bin(self, serial: int, stamp_s: float) -> None:
        """A bin was closed and taken away."""
        self._db.execute('UPDATE bin SET closed_s = ? WHERE serial = ?', (stamp_s, serial))

    def set_bin_revision(self, serial: int, revision: int) -> None:
        """The content of a bin has changed."""
        self._db.execute('UPDATE bin SET revision = ? WHERE serial = ?', (revision, serial))

    def add_attempt(self, attempt: Attempt, stamp_s: float) -> Attempt:
        """A placement begins; returns it with its number."""
        cursor = self._db.execute(
            'INSERT INTO attempt (box_id, bin_serial, goal_id, placed, target, step) '
            'VALUES (?, ?, ?, ?, ?, ?)',
            (
                attempt.placed.box.id,
                attempt.bin_serial,
                attempt.goal_id,
                placed_to_json(attempt.placed),
                pose_to_json(attempt.target),
                attempt.step.value,
            ),
        )
        number = int(cursor.lastrowid or 0)
        self._log(number, attempt.step.value, stamp_s)
        return replace(attempt, id=number)

    def set_step(self, attempt: int, step: Step, stamp_s: float) -> None:
        """A placement goes on to ``step``."""
        self._db.execute('UPDATE attempt SET step = ? WHERE id = ?', (step.value, attempt))
        self._log(attempt, step.value, stamp_s)

    def note(self, attempt: int, text: str, stamp_s: float) -> None:
        """Log that something happened to a placement that does not change its step."""
        self._log(attempt, text, stamp_s)

    def _log(self, attempt: int, step: str, stamp_s: float) -> None:
        values = (attempt, step, stamp_s)
        self._db.execute('INSERT INTO step VALUES (?, ?, ?)', values)

    def set_measured(self, poses: Mapping[str, Pose]) -> None:
        """Boxes in bins were measured, bin frame."""
        for box_id, pose in poses.items():
            text = pose_to_json(pose)
            moved = self._db.execute(
                'SELECT id FROM attempt WHERE box_id = ? AND measured IS NOT ? '
                "AND step IN ('releasing', 'placed', 'verified')",
                (box_id, text),
            ).fetchall()
            for (number,) in moved:
                self._db.execute('UPDATE attempt SET measured = ? WHERE id = ?', (text, number))

    def add_event(self, event: BoxEvent) -> None:
        """Something happened to a box that the other nodes are told."""
        self._db.execute(
            'INSERT INTO event (stamp_s, box_id, event, reason, text, bin_id, bin_serial) '
            'VALUES (?, ?, ?, ?, ?, ?, ?)',
            (
                event.stamp_s,
                event.box_id,
                int(event.event),
                int(event.reason),
                event.text,
                event.bin_id,
                event.bin_serial,
            ),
        )
