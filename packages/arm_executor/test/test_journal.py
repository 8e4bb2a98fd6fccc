"""The journal survives crashes, and refuses what it cannot use."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from executor_cases import CELL, LDC, make_box, make_decision

from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal, JournalError
from arm_executor.bins.records import Step, configuration, placed_of
from pack_msgs_py.box_codec import placed_from_json, placed_to_json
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Box, parse_bin

DATA = Path(__file__).parent / 'data'
CONFIG = configuration(LDC, CELL)
MEASURED = Pose((0.151, 0.101, 0.075), (0.0, 0.0, 0.0, 1.0))

STEPS = {
    'planned': lambda book: book.begin(make_decision(make_box())),
    'picked': lambda book: book.picked(),
    'releasing': lambda book: book.releasing(),
    'placed': lambda book: book.placed(),
    'verified': lambda book: book.verified(MEASURED, {}),
}

#: Where the box is after a crash behind each step: on the belt, put back there, or in the bin.
WHERE = {
    'planned': 'belt',
    'picked': 'returned',
    'releasing': 'bin',
    'placed': 'bin',
    'verified': 'bin',
}


def open_book(folder, *, count=2, now=lambda: 100.0):
    book = BinBook(Journal(folder, CONFIG), LDC, count, now)
    return book, book.recover()


def started(folder):
    book, _ = open_book(folder)
    book.settled({})
    return book


def crash(folder, to):
    """What a crash leaves: the files as they are, without anything that closing would do."""
    shutil.copytree(folder, to)
    (to / 'executor.lock').unlink()
    return to


@pytest.mark.parametrize('last', STEPS)
def test_after_a_crash_behind_each_step_the_box_is_where_it_was(tmp_path, last):
    book = started(tmp_path / 'run')
    for name, do in STEPS.items():
        do(book)
        if name == last:
            break
    again, recovery = open_book(crash(tmp_path / 'run', tmp_path / 'crashed'))
    ids = [placed.box.id for placed in again.state.bins[0].boxes]
    events = [event.event for event in again.events()]
    assert len(recovery.forgotten) == (WHERE[last] == 'belt')
    assert len(recovery.returned) == (WHERE[last] == 'returned')
    assert len(recovery.unmeasured) == (last in ('releasing', 'placed'))
    assert ids == (['box-1'] if WHERE[last] == 'bin' else [])
    assert (BoxEventKind.RETURNED in events) == (WHERE[last] == 'returned')
    assert again.attempt is None


@pytest.mark.parametrize('last', ['releasing', 'placed'])
def test_a_released_box_is_verified_once_it_is_measured_again(tmp_path, last):
    book = started(tmp_path / 'run')
    for name, do in STEPS.items():
        do(book)
        if name == last:
            break
    again, _ = open_book(crash(tmp_path / 'run', tmp_path / 'crashed'))
    target = make_decision(make_box()).target
    assert again.state.poses == {'box-1': target}
    again.settled({'box-1': MEASURED})
    content = again.state.bins[0]
    assert (content.revision, content.boxes[0].measured_mm) == (2, (151.0, 101.0, 75.0))
    assert again.events()[-1].event is BoxEventKind.PLACED
    third, recovery = open_book(crash(tmp_path / 'crashed', tmp_path / 'again'))
    assert recovery.unmeasured == ()
    assert third.state == again.state


def test_a_crash_during_recovery_is_recovered_from(tmp_path):
    book = started(tmp_path / 'run')
    for name in ('planned', 'picked', 'releasing'):
        STEPS[name](book)
    open_book(crash(tmp_path / 'run', tmp_path / 'a'))
    again, recovery = open_book(crash(tmp_path / 'a', tmp_path / 'b'))
    assert len(recovery.unmeasured) == 1
    again.settled({'box-1': MEASURED})
    assert [event.event.name for event in again.events()] == ['PICKED', 'PLACED']


@pytest.mark.parametrize('last', STEPS)
def test_a_killed_process_leaves_what_it_wrote(tmp_path, last):
    """The same with a real process that dies without a word."""
    code = (
        'import os, sys\n'
        f'sys.path.insert(0, {os.path.dirname(__file__)!r})\n'
        'from test_journal import STEPS, started\n'
        'book = started(sys.argv[1])\n'
        'for name, do in STEPS.items():\n'
        '    do(book)\n'
        '    if name == sys.argv[2]:\n'
        f'        os.kill(os.getpid(), {int(signal.SIGKILL)})\n'
    )
    ended = subprocess.run([sys.executable, '-c', code, str(tmp_path), last], timeout=20)
    assert ended.returncode == -signal.SIGKILL
    book, _ = open_book(tmp_path)
    boxes = [placed.box.id for placed in book.state.bins[0].boxes]
    assert boxes == (['box-1'] if WHERE[last] == 'bin' else [])


def test_revisions_serials_and_stamps_grow_over_restarts(tmp_path):
    book = started(tmp_path)
    for do in STEPS.values():
        do(book)
    book.swap('LDC-1', 2)
    before = book.state
    stamp = book.events()[-1].stamp_s
    book._journal.close()
    # The clock was set back meanwhile.
    again, _ = open_book(tmp_path, now=lambda: 5.0)
    again.settled({})
    assert again.state.revision > before.revision
    assert [bin_.id for bin_ in again.state.bins] == ['LDC-2', 'LDC-3']
    _, opened = again.swap('LDC-2', 0)
    assert opened.serial == 4
    again.begin(make_decision(make_box(2), bin_id='LDC-3', serial=3))
    assert again.picked().stamp_s > stamp


def test_recent_events_and_closed_bins_are_kept_with_their_stamps(tmp_path):
    clock = iter(range(100, 1000))
    book, _ = open_book(tmp_path, now=lambda: float(next(clock)))
    book.settled({})
    for do in STEPS.values():
        do(book)
    book.swap('LDC-1', 2)
    events = book.events()
    book._journal.close()
    again, _ = open_book(tmp_path, now=lambda: 5000.0)
    assert again.events() == events
    assert all(event.stamp_s < 1000 for event in events)
    ((closed, poses),) = again.closed()
    assert (closed.id, [placed.box.id for placed in closed.boxes]) == ('LDC-1', ['box-1'])
    assert poses == {'box-1': MEASURED}
    assert 'box-1' in again.ids_in_bins


def test_everything_about_a_box_comes_back():
    box = Box('ö "1"', (1.5, 2.25, 3.0), 0.1, (0.1, 0.2, -0.3), 16, 12.5, 'Oslo', (2.0, 1.5, 0.5))
    box = replace(box, extra=(('row', '7'),))
    placed = placed_of(replace(make_decision(make_box()), box=box))
    again = placed_from_json(placed_to_json(placed))
    assert again == placed
    assert again.box.extra == box.extra


def test_a_journal_of_release_0_1_is_read(tmp_path):
    """A cage with one box in it and one in the gripper, as that release left it."""
    with sqlite3.connect(tmp_path / 'executor.sqlite') as db:
        db.executescript((DATA / 'journal_of_0_1.sql').read_text(encoding='utf-8'))
    db.close()
    then = replace(CELL, clearance_mm=4.0)
    journal = Journal(tmp_path, configuration(parse_bin('RC'), then))
    [cage] = journal.open_bins()
    assert cage.spec == parse_bin('RC')
    [placed] = cage.boxes
    assert placed.box == Box(
        'ö "1"', (300.5, 200.25, 100.0), 2.5, (0.1, 0.2, -0.3), 16, 12.5, 'Oslo', (2.0, 1.5, 0.5)
    )
    assert placed.box.extra == (('row', '7'),)
    assert (placed.orientation, placed.size_mm) == ('yxz', (210, 310, 100))
    assert placed.measured_mm == (103.0, 152.0, 50.1)
    [held] = journal.pending()
    assert (held.placed.box.id, held.step) == ('box-2', Step.PICKED)
    assert held.target.position == (0.15, 0.41, 0.075)
    journal.close()


def test_a_journal_with_a_damaged_record_says_which_and_what_to_do(tmp_path):
    book = started(tmp_path)
    STEPS['planned'](book)
    book._journal._db.execute("UPDATE attempt SET placed = '{}'")
    book._journal.close()
    journal = Journal(tmp_path, CONFIG)
    with pytest.raises(JournalError, match=r'cannot read placement 1 .* lacks box.* move the file'):
        journal.pending()
    journal.close()


def test_a_journal_of_another_bin_is_refused_and_kept(tmp_path):
    started(tmp_path)._journal.close()
    content = (tmp_path / 'executor.sqlite').read_bytes()
    with pytest.raises(JournalError, match=r"bin_type is 'LDC' there and 'EQ' here"):
        Journal(tmp_path, configuration(parse_bin('EQ'), CELL))
    assert (tmp_path / 'executor.sqlite').read_bytes() == content


@pytest.mark.parametrize('kind', ['RC', 'PAL', '120x80x150:pallet', '120x80x150:cage', 'RC:box'])
def test_the_walls_of_a_bin_survive_a_restart(tmp_path, kind):
    spec = parse_bin(kind)
    config = configuration(spec, CELL)
    book = BinBook(Journal(tmp_path, config), spec, 1, lambda: 100.0)
    book.recover()
    book.settled({})
    book._journal.close()
    journal = Journal(tmp_path, config)
    assert [standing.spec for standing in journal.open_bins()] == [spec]
    journal.close()


def test_a_journal_of_a_bin_with_other_walls_is_refused(tmp_path):
    Journal(tmp_path, configuration(parse_bin('120x80x150'), CELL)).close()
    with pytest.raises(
        JournalError, match=r"bin_type is '120x80x150' there and '120x80x150:cage' here"
    ):
        Journal(tmp_path, configuration(parse_bin('120x80x150:cage'), CELL))


def test_a_journal_of_another_profile_is_refused(tmp_path):
    started(tmp_path)._journal.close()
    with pytest.raises(JournalError, match=r"profile.name is 'cell' there and 'paper' here"):
        Journal(tmp_path, configuration(LDC, PROFILES['paper']))


def test_a_journal_in_use_is_refused(tmp_path):
    journal = Journal(tmp_path, CONFIG)
    with pytest.raises(JournalError, match='another executor'):
        Journal(tmp_path, CONFIG)
    journal.close()
    Journal(tmp_path, CONFIG).close()


def test_a_journal_of_another_version_is_refused(tmp_path):
    Journal(tmp_path, CONFIG).close()
    db = sqlite3.connect(tmp_path / 'executor.sqlite')
    db.execute('PRAGMA user_version = 99')
    db.close()
    with pytest.raises(JournalError, match='schema version 99'):
        Journal(tmp_path, CONFIG)


def test_a_file_that_is_no_journal_is_refused(tmp_path):
    (tmp_path / 'executor.sqlite').write_text('this is not a database, whatever its name says')
    with pytest.raises(JournalError, match='cannot use journal'):
        Journal(tmp_path, CONFIG)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(JournalError, match='cannot create state_dir'):
        Journal(tmp_path / 'file' / 'state', CONFIG)


def test_every_commit_waits_for_the_disk(tmp_path):
    journal = Journal(tmp_path, CONFIG)
    full = 2
    assert journal._db.execute('PRAGMA synchronous').fetchone()[0] == full
    assert journal._db.execute('PRAGMA journal_mode').fetchone()[0] == 'wal'
    journal.close()


def test_the_steps_of_every_box_are_on_record(tmp_path):
    book = started(tmp_path)
    for do in STEPS.values():
        do(book)
    rows = book._journal._db.execute('SELECT step FROM step ORDER BY rowid').fetchall()
    assert [row[0] for row in rows] == list(STEPS)


def test_a_returned_box_may_be_placed_again(tmp_path):
    book = started(tmp_path)
    STEPS['planned'](book)
    STEPS['picked'](book)
    event = book.returned(Reason.OPERATOR, 'canceled')
    assert (event.event, event.reason) == (BoxEventKind.RETURNED, Reason.OPERATOR)
    for do in STEPS.values():
        do(book)
    assert [placed.box.id for placed in book.state.bins[0].boxes] == ['box-1']
