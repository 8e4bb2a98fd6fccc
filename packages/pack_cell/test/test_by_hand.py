"""What people do to a running cell by hand is counted, and is no disagreement of the books."""

from dataclasses import replace

from pack_cell.options.run_options import parse_run_options
from pack_cell.report.accounts import BoxAccounts, disagreements
from pack_cell.report.ended_run import EndedRun
from pack_cell.report.record import RunRecord
from pack_cell.report.summary import is_clean, summarize
from pack_cell.running.display import RunDisplay
from pack_msgs_py.alarms import raised
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Report, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, Condition, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX, FOREIGN = (Box(name, (300.0, 200.0, 100.0), 2.0) for name in ('a', 'mine'))
BIN = Bin('LDC-1', 1, parse_bin('LDC'), (), 'A', 1)
PAUSED = CellState(Condition.PAUSED, 'PAUSED by anna', 'To go on: cell resume')
RUNNING = CellState(Condition.RUNNING, 'RUNNING: the arm is idle.')


def at(box, x=0):
    return PlacedBox(box, (x, 0, 300), (300, 200, 100), 'xyz', (x + 150.0, 100.0, 350.0))


def scan(*boxes, supplied=1, remaining=0):
    items = tuple(ScannedBox(box, Pose()) for box in boxes)
    return Scan(1, 1.0, items, supplied=supplied, remaining=remaining)


def placed_by_hand():
    """Box `a` of the stream is placed by the arm, `mine` by a person, high in the air."""
    record = RunRecord()
    record.on_scan(scan(BOX))
    record.on_event(BoxEvent('a', BoxEventKind.PLACED, bin_id='LDC-1', stamp_s=2.0))
    record.on_report(Report('a', 'LDC-1', goal_id=b'1' * 16))
    record.on_event(
        BoxEvent('mine', BoxEventKind.PLACED, Reason.OPERATOR, bin_id='LDC-1', stamp_s=3.0)
    )
    standing = replace(BIN, boxes=(at(BOX, 400), at(FOREIGN)))
    record.on_bins(BinSnapshot(1, 3.0, (standing,)))
    record.on_scan(scan())
    return record


def summary_of(record):
    books = BoxAccounts({'a': 'placed'}, {}, {})
    return summarize(
        EndedRun(record, parse_run_options([]), ['cell', 'run'], 1.0, 0.5, books=books)
    )


def test_a_box_of_no_stream_is_counted_and_the_rules_are_not_judged_in_its_bin():
    record = placed_by_hand()
    summary = summary_of(record)
    assert (summary['placed'], summary['by_hand'], summary['rule_violations']) == (2, 1, 0)
    assert record.complete() and record.all_reported() and is_clean(summary)
    assert disagreements(BoxAccounts({'a': 'placed'}, {}, {}), record) == []


def test_a_box_of_no_stream_does_not_end_a_run_while_the_arm_has_another():
    record = placed_by_hand()
    record.on_scan(scan(supplied=2))
    record.on_event(BoxEvent('b', BoxEventKind.PICKED, stamp_s=4.0))
    assert not record.complete() and not record.drained()


def test_a_box_that_was_taken_out_of_its_bin_is_rejected():
    record = placed_by_hand()
    record.on_event(
        BoxEvent('a', BoxEventKind.REJECTED, Reason.OPERATOR, bin_id='LDC-1', stamp_s=4.0)
    )
    record.on_bins(BinSnapshot(2, 4.0, (replace(BIN, boxes=(at(FOREIGN),)),)))
    assert record.places()['a'] == ['rejected']
    assert record.complete()


def test_the_reject_lane_still_does_not_take_what_the_arm_has_placed():
    record = placed_by_hand()
    late = BoxEvent('a', BoxEventKind.REJECTED, Reason.OPERATOR, stamp_s=4.0)
    assert not record.on_event(late)


def test_a_pause_is_told_once_with_what_to_do_and_so_is_its_end(capsys):
    with RunDisplay(RunRecord()) as display:
        for state in (RUNNING, PAUSED, PAUSED, RUNNING, RUNNING):
            display.on_state(state)
    assert [line.strip() for line in capsys.readouterr().out.splitlines()] == [
        'PAUSED by anna. To go on: cell resume',
        'RUNNING: the arm is idle',
    ]


def test_a_warning_is_told_once(capsys):
    warning = raised('GRASP_FAILED', 'no vacuum on 7', 1.0, box_id='7')
    with RunDisplay(RunRecord()) as display:
        for _ in range(3):
            display.on_state(replace(RUNNING, alarms=(warning,)))
    [line] = capsys.readouterr().out.splitlines()
    assert 'warning GRASP_FAILED: no vacuum on 7' in line
