"""What a run prints as it happens, and in which order."""

from dataclasses import replace

import pytest

from pack_cell.report.record import RunRecord
from pack_cell.running.display import RunDisplay
from pack_msgs_py.cell_values import Decision, Report
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('a', (596.0, 396.0, 200.0), 5.0)
PLACED = PlacedBox(BOX, (0, 0, 0), (600, 400, 200), 'xyz', (300.0, 200.0, 100.0))
CLOSED = Bin('LDC-1', 1, parse_bin('LDC'), (PLACED,), 'A', 1)
REPORT = Report('a', 'LDC-1', 1, 0, motion_s=4.0, slack_s=1.4, goal_id=b'1' * 16)


def close(record, display):
    record.on_closed(CLOSED)
    display.on_change('closed', CLOSED)


def report(record, display):
    record.on_report(REPORT)
    display.on_change('report', REPORT)


def printed(capsys, *steps, decided=True):
    record = RunRecord()
    if decided:
        record.on_decision(Decision(BOX, 'LDC-1', 1, 0, 'xyz', stamp_s=2.0))
    with RunDisplay(record) as display:
        for step in steps:
            step(record, display)
        before_the_end = capsys.readouterr().out
    lines = (before_the_end + capsys.readouterr().out).splitlines()
    return before_the_end, ['closed' if 'closed' in line else line.split()[1] for line in lines]


@pytest.mark.parametrize('steps', [(report, close), (close, report)])
def test_a_bin_is_told_closed_after_the_last_box_that_went_into_it(capsys, steps):
    before_the_end, order = printed(capsys, *steps)
    assert order == ['a', 'closed']
    assert 'bin LDC-1 closed: 1 boxes, 6.1 % full' in before_the_end


def test_a_bin_with_boxes_of_an_earlier_run_is_told_closed_at_once(capsys):
    before_the_end, _ = printed(capsys, close, decided=False)
    assert 'bin LDC-1 closed' in before_the_end


def test_a_bin_whose_report_never_comes_is_told_closed_at_the_end(capsys):
    before_the_end, order = printed(capsys, close)
    assert not before_the_end
    assert order == ['closed']


def test_a_box_that_was_refused_first_is_awaited_until_it_is_placed(capsys):
    def refuse(record, display):
        refused = replace(REPORT, code=ErrorCode.BUSY, goal_id=b'2' * 16)
        record.on_report(refused)
        display.on_change('report', refused)

    _, order = printed(capsys, refuse, close, report)
    assert order[-2:] == ['a', 'closed']
