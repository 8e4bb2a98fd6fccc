"""What was changed behind the owner's back is found, and named."""

from __future__ import annotations

import sqlite3

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pack_msgs_py.hash_chain import CHAIN_TABLE, HashChain, chain_errors

KEYS = {'box': 'id', 'note': 'rowid'}
SCHEMA = 'CREATE TABLE box (id INTEGER PRIMARY KEY, place TEXT, mass REAL, data BLOB)'

# What SQLite keeps: whole numbers, numbers, texts, bytes and nothing.
VALUES = (
    st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec='utf-8'))
    | st.binary()
    | st.none()
)


def made():
    """A database with two boxes and a note, each written twice."""
    db = sqlite3.connect(':memory:', isolation_level=None)
    for statement in (SCHEMA, 'CREATE TABLE note (text TEXT)', CHAIN_TABLE):
        db.execute(statement)
    chain = HashChain(db, KEYS)
    chain.touch_all()
    chain.seal()
    for place in ('belt', 'bin'):
        for number in (1, 2):
            db.execute('REPLACE INTO box VALUES (?, ?, 1.5, ?)', (number, place, b'\x00'))
            chain.touch('box', number)
        chain.touch('note', db.execute('INSERT INTO note VALUES (?)', (place,)).lastrowid)
        chain.seal()
    return db


def errors(db):
    return list(chain_errors(db, KEYS))


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
    db = made()
    chain = HashChain(db, KEYS)
    db.execute('BEGIN')
    db.execute("UPDATE box SET place = 'lost'")
    chain.touch('box', 1)
    chain.forget()
    db.execute('ROLLBACK')
    chain.seal()
    assert errors(db) == []


@settings(max_examples=60)
@given(before=VALUES, after=VALUES)
def test_any_two_values_that_differ_are_told_apart(before, after):
    db = made()
    chain = HashChain(db, KEYS)
    db.execute('UPDATE box SET data = ? WHERE id = 1', (before,))
    chain.touch('box', 1)
    chain.seal()
    assert errors(db) == []
    db.execute('UPDATE box SET data = ? WHERE id = 1', (after,))
    kept = db.execute('SELECT data FROM box WHERE id = 1').fetchone()[0]
    same = type(kept) is type(before) and repr(kept) == repr(before)
    assert (errors(db) == []) == same
