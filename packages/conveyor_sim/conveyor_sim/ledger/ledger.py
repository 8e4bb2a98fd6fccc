"""The durable ledger: where every box is that the stream has given out so far.

SQLite in write-ahead mode, one file. ``synchronous=FULL``: a commit is on the disk before the
conveyor tells anybody, so that not even a power cut makes it forget a box that it has shown. That
costs one fsync per event of a box, which a box every few seconds affords.
"""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from pack_msgs_py.alarm_table import AlarmTable, KeptAlarm
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.box_codec import box_from_json, box_to_json
from pack_msgs_py.checks import InvalidValue
from pack_msgs_py.codes import Reason
from pack_msgs_py.hash_chain import HashChain, has_chain
from pack_msgs_py.operations import (
    OPERATION_COLUMNS,
    OPERATION_INSERT,
    OPERATION_TABLE,
    Operation,
    operation_of,
)
from pack_msgs_py.values import Box

FILE_NAME = 'conveyor.sqlite'
#: 3 had no hash chain.
_SCHEMA, _WITHOUT_CHAIN = '4', '3'
#: Ordinals of boxes that were inserted by hand begin here, above those of any stream.
INSERTED_FROM = 1_000_000_000

_TABLES = """
CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS boxes (
    ordinal INTEGER PRIMARY KEY,
    box_id TEXT NOT NULL UNIQUE,
    place TEXT NOT NULL,
    slot INTEGER,
    laps INTEGER NOT NULL,
    reason INTEGER NOT NULL,
    text TEXT NOT NULL,
    stamp_ns INTEGER NOT NULL,
    returned INTEGER NOT NULL,
    fed_s REAL,
    scans INTEGER NOT NULL
);
CREATE TABLE IF NOT EXISTS inserted (ordinal INTEGER PRIMARY KEY, box TEXT NOT NULL);
"""


class LedgerError(RuntimeError):
    """The ledger cannot be used; the text names the file and says what to do."""


class Whereabouts(str, Enum):
    """Where a box is.

    ``WAITING``: at the induct, pushed off the belt by a box that came back, or to be scanned again.
    ``UNSEEN``: behind the box before it, with which it was read as one.
    """

    ON_BELT = 'on_belt'
    WAITING = 'waiting'
    UNSEEN = 'unseen'
    PICKED = 'picked'
    PLACED = 'placed'
    REJECTED = 'rejected'
    LOST = 'lost'


@dataclass(frozen=True)
class BoxRecord:
    """One box that the stream has given out.

    ``slot`` is where it rides, or rode last. ``stamp_ns`` is the stamp of the newest event that
    changed its place, nanoseconds since the epoch; 0 while there was none. ``returned`` says that
    the arm has had it and brought it back. ``fed_s`` is the robot time at which it was first laid
    on the belt, ``None`` before. ``scans`` is how often it was scanned.
    """

    ordinal: int
    box_id: str
    place: Whereabouts
    slot: int | None = None
    laps: int = 0
    reason: Reason = Reason.NONE
    text: str = ''
    stamp_ns: int = 0
    returned: bool = False
    fed_s: float | None = None
    scans: int = 1


class Ledger:
    """Opens or makes the ledger of one stream; in memory when ``folder`` is empty.

    Raises
    ------
    LedgerError
        Another conveyor has it open, it is damaged, or it belongs to another stream.
    """

    def __init__(self, folder: str | Path, fingerprint: str, description: str) -> None:
        self.path = str(Path(folder).expanduser() / FILE_NAME) if str(folder) else ':memory:'
        with self._explained():
            if str(folder):
                Path(folder).expanduser().mkdir(parents=True, exist_ok=True)
            # Made where the node is, used where its executor spins: one thread at a time.
            self._db = sqlite3.connect(
                self.path, isolation_level=None, timeout=1.0, check_same_thread=False
            )
            self._chain = HashChain(self._db)
            self._alarms = AlarmTable(lambda *statement: self._db.execute(*statement).fetchall())
            try:
                self._open(fingerprint, description)
            except BaseException:
                self._db.close()
                raise

    def close(self) -> None:
        """Close the file; nothing is written."""
        self._db.close()

    def records(self) -> list[BoxRecord]:
        """Every box given out so far, in the order of the stream."""
        with self._explained():
            rows = self._db.execute(
                'SELECT ordinal, box_id, place, slot, laps, reason, text, stamp_ns, returned, '
                'fed_s, scans FROM boxes ORDER BY ordinal'
            ).fetchall()
        return [
            BoxRecord(ordinal, box_id, Whereabouts(place), slot, laps, Reason(reason), text,
                      stamp_ns, bool(returned), fed_s, scans)
            for ordinal, box_id, place, slot, laps, reason, text, stamp_ns, returned, fed_s, scans
            in rows
        ]  # fmt: skip

    def save(self, records: Iterable[BoxRecord], settings: Mapping[str, str]) -> None:
        """Write what changed, all of it or nothing; durable when this returns."""
        rows = [
            (r.ordinal, r.box_id, r.place.value, r.slot, r.laps, int(r.reason), r.text,
             r.stamp_ns, int(r.returned), r.fed_s, r.scans)
            for r in records
        ]  # fmt: skip
        with self._explained(), self._transaction():
            marks = ', '.join('?' * 11)
            self._db.executemany(f'REPLACE INTO boxes VALUES ({marks})', rows)
            self._set_meta(settings)

    def insert(self, box: Box) -> int:
        """Remember a box that was inserted by hand; returns its ordinal."""
        with self._explained(), self._transaction():
            row = self._db.execute('SELECT MAX(ordinal) FROM inserted').fetchone()
            ordinal = INSERTED_FROM if row[0] is None else int(row[0]) + 1
            values = (ordinal, box_to_json(box))
            self._db.execute('INSERT INTO inserted VALUES (?, ?)', values)
        return ordinal

    def inserted(self) -> dict[int, Box]:
        """Boxes that were inserted by hand, by ordinal."""
        with self._explained():
            rows = self._db.execute('SELECT ordinal, box FROM inserted').fetchall()
            return {ordinal: box_from_json(text) for ordinal, text in rows}

    def counts(self) -> dict[Whereabouts, int]:
        """How many boxes are where; the sum is the number that the stream has given out."""
        with self._explained():
            rows = self._db.execute('SELECT place, COUNT(*) FROM boxes GROUP BY place').fetchall()
        numbers = Counter({Whereabouts(place): number for place, number in rows})
        return {place: numbers[place] for place in Whereabouts}

    def setting(self, key: str, default: str = '') -> str:
        """A remembered value."""
        with self._explained():
            row = self._db.execute('SELECT value FROM meta WHERE key = ?', (key,)).fetchone()
        return str(row[0]) if row else default

    def set_setting(self, key: str, value: str) -> None:
        """Remember a value."""
        with self._explained(), self._transaction():
            self._set_meta({key: value})

    def _set_meta(self, values: Mapping[str, str]) -> None:
        self._db.executemany('REPLACE INTO meta VALUES (?, ?)', values.items())

    def write_operation(self, operation: Operation) -> None:
        """Remember what an operator has asked for, and what came of it."""
        with self._explained(), self._transaction():
            self._db.execute(OPERATION_INSERT, operation.row())

    def operations(self) -> list[Operation]:
        """Every request of an operator, oldest first."""
        with self._explained():
            rows = self._db.execute(f'SELECT {OPERATION_COLUMNS} FROM operation ORDER BY sequence')
            return [operation_of(row) for row in rows]

    def raise_alarm(self, alarm: Alarm) -> int:
        """An alarm or a warning has come up; returns its number."""
        with self._explained(), self._transaction():
            return self._alarms.raise_alarm(alarm)

    def end_alarm(self, number: int, now_s: float) -> None:
        """The cause of one is over."""
        with self._explained(), self._transaction():
            self._alarms.end(number, now_s)

    def acknowledge(self, now_s: float, who: str, why: str) -> None:
        """Somebody has looked at all that stands."""
        with self._explained(), self._transaction():
            self._alarms.acknowledge(now_s, who, why)

    def alarm_not_ended(self, code: str) -> int | None:
        """The number of the last alarm with ``code``, if its cause lasts."""
        with self._explained():
            return self._alarms.not_ended(code)

    def standing(self) -> tuple[Alarm, ...]:
        """Alarms that nobody has acknowledged."""
        with self._explained():
            return self._alarms.standing()

    def alarms(self) -> list[KeptAlarm]:
        """Every alarm and warning of the belt, oldest first."""
        with self._explained():
            return self._alarms.kept()

    def _open(self, fingerprint: str, description: str) -> None:
        # Held until close or death: two conveyors on one ledger would give out boxes twice.
        self._db.execute('PRAGMA locking_mode = EXCLUSIVE')
        self._db.execute('PRAGMA journal_mode = WAL')
        self._db.execute('PRAGMA synchronous = FULL')
        if has_chain(self._db):
            self._chain.watch()
        with self._transaction():
            for statement in (*_TABLES.split(';\n'), OPERATION_TABLE):
                self._db.execute(statement)
            self._alarms.make()
            known = dict(self._db.execute('SELECT key, value FROM meta').fetchall())
            if not known:
                values = {'schema': _SCHEMA, 'stream': fingerprint, 'description': description}
                self._set_meta(values)
                self._chain.begin()
                return
            if known.get('schema') == _WITHOUT_CHAIN:
                self._set_meta({'schema': _SCHEMA})
                self._chain.begin()
            elif known.get('schema') != _SCHEMA:
                msg = (
                    f'ledger {self.path} has format {known.get("schema")}, this conveyor reads '
                    f'{_SCHEMA}: give another state_dir'
                )
                raise LedgerError(msg)
        if known.get('stream') != fingerprint:
            msg = (
                f'ledger {self.path} belongs to another stream ({known.get("description")}), '
                f'not to this one ({description}): give another state_dir, or the same boxes_file, '
                'count and seed'
            )
            raise LedgerError(msg)

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute('BEGIN IMMEDIATE')
        try:
            yield
            self._chain.seal()
        except BaseException:
            self._chain.forget()
            self._db.execute('ROLLBACK')
            raise
        self._db.execute('COMMIT')

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError, InvalidValue) as error:
            if 'locked' in str(error):
                msg = f'ledger {self.path} is in use by another conveyor: give another state_dir'
            else:
                msg = f'ledger {self.path} cannot be used: {error}'
            raise LedgerError(msg) from error
