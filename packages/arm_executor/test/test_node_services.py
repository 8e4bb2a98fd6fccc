"""What the node's services do, and what it says of itself; with the timed arm."""

from __future__ import annotations

from dataclasses import replace

import pytest
from action_msgs.msg import GoalStatus
from executor_cases import make_box, make_decision
from std_srvs.srv import SetBool, Trigger

from pack_msgs.action import PlaceBox
from pack_msgs.msg import ExecutorState
from pack_msgs.srv import CheckPlacements, CutOff, InsertPlacedBox, RemoveBox
from pack_msgs_py.codes import BinStatus, Command, ErrorCode, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions
from pack_msgs_py.values import PlacedBox

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
    bench.wait_mode(ExecutorState.MODE_PAUSED)
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
    assert result.error_code == ErrorCode.PROTECTIVE_STOP
    assert result.error_msg.startswith('stopped by a service call (since ')
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


def test_an_operator_says_who_and_why_and_the_heartbeat_repeats_it(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    assert bench.operate(Command.PAUSE, why='lunch') == (True, 'the arm is paused')
    bench.wait_mode(ExecutorState.MODE_PAUSED)
    message = bench.of('executor_state')[-1].message
    assert message.startswith('PAUSED by anna (since ') and message.endswith('): lunch')
    refused, text = bench.operate(Command.PAUSE, who='ben')
    assert not refused and 'PAUSED by anna' in text and 'cell resume' in text
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NOT_ACTIVE
    assert bench.operate(Command.RESUME) == (True, 'the arm goes on')
    assert bench.operate(Command.RESUME) == (False, 'the arm is not paused: its mode is IDLE')
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NONE


def test_a_lost_box_is_an_alarm_on_its_topic_until_an_operator_acknowledges_it(start):
    bench = start(faults={'box-1': ErrorCode.BOX_LOST})
    box, following = make_box(1), make_box(2)
    bench.show(box, following, presented=box.id)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.BOX_LOST
    bench.wait_mode(ExecutorState.MODE_ALARM)
    bench.wait(lambda: bench.of('alarms') and bench.of('alarms')[-1].alarms, 'an alarm')
    (alarm,) = bench.of('alarms')[-1].alarms
    assert (alarm.code, alarm.box_id, alarm.severity) == ('BOX_LOST', box.id, 2)
    bench.wait(
        lambda: any(
            msg.status[0].message.startswith('BOX_LOST') for msg in bench.of('/diagnostics')
        ),
        'diagnosis',
    )
    assert bench.operate(Command.PAUSE)[0]
    done, text = bench.operate(Command.RESUME)
    assert done and text.startswith('the arm is paused no longer, and still stands: BOX_LOST: ')
    assert bench.operate(Command.ACKNOWLEDGE) == (True, 'acknowledged: BOX_LOST')
    bench.wait(lambda: not bench.of('alarms')[-1].alarms, 'the end of the alarm')
    bench.wait_mode(ExecutorState.MODE_IDLE)


def test_a_held_bin_is_shown_as_held_and_a_closed_one_is_gone(start):
    bench = start()
    assert bench.operate(Command.HOLD_BIN, 'A')[0]
    bench.wait(lambda: bench.of('bin_state')[-1].bins[0].status == BinStatus.HELD, 'a held bin')
    assert [bin_.id for bin_ in bench.bins().bins] == ['LDC-2']
    assert bench.operate(Command.RELEASE_BIN, 'LDC-1')[0]
    success, text = bench.operate(Command.CLOSE_BIN, 'B')
    assert success and text.endswith('station B stays empty until: cell swap B')
    bench.wait(lambda: [bin_.id for bin_ in bench.bins().bins] == ['LDC-1'], 'one bin')
    assert [closed.bin_id for closed in bench.of('bin_closed')] == ['LDC-2']


def test_a_box_put_in_by_hand_and_one_taken_out_are_told_to_all(start):
    bench = start()
    box = make_box()
    placed = conversions.placed_box_to_ros(
        PlacedBox(box, (0, 0, 0), (300, 200, 150)), Pose((0.15, 0.1, 0.075))
    )
    insert = InsertPlacedBox.Request(bin_id='A', placed=placed, who='anna', why='was short')
    refused = bench.call('insert_box', insert)
    assert not refused.success and 'cell pause' in refused.message
    bench.operate(Command.PAUSE)
    assert bench.call('insert_box', insert).success
    bench.wait(lambda: bench.events(box.id) == ['PLACED'], 'PLACED')
    assert bench.of('box_event')[-1].reason == Reason.OPERATOR
    bench.wait(lambda: bench.bins().bins[0].boxes, 'the box in its bin')
    assert bench.call('remove_box', RemoveBox.Request(box_id=box.id)).success
    bench.wait(lambda: bench.events(box.id) == ['PLACED', 'REJECTED'], 'REJECTED')
    bench.wait(lambda: not bench.bins().bins[0].boxes, 'an empty bin')


@pytest.mark.parametrize(
    ('command', 'said'),
    [(99, 'command 99 is not known'), (Command.DRAIN, 'DRAIN is for the conveyor')],
)
def test_a_command_that_the_arm_does_not_know_is_refused_by_name(start, command, said):
    success, text = start().operate(command)
    assert not success and said in text
