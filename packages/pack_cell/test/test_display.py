"""What a run prints as it happens, and in which order."""

import os
import subprocess
import sys
from dataclasses import replace

import pytest

from pack_cell.report.record import RunRecord
from pack_cell.running.display import RunDisplay
from pack_msgs_py.cell_values import BoxEvent, Decision, Report
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Reason
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
    assert 'bin LDC-1 closed: 1 box, 6.1 % full' in before_the_end


def say_why(record, display):
    reason = ClosingReason('LDC-1', {Cause.TOO_HIGH: 3, Cause.NO_SUPPORT: 1})
    record.on_closing(reason)
    display.on_change('closing', reason)


def test_a_bin_is_told_closed_with_the_reason_for_it(capsys):
    before_the_end, order = printed(capsys, report, say_why, close)
    assert order == ['a', 'closed']
    assert '% full; nothing fits: 3 of 4 boxes too high, 1 without support' in before_the_end


def test_a_reason_that_comes_after_its_bin_is_told_on_a_line_of_its_own(capsys):
    before_the_end, order = printed(capsys, report, close, say_why, say_why)
    assert order == ['a', 'closed', 'closed']
    assert 'bin LDC-1 closed: nothing fits: 3 of 4 boxes too high' in before_the_end


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


@pytest.mark.parametrize(
    'name', ['box[1]', '[red]A', 'KARTON[/2]', 'lot:key:12', '[link=x]', '\\[b]']
)
def test_names_are_printed_as_they_are(capsys, name):
    box = replace(BOX, id=name)
    record = RunRecord()
    record.on_decision(Decision(box, 'LDC-1', 1, 0, 'xyz', stamp_s=2.0))
    placed = replace(REPORT, box_id=name)
    refused = replace(placed, code=ErrorCode.BUSY, goal_id=b'2' * 16, message=name)
    with RunDisplay(record) as display:
        for told in (refused, placed):
            record.on_report(told)
            display.on_change('report', told)
        for kind in (BoxEventKind.REJECTED, BoxEventKind.LOST):
            display.on_change('event', BoxEvent(name, kind, Reason.OVERSIZE, name))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4
    assert all(line.split()[0] == name or line.split()[1] == name for line in lines)
    assert all(line.endswith(name) for line in (lines[0], *lines[2:]))


def run_display(stdout, **environment):
    """A run of three boxes is displayed by a process of its own; its exit code and errors."""
    program = (
        'from pack_cell.running.display import RunDisplay\n'
        'from pack_cell.report.record import RunRecord\n'
        'display = RunDisplay(RunRecord())\n'
        'for number in range(3): display.say(f"K\\u00e4se \\u4e2d {number}")\n'
        'display.console.problem("the end")\n'
    )
    return subprocess.run(
        [sys.executable, '-c', program], stdout=stdout, stderr=subprocess.PIPE, check=False,
        env=os.environ | environment, text=True,
    )  # fmt: skip


def test_a_terminal_that_knows_ascii_alone_is_told_in_escapes():
    done = run_display(subprocess.PIPE, PYTHONIOENCODING='ascii')
    assert (done.returncode, done.stderr) == (0, 'the end\n')
    assert done.stdout.splitlines()[0] == r'K\xe4se \u4e2d 0'


def test_a_closed_pipe_ends_the_printing_and_nothing_else():
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, 'wb') as closed:
        done = run_display(closed)
    assert (done.returncode, done.stderr) == (0, 'the end\n')


def test_a_full_disk_ends_the_printing_and_nothing_else():
    with open('/dev/full', 'wb') as full:
        done = run_display(full)
    assert (done.returncode, done.stderr) == (0, 'the end\n')
