"""A hash chain over the rows of a SQLite file: what was changed behind its owner's back is named.

Each transaction appends an entry with the digests of the rows that it wrote, a short one for each
column, and a hash over that and the entry before. So a row that was changed, added or taken away,
and an entry that was, no longer agree. It tells damage and tampering; who can write the file can
also write a new chain.

Which rows are written is noted by triggers of the connection, so that no writer can forget it.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from typing import Any

_TABLE = """
CREATE TABLE chain (sequence INTEGER PRIMARY KEY, written TEXT NOT NULL, hash TEXT NOT NULL)
"""
_NOTED = 'CREATE TEMP TABLE IF NOT EXISTS noted (name TEXT, key, PRIMARY KEY (name, key))'
#: The definitions of the tables themselves.
_SCHEMA = 'sqlite_master'
_DIGITS = 12
#: What may happen to a row, and which key it has then; an update may change the key.
_CHANGES = (('INSERT', 'NEW'), ('UPDATE', 'NEW'), ('UPDATE', 'OLD'), ('DELETE', 'OLD'))

RowKey = tuple[str, Any]


class HashChain:
    """The chain of the open database ``db``, which covers all its tables.

    Call :meth:`begin` in the transaction that makes the tables, or :meth:`watch` when there is a
    chain already; then :meth:`seal` before each commit.
    """

    def __init__(self, db: sqlite3.Connection) -> None:
        self._db = db
        self._version = -1

    def begin(self) -> None:
        """Make the chain of a file that has none; all its rows go into the next entry."""
        self._db.execute(_TABLE)

    def watch(self) -> None:
        """Note from now on which rows are written."""
        self._db.execute(_NOTED)
        for table in _tables(self._db):
            self._watch(table)
        self._version = self._schema_version()

    def seal(self) -> None:
        """Append the entry of the transaction under way, if it has written anything."""
        if self._schema_version() != self._version:
            self._take_in()
        noted = self._db.execute('SELECT name, key FROM noted').fetchall()
        if not noted:
            return
        entries = [[table, key, self._now(table, key)] for table, key in noted]
        text = json.dumps(entries, separators=(',', ':'))
        last = self._db.execute('SELECT sequence, hash FROM chain ORDER BY sequence DESC LIMIT 1')
        sequence, before = last.fetchone() or (0, '')
        values = (sequence + 1, text, _hash(before, sequence + 1, text))
        self._db.execute('INSERT INTO chain VALUES (?, ?, ?)', values)
        self._db.execute('DELETE FROM noted')

    def forget(self) -> None:
        """The transaction was taken back, maybe with what was made to note rows."""
        self._version = -1

    def _schema_version(self) -> int:
        return int(self._db.execute('PRAGMA schema_version').fetchone()[0])

    def _take_in(self) -> None:
        """Tables were made: note their rows, and watch them."""
        self._db.execute(_NOTED)
        watched = {row[0] for row in self._db.execute('SELECT tbl_name FROM sqlite_temp_master')}
        for table in set(_tables(self._db)) - watched:
            self._db.execute(
                f'INSERT OR IGNORE INTO noted SELECT ?, {_key(self._db, table)} FROM {table}',
                (table,),
            )
            self._watch(table)
        self._db.execute(
            f"INSERT OR IGNORE INTO noted SELECT '{_SCHEMA}', name FROM {_SCHEMA} "
            "WHERE name NOT LIKE 'sqlite_%'"
        )
        self._version = self._schema_version()

    def _watch(self, table: str) -> None:
        key = _key(self._db, table)
        for when, row in _CHANGES:
            self._db.execute(
                f'CREATE TEMP TRIGGER IF NOT EXISTS {table}_{when}_{row} '
                f'AFTER {when} ON main.{table} '
                f"BEGIN INSERT OR IGNORE INTO noted VALUES ('{table}', {row}.{key}); END"
            )

    def _now(self, table: str, key: object) -> str:
        """Digest of a row as it is; empty for one that was taken away."""
        column = 'name' if table == _SCHEMA else _key(self._db, table)
        row = self._db.execute(f'SELECT * FROM {table} WHERE {column} = ?', (key,)).fetchone()
        return '' if row is None else _digest(row)


def has_chain(db: sqlite3.Connection) -> bool:
    """Whether the database ``db`` has a chain."""
    found = db.execute(f"SELECT 1 FROM {_SCHEMA} WHERE type = 'table' AND name = 'chain'")
    return found.fetchone() is not None


def chain_errors(db: sqlite3.Connection) -> Iterator[str]:
    """What does not agree with the chain, a clause each; nothing for a file that is as written.

    ``db`` is read with a text factory of its own, since damaged text may not be UTF-8.
    """
    db.text_factory = lambda data: data.decode('utf-8', 'surrogateescape')
    expected: dict[RowKey, str] = {}
    before, last = '', 0
    for sequence, text, kept in db.execute('SELECT * FROM chain ORDER BY sequence'):
        if sequence != last + 1:
            yield f'entries {last + 1} to {sequence - 1} of the chain are missing'
        elif _hash(before, sequence, text) != kept:
            yield f'entry {sequence} of the chain, or the hash of the one before, was changed'
        before, last = str(kept), sequence
        try:
            expected.update({(table, key): digest for table, key, digest in json.loads(text)})
        except (ValueError, TypeError):
            yield f'entry {sequence} of the chain cannot be read'
    expected = {row: digest for row, digest in expected.items() if digest}
    yield from _table_errors(db, _SCHEMA, 'name', expected)
    for table in _tables(db):
        yield from _table_errors(db, table, _key(db, table), expected)
    yield from (f'{table} {key!r} is missing' for table, key in expected)


def _tables(db: sqlite3.Connection) -> list[str]:
    """The tables that a chain covers."""
    rows = db.execute(f"SELECT name FROM {_SCHEMA} WHERE type = 'table' AND name != 'chain'")
    return [name for (name,) in rows.fetchall() if not name.startswith('sqlite_')]


def _key(db: sqlite3.Connection, table: str) -> str:
    """The column by which a row of ``table`` is found."""
    columns = db.execute('SELECT name FROM pragma_table_info(?) WHERE pk > 0', (table,)).fetchall()
    return str(columns[0][0]) if len(columns) == 1 else 'rowid'


def _table_errors(
    db: sqlite3.Connection, table: str, column: str, expected: dict[RowKey, str]
) -> Iterator[str]:
    """Rows that are not as the chain has them; takes those that are there out of ``expected``."""
    cursor = db.execute(f'SELECT {column}, * FROM {table}')
    names = [description[0] for description in cursor.description][1:]
    for key, *row in cursor.fetchall():
        if table == _SCHEMA and str(key).startswith('sqlite_'):
            continue
        digest = expected.pop((table, key), None)
        if digest is None:
            yield f'{table} {key!r} is not in the chain: its key was changed, or it was added'
            continue
        now, kept = _parts(_digest(row)), _parts(digest)
        changed = [
            f'{name} is now {value!r}'
            for name, value, one, other in zip(names, row, now, kept, strict=False)
            if one != other
        ]
        if changed or len(now) != len(kept):
            yield f'{table} {key!r} was changed: {", ".join(changed) or "columns were added"}'


def _digest(row: tuple[Any, ...] | list[Any]) -> str:
    return ''.join(
        hashlib.sha256(repr(value).encode('utf-8', 'surrogateescape')).hexdigest()[:_DIGITS]
        for value in row
    )


def _parts(digest: str) -> list[str]:
    return [digest[at : at + _DIGITS] for at in range(0, len(digest), _DIGITS)]


def _hash(before: str, sequence: int, text: str) -> str:
    data = f'{before} {sequence} {text}'.encode('utf-8', 'surrogateescape')
    return hashlib.sha256(data).hexdigest()
