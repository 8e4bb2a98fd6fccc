"""The books of the conveyor and what the topics showed must agree about every box."""

from dataclasses import replace

from conveyor_sim.ledger.ledger import BoxRecord, Ledger, Whereabouts
from pack_cell.report.accounts import (
    BoxAccounts,
    account_text,
    accounts,
    disagreements,
    read_books,
    waits,
    waits_text,
)
from pack_cell.report.record import RunRecord
from pack_cell.report.summary import is_clean
from pack_cell.running.memory import MemoryWatch, resident_mb
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('a', (300.0, 200.0, 100.0), 2.0)
PLACED = PlacedBox(BOX, (0, 0, 0), (300, 200, 100))
BIN = Bin('LDC-1', 1, parse_bin('LDC'), (PLACED,))
BOOKS = BoxAccounts(
    {'a': 'placed', 'b': 'rejected', 'c': 'on_belt', 'd': 'unseen', 'e': 'picked', 'f': 'rejected'},
    {'b': Reason.NO_READ, 'f': Reason.FAULT},
    {'longest_wait_s': 12.5, 'most_laps': 3},
)


def shown(supplied=6):
    record = RunRecord()
    boxes = tuple(ScannedBox(replace(BOX, id=name), Pose()) for name in 'c')
    record.on_scan(Scan(1, 1.0, boxes, supplied=supplied, remaining=3))
    record.on_bins(BinSnapshot(1, 1.0, (BIN,)))
    return record


def test_every_box_that_was_fed_is_counted_once():
    counts = accounts(BOOKS, shown())
    assert counts == {
        'fed': 6,
        'placed': 1,
        'rejected': {'no_read': 1, 'fault': 1},
        'on_belt': 2,
        'in_gripper': 1,
        'lost': 0,
        'unknown': 0,
        'sum_is_right': True,
    }
    assert not accounts(BOOKS, shown(supplied=7))['sum_is_right']
    assert waits(BOOKS)['longest_wait_s'] == 12.5


def test_the_books_are_two_lines_for_people():
    assert account_text(accounts(BOOKS, shown())) == (
        'all of 6 fed: 2 on the belt, 1 in the gripper, 0 lost, 0 unknown; '
        'rejected: 1 no_read, 1 fault'
    )
    assert account_text(accounts(BOOKS, shown(supplied=7))).startswith('NOT all of 6 fed')
    assert account_text(None) == ''
    assert waits_text(waits(BOOKS)) == '12 s, 3 laps'


def test_a_box_of_which_ledger_and_bins_say_different_things_is_named():
    assert disagreements(BOOKS, shown()) == []
    other = BoxAccounts({**BOOKS.places, 'a': 'on_belt', 'c': 'placed'}, BOOKS.reasons, {})
    lines = disagreements(other, shown())
    assert len(lines) == 2
    assert "box 'a' is in a bin" in lines[0] and "box 'c' is placed by the ledger" in lines[1]


def test_the_ledger_may_not_have_heard_that_the_last_box_was_placed():
    late = BoxAccounts({**BOOKS.places, 'a': 'picked'}, BOOKS.reasons, {})
    assert disagreements(late, shown()) == []
    assert accounts(late, shown())['placed'] == 1


def test_the_ledger_of_a_conveyor_is_read_as_it_was_written(tmp_path):
    assert read_books(tmp_path) is None
    written = Ledger(tmp_path, 'stream', 'of a test')
    records = [
        BoxRecord(0, 'a', Whereabouts.PLACED),
        BoxRecord(1, 'b', Whereabouts.REJECTED, reason=Reason.NO_READ, text='not read'),
    ]
    written.save(records, {'statistics': '{"longest_wait_s": 4.0}'})
    written.close()
    books = read_books(tmp_path)
    assert books == BoxAccounts(
        {'a': 'placed', 'b': 'rejected'}, {'b': Reason.NO_READ}, {'longest_wait_s': 4.0}
    )


def test_a_run_in_which_a_box_is_missing_is_not_clean():
    good = {'lost': 0, 'unaccounted': 0, 'rule_violations': 0, 'accounts': None}
    assert is_clean(good)
    assert is_clean(good | {'accounts': {'sum_is_right': True, 'unknown': 0}})
    for bad in (
        {'lost': 1},
        {'accounts': {'sum_is_right': False, 'unknown': 0}},
        {'accounts': {'sum_is_right': True, 'unknown': 1}},
    ):
        assert not is_clean(good | bad)


def test_fill_counts_true_sizes_and_a_second_scan_replaces_the_first():
    record = shown()
    true = replace(BOX, size_mm=(310.0, 200.0, 100.0))
    record.on_truth(Scan(0, 1.0, (ScannedBox(true, Pose()),)))
    true_bin = record.true_bin(BIN)
    assert true_bin.boxes[0].box.size_mm == true.size_mm
    assert true_bin.boxes[0].size_mm == PLACED.size_mm
    again = replace(BOX, id='c', size_mm=(1.0, 2.0, 3.0))
    record.on_scan(Scan(2, 2.0, (ScannedBox(again, Pose()),)))
    assert record.boxes['c'] == again


def test_events_are_counted_by_what_happened_last():
    record = RunRecord()
    for stamp, kind in enumerate((BoxEventKind.PICKED, BoxEventKind.UNKNOWN, BoxEventKind.PLACED)):
        record.on_event(BoxEvent('a', kind, stamp_s=stamp + 1.0))
        assert [counted for counted in BoxEventKind if record.count(counted)] == [kind]
        assert record.unknown() == (kind is BoxEventKind.UNKNOWN)
    record.on_event(BoxEvent('a', BoxEventKind.LOST, stamp_s=0.5))
    assert record.settled == record.count(BoxEventKind.PLACED) == 1


def test_a_box_that_the_arm_placed_before_it_was_rejected_is_placed():
    record = RunRecord()
    assert record.on_event(BoxEvent('a', BoxEventKind.PLACED, stamp_s=1.0))
    assert not record.on_event(BoxEvent('a', BoxEventKind.REJECTED, stamp_s=1.1))
    assert record.count(BoxEventKind.PLACED) == 1


def test_memory_is_measured_at_a_tenth_and_at_the_end():
    watch = MemoryWatch()
    watch.measure({}, 0.05)
    assert watch.summary()['cell']['at_10_percent'] is None
    watch.measure({}, 0.2)
    watch.measure({'gone': 2**22 - 1}, 1.0)
    summary = watch.summary()
    assert set(summary) == {'cell'}
    assert summary['cell']['at_10_percent'] > 1.0 and summary['cell']['at_end'] > 1.0
    assert resident_mb(2**22 - 1) is None
