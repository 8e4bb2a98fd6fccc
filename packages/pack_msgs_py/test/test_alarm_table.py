"""A book of an earlier version takes up what alarms have in newer ones, and its chain holds."""

from __future__ import annotations

import sqlite3

import pytest

from pack_msgs_py.alarm_table import AlarmTable
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.hash_chain import HashChain, chain_errors

EARLIER = """
CREATE TABLE alarm (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT, raised_s REAL NOT NULL, severity INTEGER NOT NULL,
    code TEXT NOT NULL, message TEXT NOT NULL, action TEXT NOT NULL, box_id TEXT NOT NULL,
    bin_id TEXT NOT NULL, over_s REAL
)"""
JAM = Alarm('JAM', 'the belt stands', action='Clear it.', raised_s=10.0)


class Book:
    """A SQLite file in memory with a chain; an earlier table has two rows."""

    def __init__(self, *, earlier):
        self.db = sqlite3.connect(':memory:', isolation_level=None)
        self.chain = HashChain(self.db)
        self.table = AlarmTable(lambda *statement: self.db.execute(*statement).fetchall())
        if earlier:
            self.within(lambda: (self.db.execute(EARLIER), self.chain.begin()))
            self.within(lambda: (self.table.raise_alarm(JAM), self.table.raise_alarm(JAM)))
        else:
            self.within(lambda: (self.chain.begin(), self.table.make()))

    def within(self, do):
        self.db.execute('BEGIN')
        done = do()
        self.chain.seal()
        self.db.execute('COMMIT')
        return done

    def errors(self):
        return list(chain_errors(self.db))


def test_a_table_of_an_earlier_version_is_read_as_it_is():
    book = Book(earlier=True)
    assert [kept.alarm for kept in book.table.kept()] == [JAM, JAM]


@pytest.mark.parametrize('earlier', [False, True])
def test_what_becomes_of_an_alarm_is_kept_and_the_chain_holds(earlier):
    book = Book(earlier=earlier)
    assert book.errors() == []
    book.within(book.table.make)
    assert book.errors() == []
    number = book.within(lambda: book.table.raise_alarm(JAM))
    assert book.table.not_ended('JAM') == number
    book.within(lambda: book.table.end(number, 12.0))
    assert book.table.not_ended('JAM') is None
    assert JAM in book.table.standing()
    book.within(lambda: book.table.acknowledge(15.0, 'anna', 'stuck'))
    last = book.table.kept()[-1]
    assert (last.ended_s, last.over_s, last.over_by, last.over_why) == (12.0, 15.0, 'anna', 'stuck')
    assert book.table.standing() == ()
    assert book.errors() == []


def test_a_book_without_that_table_tells_of_none():
    db = sqlite3.connect(':memory:')
    assert AlarmTable(lambda *statement: db.execute(*statement).fetchall()).kept() == []
