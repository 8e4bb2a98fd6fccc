"""The book of bins, alone and over random histories with crashes."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import pytest
from executor_cases import CELL, LDC, make_box, make_decision
from hypothesis import given, settings
from hypothesis import strategies as st

from arm_executor.bins.book import BinBook, BookError
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import configuration
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.pose import Pose

CONFIG = configuration(LDC, CELL)


def make_book(folder='', count=2):
    book = BinBook(Journal(folder, CONFIG), LDC, count, lambda: 100.0)
    book.recover()
    book.settled(book.state.poses)
    return book


def put(book, number, corner_mm, **decision):
    box = make_box(number)
    book.begin(make_decision(box, corner_mm, **decision))
    book.picked()
    book.releasing()
    book.placed()
    return book.verified(make_decision(box, corner_mm).target, {})


def test_bins_stand_at_the_stations_in_order():
    bins = make_book(count=3).state.bins
    assert [(bin_.id, bin_.serial, bin_.station, bin_.revision) for bin_ in bins] == [
        ('LDC-1', 1, 'A', 1),
        ('LDC-2', 2, 'B', 1),
        ('LDC-3', 3, 'C', 1),
    ]


def test_a_placement_grows_the_revision_of_its_bin_alone():
    book = make_book()
    before = book.state
    event = put(book, 1, (0, 0, 0))
    assert (event.event, event.bin_id, event.bin_serial) == (BoxEventKind.PLACED, 'LDC-1', 1)
    assert book.state.revision == before.revision + 1
    assert [bin_.revision for bin_ in book.state.bins] == [2, 1]


def test_moved_neighbours_are_written_down():
    book = make_book()
    put(book, 1, (0, 0, 0))
    moved = Pose((0.2, 0.1, 0.075))
    book.begin(make_decision(make_box(2), (300, 0, 0), revision=2))
    book.picked()
    book.releasing()
    book.placed()
    book.verified(None, {'box-1': moved})
    assert book.state.bins[0].boxes[0].measured_mm == (200.0, 100.0, 75.0)
    assert book.state.poses['box-1'] == moved
    assert book._journal.open_bins() == book.state.bins


def test_a_swap_keeps_station_and_age_order():
    book = make_book()
    put(book, 1, (0, 0, 0))
    old, new = book.swap('LDC-1', 2)
    assert (old.id, len(old.boxes)) == ('LDC-1', 1)
    assert (new.id, new.station, new.boxes) == ('LDC-3', 'A', ())
    assert [bin_.id for bin_ in book.state.bins] == ['LDC-2', 'LDC-3']
    assert book.state.poses == {}


@pytest.mark.parametrize(
    ('bin_id', 'revision', 'message'),
    [('LDC-7', 0, 'open are LDC-1, LDC-2'), ('LDC-1', 9, 'at revision 1, you have seen 9')],
)
def test_a_wrong_swap_says_why(bin_id, revision, message):
    with pytest.raises(BookError, match=message):
        make_book().swap(bin_id, revision)


def test_a_bin_is_not_swapped_under_a_box_in_motion():
    book = make_book()
    book.begin(make_decision(make_box()))
    with pytest.raises(BookError, match="'box-1' is being placed"):
        book.swap('LDC-1', 1)


def test_a_placement_for_a_bin_that_has_changed_is_not_begun():
    book = make_book()
    with pytest.raises(BookError, match='has changed'):
        book.begin(make_decision(make_box(), revision=5))


def test_a_missing_bin_is_opened_and_a_surplus_one_kept(tmp_path):
    single = make_book(tmp_path, count=1)
    single._journal.close()
    three = make_book(tmp_path, count=3)
    assert [bin_.station for bin_ in three.state.bins] == ['A', 'B', 'C']
    three._journal.close()
    assert len(make_book(tmp_path, count=1).state.bins) == 3


# -- random histories ---------------------------------------------------------------------------

#: How far a placement comes, and then how it ends; a crash may follow any call.
PATHS = {
    'forgotten': ['begin', 'forgotten'],
    'returned': ['begin', 'picked', 'returned'],
    'lost': ['begin', 'picked', 'lost'],
    'held again': ['begin', 'picked', 'releasing', 'returned'],
    'placed': ['begin', 'picked', 'releasing', 'placed', 'verified'],
}

#: Where a box is when the call was the last one before a crash.
AFTER_CRASH = {
    'begin': 'belt',
    'picked': 'belt',
    'forgotten': 'belt',
    'returned': 'belt',
    'lost': 'lost',
    'releasing': 'bin',
    'placed': 'bin',
    'verified': 'bin',
}

histories = st.lists(
    st.tuples(st.sampled_from(sorted(PATHS)), st.integers(0, 9), st.booleans()),
    min_size=1,
    max_size=8,
)


def call(book, name, box_id, number):
    target = book.state.bins[0]
    actions = {
        'begin': lambda: book.begin(
            make_decision(
                make_box(number), bin_id=target.id, serial=target.serial, revision=target.revision
            )
        ),
        'picked': book.picked,
        'releasing': book.releasing,
        'placed': book.placed,
        'forgotten': book.forgotten,
        'returned': lambda: book.returned(Reason.FAULT, ''),
        'lost': lambda: book.lost(''),
        'verified': lambda: book.verified(Pose((0.1, 0.1, 0.1)), {}),
    }
    actions[name]()


@settings(max_examples=25, deadline=None)
@given(histories)
def test_every_box_is_in_exactly_one_place_whenever_the_executor_dies(history):
    """``history``: for each box the way it takes, after how many calls a crash comes, and
    whether the oldest bin is swapped before it."""
    with tempfile.TemporaryDirectory() as root:
        folder, book = Path(root) / '0', make_book(Path(root) / '0')
        expected, revision = {}, 0
        for number, (path, crash_after, swap) in enumerate(history):
            box_id = f'box-{number}'
            if swap:
                book.swap(book.state.bins[0].id, 0)
            calls = PATHS[path][: crash_after + 1]
            for name in calls:
                call(book, name, box_id, number)
            expected[box_id] = AFTER_CRASH[calls[-1]]
            if book.attempt is not None or crash_after % 2:
                shown = book.state
                folder, crashed = Path(root) / str(number + 1), folder
                shutil.copytree(crashed, folder)
                book._journal.close()
                book = make_book(folder)
                assert book.state.revision > shown.revision
                assert book.attempt is None
            assert book.state.revision >= revision
            revision = book.state.revision
            assert places(book) == expected
            assert last_words(book) == told(expected, book)
        book._journal.close()


def places(book):
    """Every place that each box ever handled is in, from the journal's own rows."""
    rows = book._journal._db.execute('SELECT box_id, step FROM attempt').fetchall()
    where = {'verified': 'bin', 'lost': 'lost', 'returned': 'belt', 'forgotten': 'belt'}
    in_bins = [
        placed.box.id
        for bin_ in (*book.state.bins, *(closed for closed, _ in book.closed()))
        for placed in bin_.boxes
    ]
    assert len(in_bins) == len(set(in_bins))
    assert book.ids_in_bins == set(in_bins)
    place_of = {box_id: where[step] for box_id, step in rows}
    assert {box_id for box_id, place in place_of.items() if place == 'bin'} == set(in_bins)
    return place_of


def last_words(book):
    """The last event of each box: what the other nodes believe."""
    return {event.box_id: event.event.name for event in book.events()}


def told(expected, book):
    rows = book._journal._db.execute("SELECT attempt FROM step WHERE step = 'picked'").fetchall()
    picked = {row[0] for row in rows}
    ids = dict(book._journal._db.execute('SELECT box_id, id FROM attempt').fetchall())
    words = {'bin': 'PLACED', 'lost': 'LOST', 'belt': 'RETURNED'}
    return {box: words[place] for box, place in expected.items() if ids[box] in picked}


def test_stations_serve_destinations_in_turn_and_a_swapped_bin_another_if_asked(tmp_path):
    def made():
        journal = Journal(tmp_path, CONFIG)
        book = BinBook(journal, LDC, 3, lambda: 100.0, ('north', 'south'))
        book.recover()
        return journal, book

    journal, book = made()
    assert [bin_.destination for bin_ in book.state.bins] == ['north', 'south', 'north']
    assert book.swap('LDC-1', 0)[1].destination == 'north'
    assert book.swap('LDC-2', 0, 'east')[1].destination == 'east'
    standing = {bin_.id: bin_.destination for bin_ in book.state.bins}
    journal.close()
    journal, again = made()
    assert {bin_.id: bin_.destination for bin_ in again.state.bins} == standing
    assert again.swap('LDC-5', 0)[1].destination == 'east'
    journal.close()
