"""The arm does not move while somebody else speaks for a part of the cell."""

from __future__ import annotations

import pytest
from executor_cases import make_box, make_decision

from pack_msgs.msg import AlarmArray, BoxScan, ExecutorState
from pack_msgs_py.alarms import raised
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.one_source import new_session
from pack_msgs_py.ros import conversions, qos

pytestmark = pytest.mark.ros


def refused_goal(bench, box):
    _, result = bench.place(make_decision(box))
    return ErrorCode(result.error_code), result.error_msg


def test_no_goal_is_taken_while_a_second_executor_speaks(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    other = bench.node.create_publisher(ExecutorState, 'executor_state', qos.HEARTBEAT)
    state = ExecutorState(mode=ExecutorState.MODE_IDLE)
    state.source.session = new_session()

    def refused():
        state.source.number += 1
        state.header.stamp = bench.node.get_clock().now().to_msg()
        other.publish(state)
        return refused_goal(bench, box)

    code, text = refused()
    while 'a second source' not in text:
        # It may be one that was started again, until the first is heard after it.
        code, text = refused()
    assert code is ErrorCode.NOT_ACTIVE
    assert 'a second source speaks for the arm on executor_state' in text


def test_no_goal_is_taken_when_an_old_scan_is_played_again(start):
    bench = start()
    box = make_box()
    now, before = new_session(), new_session() - 10**12
    alarms = []
    bench.node.create_subscription(AlarmArray, 'alarms', alarms.append, qos.TOPICS['alarms'])
    scans = bench.node.create_publisher(BoxScan, 'box_scan', qos.TOPICS['box_scan'])
    bench.wait(lambda: scans.get_subscription_count() > 0, 'subscriber of box_scan')

    def scan(session, number):
        msg = BoxScan(sequence=number)
        msg.header.frame_id, msg.header.stamp = 'cell', conversions.time_to_ros(bench.now())
        msg.source.session, msg.source.number = session, number
        scans.publish(msg)

    scan(now, 7)
    code, text = refused_goal(bench, box)
    while 'scan 7' not in text:
        code, text = refused_goal(bench, box)
    scan(before, 5)
    while code is ErrorCode.BOX_NOT_ON_BELT:
        code, text = refused_goal(bench, box)
    assert code is ErrorCode.NOT_ACTIVE
    assert 'a second source speaks for the belt on box_scan' in text
    bench.wait(
        lambda: any(alarm.code == 'SECOND_SOURCE' for msg in alarms for alarm in msg.alarms),
        'alarm',
    )


def test_a_goal_of_an_older_planner_is_refused(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    session = new_session()
    for started, expected in ((session, ErrorCode.NONE), (session - 10**9, ErrorCode.NOT_ACTIVE)):
        goal = bench.goal_msg(make_decision(box))
        goal.placement.source.session = started
        _, result = bench.result(bench.send(goal))
        assert result.error_code == expected, result.error_msg
    assert 'a second source speaks for the planner' in result.error_msg


def test_an_alarm_of_a_node_that_there_is_not_does_not_stop_the_arm_for_ever(start):
    bench = start()
    alarms = bench.node.create_publisher(AlarmArray, 'alarms', qos.TOPICS['alarms'])
    bench.wait(lambda: alarms.get_subscription_count() > 1, 'listeners of alarms')
    jam = raised('JAM', 'said by nobody', bench.now())
    alarms.publish(conversions.alarms_to_ros('/nobody', (jam,), bench.now()))
    bench.wait_mode(ExecutorState.MODE_ALARM)
    bench.wait_mode(ExecutorState.MODE_IDLE)


def test_an_alarm_of_a_node_of_ones_own_holds_until_that_says_that_it_is_over(start):
    bench = start()
    alarms = bench.node.create_publisher(AlarmArray, 'alarms', qos.TOPICS['alarms'])
    bench.wait(lambda: alarms.get_subscription_count() > 1, 'listeners of alarms')
    told = len(bench.of('/diagnostics'))
    curtain = raised('JAM', 'somebody is near', bench.now())
    alarms.publish(conversions.alarms_to_ros('/bench', (curtain,), bench.now()))
    bench.wait_mode(ExecutorState.MODE_ALARM)
    # Each time it is looked which nodes there are.
    bench.wait(lambda: len(bench.of('/diagnostics')) > told + 2, 'diagnostics')
    assert bench.of('executor_state')[-1].mode == ExecutorState.MODE_ALARM
    alarms.publish(conversions.alarms_to_ros('/bench', (), bench.now()))
    bench.wait_mode(ExecutorState.MODE_IDLE)
