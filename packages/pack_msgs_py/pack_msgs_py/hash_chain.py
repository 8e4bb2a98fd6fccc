"""A hash chain over the rows of a SQLite file: what was changed behind its owner's back is named.

Each transaction appends an entry with the digests of the rows that it wrote, a short one for each
column, and a hash over that and the entry before. So a row that was changed, added or taken away,
and an entry that was, no longer agree. It tells damage and tampering; who can write the file can
also write a new chain.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Mapping
from typing import Any

#: To be created with the tables of the owner.
CHAIN_TABLE = """
CREATE TABLE chain (sequence INTEGER PRIMARY KEY, written TEXT NOT NULL, hash TEXT NOT NULL)
"""
#: The definitions of the tables themselves, by name.
_SCHEMA = {'sqlite_master': 'name'}
_DIGITS = 12

RowKey = tuple[str, Any]


class HashChain:
    """The chain of the open database ``db``.

    Parameters
    ----------
    db : has the table of :data:`CHAIN_TABLE` when :meth:`seal` is called first.
    keys : tables that it covers, each with the column by which a row is found.
    """

    def __init__(self, db: sqlite3.Connection, keys: Mapping[str, str]) -> None:
        self._db = db
        self._keys = _SCHEMA | dict(keys)
        self._touched: dict[RowKey, None] = {}

    def touch(self, table: str, key: object) -> None:
        """A row is written in the transaction under way."""
        self._touched[table, key] = None

    def touch_all(self) -> None:
        """All rows that there are: of a file that had no chain."""
        for table, column in self._keys.items():
            for (key,) in self._db.execute(f'SELECT {column} FROM {table}').fetchall():
                if not _is_of_sqlite(table, key):
                    self.touch(table, key)

    def forget(self) -> None:
        """The transaction was taken back."""
        self._touched.clear()

    def seal(self) -> None:
        """Append the entry of the transaction under way, if it has written anything."""
        if not self._touched:
            return
        entries = [
            [table, key, _digest(row)]
            for table, key in self._touched
            for row in _rows(self._db, table, self._keys[table], key)
        ]
        text = json.dumps(entries, separators=(',', ':'))
        last = self._db.execute('SELECT sequence, hash FROM chain ORDER BY sequence DESC LIMIT 1')
        sequence, before = last.fetchone() or (0, '')
        values = (sequence + 1, text, _hash(before, sequence + 1, text))
        self._db.execute('INSERT INTO chain VALUES (?, ?, ?)', values)
        self._touched.clear()


def chain_errors(db: sqlite3.Connection, keys: Mapping[str, str]) -> Iterator[str]:
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
    for table, column in (_SCHEMA | dict(keys)).items():
        yield from _table_errors(db, table, column, expected)
    yield from (f'{table} {key!r} is missing' for table, key in expected)


def _table_errors(
    db: sqlite3.Connection, table: str, column: str, expected: dict[RowKey, str]
) -> Iterator[str]:
    """Rows that are not as the chain has them; takes those that are there out of ``expected``."""
    cursor = db.execute(f'SELECT {column}, * FROM {table}')
    names = [description[0] for description in cursor.description][1:]
    for key, *row in cursor.fetchall():
        if _is_of_sqlite(table, key):
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


def _rows(db: sqlite3.Connection, table: str, column: str, key: object) -> list[tuple[Any, ...]]:
    return db.execute(f'SELECT * FROM {table} WHERE {column} = ?', (key,)).fetchall()


def _digest(row: tuple[Any, ...] | list[Any]) -> str:
    return ''.join(
        hashlib.sha256(repr(value).encode('utf-8', 'surrogateescape')).hexdigest()[:_DIGITS]
        for value in row
    )


def _is_of_sqlite(table: str, key: object) -> bool:
    """Whether a row is about a table that SQLite keeps for itself."""
    return table == 'sqlite_master' and str(key).startswith('sqlite_')


def _parts(digest: str) -> list[str]:
    return [digest[at : at + _DIGITS] for at in range(0, len(digest), _DIGITS)]


def _hash(before: str, sequence: int, text: str) -> str:
    data = f'{before} {sequence} {text}'.encode('utf-8', 'surrogateescape')
    return hashlib.sha256(data).hexdigest()
