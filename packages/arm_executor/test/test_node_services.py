"""What the node's services do, and what it says of itself; with the timed arm."""

from __future__ import annotations

from dataclasses import replace

import pytest
from action_msgs.msg import GoalStatus
from executor_cases import make_box, make_decision
from std_srvs.srv import SetBool, Trigger

from pack_msgs.action import PlaceBox
from pack_msgs.msg import ExecutorState
from pack_msgs.srv import CheckPlacements, CutOff
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.ros import conversions

pytestmark = pytest.mark.ros


def test_candidates_are_checked_and_the_plan_is_reused(start):
    bench = start(faults={'box-2': ErrorCode.NO_IK_SOLUTION})
    possible, out_of_reach = make_box(1), make_box(2)
    bench.show(possible, out_of_reach, presented=possible.id)
    candidates = [
        make_decision(possible),
        make_decision(out_of_reach),
        make_decision(possible, (0, 0, 40)),
    ]
    msgs = [conversions.placement_to_ros(candidate, 'bin_a') for candidate in candidates]
    checks = bench.call('check_placements', CheckPlacements.Request(candidates=msgs)).checks
    assert [ErrorCode(check.error_code).name for check in checks] == [
        'NONE',
        'NO_IK_SOLUTION',
        'RULE_VIOLATION',
    ]
    assert conversions.duration_from_ros(checks[0].motion_time) > 3.0
    assert all(check.error_msg for check in checks[1:])
    _, result = bench.place(candidates[0])
    assert result.report.motion_time == checks[0].motion_time


def test_candidates_are_answered_with_busy_while_the_arm_works_and_beyond_eight(start):
    bench = start()
    box = make_box()
    bench.show(make_box(2), box)
    msg = conversions.placement_to_ros(make_decision(box), 'bin_a')
    many = bench.call('check_placements', CheckPlacements.Request(candidates=[msg] * 9)).checks
    assert [check.error_code for check in many] == [0] * 8 + [ErrorCode.BUSY]
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_WAITING)
    bench.cancel(handle)
    bench.result(handle)


def test_a_paused_executor_refuses_goals_until_it_goes_on(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    assert bench.call('pause', SetBool.Request(data=True)).success
    bench.wait_mode(ExecutorState.MODE_INACTIVE)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NOT_ACTIVE
    bench.call('pause', SetBool.Request(data=False))
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NONE


def test_a_protective_stop_keeps_the_box_until_reset_returns_it(start):
    faults = {'box-1': ErrorCode.PROTECTIVE_STOP}
    bench = start(faults=faults)
    box = make_box()
    bench.show(box, presented=box.id)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.PROTECTIVE_STOP
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert bench.of('executor_state')[-1].active_box_id == box.id
    assert bench.events(box.id) == ['PICKED']
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NOT_ACTIVE
    answer = bench.call('reset', Trigger.Request())
    assert (answer.success, box.id in answer.message) == (True, True)
    bench.wait(lambda: bench.events(box.id) == ['PICKED', 'RETURNED'], 'RETURNED')
    faults.clear()
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NONE
    assert not bench.call('reset', Trigger.Request()).success


def test_a_failing_arm_ends_the_goal_and_the_executor_says_so(start):
    bench = start(faults={'box-1': ErrorCode.UNKNOWN})
    box = make_box()
    bench.show(box, presented=box.id)
    status, result = bench.place(make_decision(box))
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, ErrorCode.UNKNOWN)
    assert 'RuntimeError' in result.error_msg
    bench.wait_mode(ExecutorState.MODE_FAULT)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NOT_ACTIVE
    assert not bench.call('reset', Trigger.Request()).success


def test_diagnostics_name_mode_and_bins(start):
    bench = start()
    bench.wait(lambda: bench.of('/diagnostics'), 'diagnostics')
    status = bench.of('/diagnostics')[-1].status[0]
    assert status.message == 'idle'
    assert {value.key for value in status.values} >= {
        'mode', 'last_fault', 'tracking_error', 'journal', 'revision', 'LDC-1', 'LDC-2'
    }  # fmt: skip


def test_a_protective_stop_on_request_stands_until_the_reset(start):
    bench = start(speed=1.0)
    box = make_box()
    bench.show(box, presented=box.id)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_TRANSFERRING)
    assert bench.call('stop', Trigger.Request()).success
    _, result = bench.result(handle)
    assert (result.error_code, result.error_msg) == (
        ErrorCode.PROTECTIVE_STOP, 'stopped by the operator'
    )  # fmt: skip
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert bench.call('reset', Trigger.Request()).success
    assert bench.events(box.id) == ['PICKED', 'RETURNED']
    bench.wait_mode(ExecutorState.MODE_IDLE)


def test_a_cut_off_closes_the_bins_of_its_destination_and_no_other(start):
    bench = start(destinations='north,south', open_bins=3)
    box = replace(make_box(), destination='north')
    bench.show(box, presented=box.id)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NONE
    assert not bench.call('cut_off', CutOff.Request(destination='west')).success
    assert not bench.call('cut_off', CutOff.Request()).success
    # LDC-1 holds a box, LDC-3 none: it may stay.
    answer = bench.call('cut_off', CutOff.Request(destination='north'))
    assert (answer.success, answer.closed, answer.pending) == (True, ['LDC-1'], [])
    standing = {bin_.id: bin_.destination for bin_ in bench.bins().bins}
    assert standing == {'LDC-2': 'south', 'LDC-3': 'north', 'LDC-4': 'north'}
    bench.wait(
        lambda: [closed.bin_id for closed in bench.of('bin_closed')] == ['LDC-1'], 'bin_closed'
    )
    request = CutOff.Request(destination='north', next_destination='east')
    assert bench.call('cut_off', request).closed == ['LDC-3', 'LDC-4']
    assert [bin_.destination for bin_ in bench.bins().bins] == ['south', 'east', 'east']


def test_a_bin_that_is_cut_off_while_a_box_is_on_its_way_into_it_waits_for_that_box(start):
    bench = start(destinations='north', speed=1.0)
    box = replace(make_box(), destination='north')
    bench.show(box, presented=box.id)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_TRANSFERRING)
    answer = bench.call('cut_off', CutOff.Request(destination='north', next_destination='south'))
    assert (answer.closed, answer.pending) == (['LDC-2'], ['LDC-1'])
    assert bench.result(handle)[1].error_code == ErrorCode.NONE
    bench.wait(lambda: len(bench.of('bin_closed')) == 2, 'bin_closed')
    (last,) = bench.of('bin_closed')[1].boxes
    assert last.box.id == box.id
    bench.wait(lambda: all(b.destination == 'south' for b in bench.bins().bins), 'bins for south')
