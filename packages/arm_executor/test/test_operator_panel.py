"""Alarms stop the arm until somebody has looked, warnings do not; pauses and alarms outlive it."""

from __future__ import annotations

import pytest
from executor_cases import make_box

from arm_executor.bins.operation_log import OperationLog
from arm_executor.goals.outputs import AlarmsChanged
from pack_msgs_py.alarms import TROUBLES, Alarm
from pack_msgs_py.codes import ErrorCode, Mode, Severity

BOX, NEXT = make_box(1), make_box(2)
ALARMS = [name for name, trouble in TROUBLES.items() if trouble.severity is Severity.ALARM]


def log_of(bench):
    return OperationLog(bench.journal, bench.book.lock)


@pytest.mark.parametrize('code', [ErrorCode.BOX_LOST, ErrorCode.COLLISION])
def test_after_an_alarm_the_arm_takes_no_goal_until_it_is_acknowledged(make_core_bench, code):
    bench = make_core_bench(faults={BOX.id: code})
    report = bench.place(BOX)
    assert report.code is code
    status = bench.core.status()
    assert status.mode is Mode.ALARM
    assert status.message.startswith(f'{code.name}: {report.message}')
    assert 'cell ack' in status.message
    revision = bench.book.state.bins[0].revision
    refused = bench.place(NEXT, revision=revision)
    assert refused.code is ErrorCode.NOT_ACTIVE and 'ALARM' in refused.message
    assert bench.core.panel.acknowledge() == (True, f'acknowledged: {code.name}')
    assert bench.place(NEXT, revision=revision).code is ErrorCode.NONE
    assert bench.of(AlarmsChanged)[-1].alarms == ()


@pytest.mark.parametrize('code', [ErrorCode.GRASP_FAILED, ErrorCode.PATH_TOLERANCE_VIOLATED])
def test_a_warning_is_shown_with_box_and_bin_and_the_arm_goes_on(make_core_bench, code):
    bench = make_core_bench(faults={BOX.id: code})
    report = bench.place(BOX)
    (warning,) = bench.core.panel.standing
    assert (warning.code, warning.message, warning.severity) == (
        code.name,
        report.message,
        Severity.WARNING,
    )
    assert (warning.box_id, warning.bin_id) == (BOX.id, 'LDC-1')
    assert bench.place(NEXT).code is ErrorCode.NONE


def test_where_nobody_stands_by_an_alarm_is_shown_and_the_arm_goes_on(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.BOX_LOST}, acknowledges_itself=True)
    bench.place(BOX)
    assert [alarm.severity for alarm in bench.core.panel.standing] == [Severity.WARNING]
    revision = bench.book.state.bins[0].revision
    assert bench.place(NEXT, revision=revision).code is ErrorCode.NONE


def test_an_alarm_of_another_node_stops_the_arm_until_it_is_gone_there(make_core_bench):
    bench = make_core_bench()
    jam = Alarm('JAM', 'the belt stands for 12 s', action='Clear the belt.')
    bench.core.panel.hear('/conveyor', (jam,))
    status = bench.core.status()
    assert status.mode is Mode.ALARM
    assert status.message == 'conveyor: JAM: the belt stands for 12 s. Clear the belt.'
    assert bench.place(BOX).code is ErrorCode.NOT_ACTIVE
    bench.core.panel.hear('/conveyor', ())
    assert bench.place(BOX).code is ErrorCode.NONE


def test_acknowledging_nothing_is_refused(make_core_bench):
    assert make_core_bench().core.panel.acknowledge()[0] is False


def test_a_pause_and_an_alarm_outlive_the_executor(make_core_bench, tmp_path):
    bench = make_core_bench(folder=tmp_path, faults={BOX.id: ErrorCode.BOX_LOST})
    bench.place(BOX)
    bench.core.panel.request('PAUSE', '', 'anna', 'lunch', (True, 'the arm is paused'))
    paused = bench.core.panel.paused
    bench.end()
    again = make_core_bench(folder=tmp_path, start=False)
    again.core.start()
    again.wait(lambda: again.core.status().mode is Mode.ALARM)
    assert again.core.panel.acknowledge()[0]
    assert again.core.status().mode is Mode.PAUSED
    assert again.core.panel.paused == paused
    again.core.panel.request('RESUME', '', 'ben', '', (True, ''))
    assert again.core.status().mode is Mode.IDLE
    again.end()


def test_every_request_is_in_the_journal_with_who_when_and_why(make_core_bench):
    bench = make_core_bench()
    bench.core.panel.request('SWAP_BIN', 'A', '', 'full', (False, 'there is no bin'))
    (operation,) = log_of(bench).operations()
    assert (operation.command, operation.subject, operation.who) == ('SWAP_BIN', 'A', 'an operator')
    assert (operation.why, operation.done, operation.answer) == ('full', False, 'there is no bin')
    assert operation.stamp_s > 1e9


def test_who_acknowledged_an_alarm_and_why_is_in_the_journal(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.BOX_LOST})
    bench.place(BOX)
    bench.core.panel.acknowledge('anna', 'was on the floor')
    (kept,) = bench.journal.alarms()
    assert (kept.alarm.code, kept.over_by, kept.over_why) == (
        'BOX_LOST',
        'anna',
        'was on the floor',
    )
    assert kept.over_s >= kept.alarm.raised_s


def test_each_alarm_says_what_a_person_does():
    assert {'BOX_LOST', 'COLLISION', 'JAM'} <= set(ALARMS)
    assert all('cell ack' in TROUBLES[code].action for code in ALARMS)
