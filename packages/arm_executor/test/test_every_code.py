"""Each code of a goal: provoked here, and its message names the value that people look for.

In physics the codes of motion are provoked by test_faults_physics, test_arm_recovers, test_stops.
"""

from __future__ import annotations

import re
import time
from dataclasses import replace
from pathlib import Path

import pytest
from executor_cases import make_box, make_decision, make_goal, make_scan
from test_stops import Stuck, begin, ended, tick_until, wait_phase

from arm_executor.arms.timed import TimedArm
from arm_executor.arms.true_boxes import TrueBox, Truth
from arm_executor.goals.outputs import Finished
from arm_executor.model.layout import Layout
from pack_msgs_py.alarms import TROUBLES
from pack_msgs_py.codes import ErrorCode, Phase, Reason

BOX, NEXT = make_box(1), make_box(2)
PAGE = Path(__file__).resolve().parents[3] / 'docs' / 'operations.md'


def submitted(bench, decision=None, *, box=BOX, in_s=60.0, shown=None):
    """The report of a goal for ``box``, with ``shown`` on the belt."""
    count = len(bench.of(Finished))
    shown = [box] if shown is None else shown
    bench.core.on_scan(make_scan(*shown, stamp_s=time.time(), presented=box.id))
    bench.core.submit(make_goal(decision or make_decision(box), deadline_s=time.time() + in_s))
    bench.wait(lambda: len(bench.of(Finished)) > count)
    return bench.of(Finished)[-1].report


def with_fault(code, **settings):
    def provoke(make):
        return make(faults={BOX.id: code}, **settings).place(BOX)

    return provoke


def with_fault_of_next(code):
    def provoke(make):
        bench = make(faults={NEXT.id: code})
        bench.place(BOX)
        return bench.place(NEXT, (300, 0, 0), revision=2)

    return provoke


def unknown_bin(make):
    return submitted(make(), make_decision(BOX, bin_id='LDC-9'))


def old_revision(make):
    return submitted(make(), make_decision(BOX, revision=7))


def second_goal(make):
    bench = make(arm=TimedArm(speed=1.0))
    begin(bench)
    wait_phase(bench, Phase.APPROACHING)
    return submitted(bench, box=NEXT, shown=[BOX, NEXT])


def while_paused(make):
    bench = make()
    bench.core.panel.request('PAUSE', '', 'anna', '', (True, ''))
    return bench.place(BOX)


def placed_twice(make):
    bench = make()
    bench.place(BOX)
    return bench.place(BOX, (300, 0, 0), revision=2)


def not_on_belt(make):
    return submitted(make(), shown=[NEXT])


def in_another_box(make):
    bench = make()
    bench.place(BOX)
    return bench.place(NEXT, revision=2)


def too_late(make):
    return submitted(make(), in_s=-5.0)


def too_slow(make):
    return submitted(make(), in_s=0.5)


def not_presented(make):
    bench = make(present_timeout_s=0.2)
    begin(bench, presented='')
    return ended(bench)


def lighter_than_scanned(make):
    truth = Truth()
    bench = make(arm=TimedArm(Layout(), speed=0.0, truth=truth))
    pick = make_scan(BOX, stamp_s=0.0, presented=BOX.id).boxes[0].pose
    truth.update([TrueBox(replace(BOX, weight_kg=1.25), pick)])
    return bench.place(BOX)


def without_progress(make):
    bench = make(arm=Stuck(), watchdog_s=0.2)
    begin(bench)
    tick_until(bench, lambda: bench.of(Finished))
    return ended(bench)


def canceled(make):
    bench = make(arm=TimedArm(speed=1.0))
    begin(bench)
    wait_phase(bench, Phase.TRANSFERRING)
    bench.core.cancel(make_goal(make_decision(BOX)).goal_id)
    return ended(bench)


def stopped(make):
    bench = make(arm=TimedArm(speed=1.0))
    begin(bench)
    wait_phase(bench, Phase.TRANSFERRING)
    bench.core.protective_stop('stopped by anna')
    return ended(bench)


#: How each code is provoked, and what its message says.
PROVOKED = {
    ErrorCode.INVALID_GOAL: (unknown_bin, "no open bin 'LDC-9'; open are LDC-1, LDC-2"),
    ErrorCode.STALE_BIN_REVISION: (old_revision, 'is at revision 1, the goal quotes 7'),
    ErrorCode.BUSY: (second_goal, "box 'box-1' is being handled"),
    ErrorCode.NOT_ACTIVE: (while_paused, 'mode PAUSED'),
    ErrorCode.DUPLICATE_BOX: (placed_twice, "box 'box-1' is already in bin 'LDC-1'"),
    ErrorCode.BOX_NOT_ON_BELT: (not_on_belt, "'box-1' is not in scan 1, which holds box-2"),
    ErrorCode.RULE_VIOLATION: (in_another_box, "'box-2' breaks no_overlap"),
    ErrorCode.STALE_GOAL: (too_late, r'passed 5\.\d\d s before'),
    ErrorCode.DEADLINE_UNREACHABLE: (too_slow, r'needs \d\.\d\d s, the deadline leaves 0\.\d\d s'),
    ErrorCode.NO_IK_SOLUTION: (with_fault(ErrorCode.NO_IK_SOLUTION), "'box-1'"),
    ErrorCode.START_STATE_INVALID: (with_fault(ErrorCode.START_STATE_INVALID), "'box-1'"),
    ErrorCode.PATH_IN_COLLISION: (with_fault(ErrorCode.PATH_IN_COLLISION), "'box-1'"),
    ErrorCode.LIMITS_EXCEEDED: (with_fault(ErrorCode.LIMITS_EXCEEDED), "'box-1'"),
    ErrorCode.BOX_NOT_PRESENTED: (not_presented, r"'box-1' did not come .* within 0\.2 s"),
    ErrorCode.GRASP_FAILED: (with_fault(ErrorCode.GRASP_FAILED), "no vacuum on box 'box-1'"),
    ErrorCode.BOX_LOST: (with_fault(ErrorCode.BOX_LOST), "'box-1'"),
    ErrorCode.PATH_TOLERANCE_VIOLATED: (with_fault(ErrorCode.PATH_TOLERANCE_VIOLATED), "'box-1'"),
    ErrorCode.PLACED_OUT_OF_TOLERANCE: (
        with_fault(ErrorCode.PLACED_OUT_OF_TOLERANCE),
        r"'box-1'.* 20\.0 mm",
    ),
    ErrorCode.DEADLINE_MISSED: (
        with_fault(ErrorCode.DEADLINE_MISSED),
        r"'box-1'.* \d+\.\d\d s late",
    ),
    ErrorCode.OTHERS_DISTURBED: (
        with_fault_of_next(ErrorCode.OTHERS_DISTURBED),
        r"'box-2'.* 20\.0 mm",
    ),
    ErrorCode.BOX_MISMATCH: (lighter_than_scanned, r'1\.25 kg'),
    ErrorCode.COLLISION: (with_fault(ErrorCode.COLLISION), "'box-1'"),
    ErrorCode.MOTION_OVERDUE: (without_progress, r'no progress for 0\.2 s, 0\.2 s are allowed'),
    ErrorCode.CANCELED: (canceled, 'stopped while transferring'),
    ErrorCode.PROTECTIVE_STOP: (stopped, 'stopped by anna'),
    ErrorCode.UNKNOWN: (with_fault(ErrorCode.UNKNOWN), "RuntimeError: box 'box-1'"),
}


def test_every_code_is_provoked():
    assert set(PROVOKED) == set(ErrorCode) - {ErrorCode.NONE}


@pytest.mark.parametrize('code', PROVOKED, ids=lambda code: code.name)
def test_a_goal_that_ends_with_a_code_says_why_with_the_value(make_core_bench, code):
    provoke, said = PROVOKED[code]
    report = provoke(make_core_bench)
    assert report.code is code, report.message
    assert re.search(said, report.message), report.message


REASONS = [reason.name for reason in Reason if reason is not Reason.NONE]


@pytest.mark.parametrize('code', [*(code.name for code in PROVOKED), *TROUBLES, *REASONS])
def test_every_code_has_a_line_of_its_own_in_the_page_for_operators(code):
    lines = [line for line in PAGE.read_text().splitlines() if line.startswith(f'| `{code}` |')]
    assert lines, code
    for line in lines:
        cells = [cell.strip() for cell in line.strip('|').split('|')]
        # The code, maybe its kind, what it means, what the cell does, what a person does.
        assert 4 <= len(cells) <= 5 and all(cells), line


@pytest.mark.parametrize('code', TROUBLES)
def test_the_page_calls_it_an_alarm_or_a_warning_as_the_cell_does(code):
    word = TROUBLES[code].severity.name.lower()
    lines = [
        line
        for line in PAGE.read_text().splitlines()
        if line.startswith('| ') and f'`{code}`' in line.split('|')[1]
    ]
    assert any(f'| {word} |' in line for line in lines), (code, word)
