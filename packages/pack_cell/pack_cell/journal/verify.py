"""Whether the books of a run are as they were written, and agree."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path

from arm_executor.bins.journal import FILE_NAME as JOURNAL
from conveyor_sim.ledger.ledger import FILE_NAME as LEDGER
from pack_cell.journal.run_books import BooksError, opened, read_run_books
from pack_msgs_py.hash_chain import chain_errors, has_chain

_BOOKS = (JOURNAL, LEDGER)


def book_errors(state: Path, *, old_too: bool = False) -> list[str]:
    """What is wrong with the books in the folder ``state``, a line each; empty when nothing is.

    With ``old_too`` a book of a version without hash chain is as good as one with it.
    """
    wrong = [
        f'{name}: {text}'
        for name in _BOOKS
        if (state / name).exists()
        for text in _file_errors(state / name, old_too)
    ]
    return wrong or list(_differences(state))


def _file_errors(path: Path, old_too: bool) -> Iterator[str]:
    try:
        with opened(path) as db:
            if not db.execute('SELECT count(*) FROM sqlite_master').fetchone()[0]:
                return  # a crash came between the file and its tables
            damage = [row[0] for row in db.execute('PRAGMA integrity_check(5)')]
            if damage != ['ok']:
                yield from (f'SQLite says: {text}' for text in damage)
            if has_chain(db):
                yield from chain_errors(db)
            elif not old_too:
                yield 'it has no hash chain: another version wrote it; the next start adds one'
    except (sqlite3.Error, ValueError) as error:
        used = 'locked' in str(error)
        yield 'it is in use: stop the cell first' if used else f'it cannot be read: {error}'


def _differences(state: Path) -> Iterator[str]:
    """Boxes that the two books do not agree about."""
    try:
        books = read_run_books(state)
    except BooksError as error:
        yield str(error)
        return
    in_bins = {attempt.placed.box.id for attempt in books.attempts if attempt.step.in_bin}
    for fed in books.fed or ():
        if fed.place == 'placed' and fed.box_id not in in_bins:
            yield f'box {fed.box_id!r} is in a bin by {LEDGER}, and in none by {JOURNAL}'
        elif fed.place == 'rejected' and fed.box_id in in_bins:
            yield f'box {fed.box_id!r} is in a bin by {JOURNAL}, and rejected by {LEDGER}'
