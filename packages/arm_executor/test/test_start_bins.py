"""Bins that are part-filled at the start: of an earlier run or a file, and only what can go on."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from executor_cases import CELL, LDC, make_box, make_decision

from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import configuration
from arm_executor.bins.start_bins import (
    StartBinsError,
    check_start_bins,
    read_start_bins,
    renamed,
    write_start_bins,
)
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import parse_bin

MEASURED = Pose((0.151, 0.101, 0.075), (0.0, 0.0, 0.0, 1.0))


@pytest.fixture
def earlier(tmp_path):
    """The folder of a run with box-1 in bin LDC-1 and box-2 in the gripper."""
    journal = Journal(tmp_path / 'earlier' / 'state', configuration(LDC, CELL))
    book = BinBook(journal, LDC, 2, lambda: 100.0, ('Oslo',))
    book.recover()
    book.settled({})
    book.begin(make_decision(replace(make_box(), destination='Oslo')))
    book.picked()
    book.releasing()
    book.placed()
    book.verified(MEASURED, {})
    book.begin(make_decision(make_box(2), corner_mm=(400, 0, 0), revision=2))
    book.picked()
    journal.close()
    return tmp_path / 'earlier'


def fresh_book(folder):
    journal = Journal(folder, configuration(LDC, CELL))
    return BinBook(journal, LDC, 2, lambda: 200.0)


def test_the_open_bins_of_a_run_stand_in_the_cell_with_what_was_measured(earlier, tmp_path):
    book = fresh_book(tmp_path / 'new')
    book.begin_with(read_start_bins(earlier))
    book.recover()
    first, second = book.state.bins
    assert (first.station, first.destination, second.station) == ('A', 'Oslo', 'B')
    assert [placed.box.id for placed in first.boxes] == ['box-1']
    assert book.state.poses == {'box-1': MEASURED}
    assert book.ids_in_bins == {'box-1'}
    assert book.events() == ()


def test_a_journal_that_has_bins_keeps_them(earlier, tmp_path):
    book = fresh_book(tmp_path / 'new')
    book.recover()
    book.begin_with(read_start_bins(earlier))
    assert book.state.bins[0].boxes == ()
    assert book.ids_in_bins == set()


def test_bins_survive_being_written_to_a_file(earlier, tmp_path):
    start = read_start_bins(earlier)
    path = tmp_path / 'bins.json'
    write_start_bins(path, start)
    again = read_start_bins(path)
    assert [first.poses for first in again] == [first.poses for first in start]
    for one, other in zip(again, start, strict=True):
        assert [placed.box for placed in one.bin.boxes] == [p.box for p in other.bin.boxes]
        assert (one.bin.station, one.bin.spec) == (other.bin.station, other.bin.spec)


def test_a_name_that_is_taken_is_changed_in_bin_and_poses(earlier):
    first, _ = renamed(read_start_bins(earlier), {'box-1', 'box-1@start'}.__contains__)
    assert [placed.box.id for placed in first.bin.boxes] == ['box-1@start@start']
    assert first.poses == {'box-1@start@start': MEASURED}


@pytest.mark.parametrize(
    ('kind', 'count', 'profile', 'text'),
    [
        ('EQ', 2, CELL, 'is of kind LDC, here are EQ'),
        ('LDC', 1, CELL, 'LDC-2 to begin with stands at B; of 1 bins none'),
    ],
)
def test_bins_that_do_not_belong_here_are_refused_by_name(earlier, kind, count, profile, text):
    with pytest.raises(StartBinsError, match=text):
        check_start_bins(read_start_bins(earlier), parse_bin(kind), count, profile)


def test_boxes_that_break_a_rule_are_refused(earlier, tmp_path):
    path = tmp_path / 'bins.json'
    write_start_bins(path, read_start_bins(earlier))
    data = json.loads(path.read_text())
    data['placements'][0]['corner_mm'][2] = 100
    path.write_text(json.dumps(data))
    with pytest.raises(StartBinsError, match=r"LDC-1 .* other rules: .*'box-1' breaks (?!dest)"):
        check_start_bins(read_start_bins(path), LDC, 2, CELL)


@pytest.mark.parametrize(
    'content', ['{', '[]', '{"format": 9}', '{"format": 1}', '{"format": 1, "bins": [{}]}']
)
def test_a_file_that_holds_no_bins_is_refused_by_its_name(tmp_path, content):
    path = tmp_path / 'bins.json'
    path.write_text(content)
    with pytest.raises(StartBinsError, match=r'bins\.json'):
        read_start_bins(path)
    with pytest.raises(StartBinsError, match='no run, and no file'):
        read_start_bins(tmp_path)
