"""What was changed behind the owner's back is found, and named."""

from __future__ import annotations

import sqlite3

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pack_msgs_py.hash_chain import HashChain, chain_errors, has_chain

SCHEMA = 'CREATE TABLE box (id INTEGER PRIMARY KEY, place TEXT, mass REAL, data BLOB)'

# What SQLite keeps: whole numbers, numbers, texts, bytes and nothing.
VALUES = (
    st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec='utf-8'))
    | st.binary()
    | st.none()
)


def write(db, chain, *statements):
    """A transaction, sealed."""
    db.execute('BEGIN')
    for statement in statements:
        db.execute(*statement) if isinstance(statement, tuple) else db.execute(statement)
    chain.seal()
    db.execute('COMMIT')


def chained():
    """A database with two boxes and a note, each written twice, and its chain."""
    db = sqlite3.connect(':memory:', isolation_level=None)
    chain = HashChain(db)
    db.execute('BEGIN')
    for statement in (SCHEMA, 'CREATE TABLE note (text TEXT)'):
        db.execute(statement)
    chain.begin()
    chain.seal()
    db.execute('COMMIT')
    for place in ('belt', 'bin'):
        write(
            db,
            chain,
            *(("REPLACE INTO box VALUES (?, ?, 1.5, x'00')", (n, place)) for n in (1, 2)),
            ('INSERT INTO note VALUES (?)', (place,)),
        )
    return db, chain


def made():
    return chained()[0]


def errors(db):
    return list(chain_errors(db))


def test_a_file_that_nobody_touched_agrees():
    assert errors(made()) == []


@pytest.mark.parametrize(
    ('change', 'named'),
    [
        ("UPDATE box SET place = 'belt' WHERE id = 2", "box 2 was changed: place is now 'belt'"),
        (
            'UPDATE box SET mass = 1.5000001 WHERE id = 1',
            'box 1 was changed: mass is now 1.5000001',
        ),
        ("UPDATE box SET data = x'01' WHERE id = 1", 'box 1 was changed: data is now'),
        ('DELETE FROM box WHERE id = 2', 'box 2 is missing'),
        ("INSERT INTO box VALUES (3, 'bin', 1.0, NULL)", 'box 3 is not in the chain'),
        ('UPDATE box SET id = 7 WHERE id = 2', 'box 7 is not in the chain'),
        ("UPDATE note SET text = 'bim' WHERE rowid = 2", "note 2 was changed: text is now 'bim'"),
        ('DELETE FROM chain WHERE sequence = 2', 'entries 2 to 2 of the chain are missing'),
        ("UPDATE chain SET hash = 'f' WHERE sequence = 2", 'entry 2 of the chain'),
        ("UPDATE chain SET written = '[]' WHERE sequence = 3", 'entry 3 of the chain'),
        ('ALTER TABLE note ADD COLUMN more TEXT', "sqlite_master 'note' was changed"),
    ],
)
def test_a_change_is_named(change, named):
    db = made()
    db.execute(change)
    assert any(named in text for text in errors(db)), errors(db)


def test_what_was_taken_back_is_not_in_the_chain():
    db, chain = chained()
    db.execute('BEGIN')
    db.execute("UPDATE box SET place = 'lost'")
    chain.forget()
    db.execute('ROLLBACK')
    write(db, chain, "UPDATE box SET place = 'belt' WHERE id = 2")
    assert errors(db) == []


def test_rows_that_are_taken_away_and_renamed_are_followed():
    db, chain = chained()
    write(db, chain, 'DELETE FROM box WHERE id = 1', 'UPDATE box SET id = 9 WHERE id = 2')
    write(db, chain, 'DELETE FROM note')
    assert errors(db) == []
    db.execute("INSERT INTO box VALUES (1, 'bin', 1.5, NULL)")
    assert errors(db) == ['box 1 is not in the chain: its key was changed, or it was added']


def test_a_table_that_is_made_later_is_covered_too():
    db, chain = chained()
    write(
        db, chain, 'CREATE TABLE late (a TEXT PRIMARY KEY, b)', "INSERT INTO late VALUES ('x', 1)"
    )
    write(db, chain, "REPLACE INTO late VALUES ('x', 2)")
    assert errors(db) == []
    db.execute('UPDATE late SET b = 3')
    assert errors(db) == ["late 'x' was changed: b is now 3"]


def test_another_connection_goes_on_with_the_chain(tmp_path):
    path = tmp_path / 'book.sqlite'
    for number in range(3):
        db = sqlite3.connect(path, isolation_level=None)
        chain = HashChain(db)
        if has_chain(db):
            chain.watch()
            write(db, chain, ('INSERT INTO box VALUES (?, NULL, NULL, NULL)', (number,)))
        else:
            db.execute('BEGIN')
            db.execute(SCHEMA)
            chain.begin()
            chain.seal()
            db.execute('COMMIT')
        assert errors(db) == []
        assert db.execute('SELECT count(*) FROM chain').fetchone() == (number + 1,)
        db.close()


@settings(max_examples=60)
@given(before=VALUES, after=VALUES)
def test_any_two_values_that_differ_are_told_apart(before, after):
    db, chain = chained()
    write(db, chain, ('UPDATE box SET data = ? WHERE id = 1', (before,)))
    assert errors(db) == []
    db.execute('UPDATE box SET data = ? WHERE id = 1', (after,))
    kept = db.execute('SELECT data FROM box WHERE id = 1').fetchone()[0]
    same = type(kept) is type(before) and repr(kept) == repr(before)
    assert (errors(db) == []) == same
