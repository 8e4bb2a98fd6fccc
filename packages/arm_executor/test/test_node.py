"""The node in a private context, with the timed arm and a scripted conveyor and planner."""

from __future__ import annotations

import itertools
import math
import statistics

import pytest
from action_msgs.msg import GoalStatus
from executor_cases import make_box, make_decision

from pack_msgs.action import PlaceBox
from pack_msgs.msg import ExecutorState
from pack_msgs.srv import SwapBin
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.ros import conversions

pytestmark = pytest.mark.ros


def listen_in(node, monkeypatch):
    """What the node sends, in order: subscribers of several topics cannot tell."""
    told = []

    def note(owner, name, text):
        send = getattr(owner, name)

        def noting(argument):
            told.append(text(argument))
            return send(argument)

        monkeypatch.setattr(owner, name, noting)

    note(node._publish, 'event', lambda output: f'event {output.event.event.name}')
    note(node._publish, 'bins', lambda output: f'bins {output.state.revision}')
    note(node._publish, 'report', lambda report: 'report')
    finish = node._goals.action._execute_callback

    async def finishing(handle):
        result = await finish(handle)
        told.append('result')
        return result

    node._goals.action.register_execute_callback(finishing)
    return told


def test_a_placement_is_told_in_order_and_ends_in_the_bin(start, monkeypatch):
    bench = start()
    told = listen_in(bench.executor_node, monkeypatch)
    box = make_box()
    bench.show(box, presented=box.id)
    status, result = bench.place(make_decision(box))
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, ErrorCode.NONE)
    assert told == ['event PICKED', 'event PLACED', 'bins 2', 'report', 'result']
    bench.wait(lambda: bench.of('placement_report'), 'report')
    bench.wait(lambda: len(bench.of('bin_state')) == 2, 'bin_state')
    first, second = (conversions.bins_from_ros(msg) for msg in bench.of('bin_state'))
    assert second.revision == first.revision + 1
    assert [bin_.revision for bin_ in second.bins] == [2, 1]
    assert [placed.box.id for placed in second.bins[0].boxes] == [box.id]
    report = result.report
    assert report == bench.of('placement_report')[0]
    assert report.measured_valid
    times = conversions.report_from_ros(report)
    assert times.motion_s > 3.0
    assert times.cycle_s == pytest.approx(times.planning_s + times.motion_s)
    assert times.slack_s == pytest.approx(60.0 - times.cycle_s, abs=1.0)


def test_feedback_names_every_phase_in_order(start):
    bench = start(speed=10.0)
    box = make_box()
    bench.show(box, presented=box.id)
    bench.place(make_decision(box))
    phases = [feedback.phase for feedback in bench.feedback]
    assert phases == sorted(phases)
    assert {PlaceBox.Feedback.PHASE_WAITING, PlaceBox.Feedback.PHASE_RETREATING} <= set(phases)


def test_boxes_are_stacked_one_after_another(start):
    bench = start()
    boxes = [make_box(number) for number in range(1, 6)]
    for revision, box in enumerate(boxes, start=1):
        bench.show(*boxes[revision - 1 :], presented=box.id)
        corner = (0, 0, 150 * (revision - 1))
        _, result = bench.place(make_decision(box, corner, revision=revision))
        assert (result.error_code, result.error_msg) == (0, '')
    assert len(bench.of('placement_report')) == 5


def test_the_arm_waits_until_the_belt_presents_the_box(start):
    bench = start()
    box = make_box()
    bench.show(make_box(2), box)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_WAITING)
    assert bench.events(box.id) == []
    bench.show(box, presented=box.id)
    _, result = bench.result(handle)
    assert result.error_code == ErrorCode.NONE


def test_a_goal_that_overtakes_its_scan_waits_for_it(start):
    bench = start()
    box = make_box()
    bench.wait_listener()
    bench.sequence += 1
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.sequence -= 1
    bench.show(box, presented=box.id)
    assert bench.result(handle)[1].error_code == ErrorCode.NONE


def test_a_goal_whose_scan_never_comes_is_refused(start):
    bench = start()
    bench.sequence = 5
    _, result = bench.place(make_decision(make_box()))
    assert result.error_code == ErrorCode.BOX_NOT_ON_BELT


def test_a_box_that_never_comes_is_given_up(start):
    bench = start(present_timeout_s=0.2)
    box = make_box()
    bench.show(make_box(2), box)
    status, result = bench.place(make_decision(box))
    assert (status, result.error_code) == (
        GoalStatus.STATUS_ABORTED,
        ErrorCode.BOX_NOT_PRESENTED,
    )
    assert '0.2 s' in result.error_msg
    assert bench.events(box.id) == []


def refusals():
    box = make_box()
    good = make_decision(box)

    def changed(**changes):
        return lambda bench: bench.goal_msg(make_decision(box, **changes))

    def not_finite(bench):
        goal = bench.goal_msg(good)
        goal.placement.pose.position.x = math.nan
        return goal

    def late(bench):
        return bench.goal_msg(good, deadline_in_s=-36000.0)

    def hurried(bench):
        return bench.goal_msg(good, deadline_in_s=1.0)

    def unknown_box(bench):
        return bench.goal_msg(make_decision(make_box(9)))

    return {
        'INVALID_GOAL-nan': (not_finite, 'nan'),
        'INVALID_GOAL-bin': (changed(bin_id='LDC-9'), 'LDC-9'),
        'STALE_BIN_REVISION': (changed(revision=7), 'quotes 7'),
        'BOX_NOT_ON_BELT': (unknown_box, 'box-9'),
        'RULE_VIOLATION': (changed(corner_mm=(0, 0, 100)), 'support'),
        'STALE_GOAL': (late, 'had passed 3600'),  # and the time the goal takes to come
        'DEADLINE_UNREACHABLE': (hurried, 'the deadline leaves'),
    }


@pytest.mark.parametrize('name', refusals())
def test_a_refused_goal_carries_its_code_and_exactly_one_report(start, name):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    make_goal, numbers = refusals()[name]
    handle = bench.send(make_goal(bench))
    assert handle.accepted
    status, result = bench.result(handle)
    assert status == GoalStatus.STATUS_ABORTED
    assert ErrorCode(result.error_code).name == name.split('-')[0]
    assert numbers in result.error_msg
    bench.wait(lambda: bench.of('placement_report'), 'report')
    # A second goal fences the first: its report comes after anything the first could still cause.
    bench.place(make_decision(box))
    bench.wait(lambda: len(bench.of('placement_report')) >= 2, 'second report')
    reports = bench.of('placement_report')
    assert [bytes(report.goal_id.uuid) for report in reports].count(bytes(handle.goal_id.uuid)) == 1
    assert len(reports) == 2
    assert reports[0] == result.report


def test_a_second_goal_is_refused_while_the_first_runs(start):
    bench = start()
    running, waiting = make_box(1), make_box(2)
    bench.show(running, waiting)
    first = bench.send(bench.goal_msg(make_decision(running)))
    bench.wait_mode(ExecutorState.MODE_EXECUTING)
    _, result = bench.place(make_decision(waiting))
    assert result.error_code == ErrorCode.BUSY
    assert running.id in result.error_msg
    bench.show(running, waiting, presented=running.id)
    assert bench.result(first)[1].error_code == ErrorCode.NONE


def test_a_box_that_is_in_a_bin_is_refused(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    bench.place(make_decision(box))
    bench.show(box, presented=box.id)
    _, result = bench.place(make_decision(box, (300, 0, 0), revision=2))
    assert result.error_code == ErrorCode.DUPLICATE_BOX


def test_cancel_in_motion_stops_the_arm_and_returns_the_box(start):
    bench = start(speed=1.0)
    box = make_box()
    bench.show(box, presented=box.id)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_TRANSFERRING)
    before = bench.now()
    bench.cancel(handle)
    acknowledged_s = bench.now() - before
    status, result = bench.result(handle)
    ended_s = bench.now() - before
    assert (status, result.error_code) == (GoalStatus.STATUS_CANCELED, ErrorCode.CANCELED)
    assert acknowledged_s < 0.5
    assert ended_s < 1.0, 'the arm went on'
    assert bench.events(box.id) == ['PICKED', 'RETURNED']
    assert bench.bins().bins[0].boxes == ()
    bench.wait_mode(ExecutorState.MODE_IDLE)


def test_a_goal_is_executing_from_its_start_to_its_end(start):
    bench = start()
    box = make_box()
    bench.show(box)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait(lambda: GoalStatus.STATUS_EXECUTING in bench.statuses, 'status EXECUTING')
    bench.show(box, presented=box.id)
    assert bench.result(handle)[0] == GoalStatus.STATUS_SUCCEEDED
    bench.wait(lambda: GoalStatus.STATUS_SUCCEEDED in bench.statuses, 'status SUCCEEDED')


def test_cancel_while_waiting_leaves_the_box_on_the_belt(start):
    bench = start()
    box = make_box()
    bench.show(make_box(2), box)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_phase(PlaceBox.Feedback.PHASE_WAITING)
    bench.cancel(handle)
    status, result = bench.result(handle)
    assert (status, result.error_code) == (GoalStatus.STATUS_CANCELED, ErrorCode.CANCELED)
    assert bench.events(box.id) == []


def test_swap_bin_closes_with_content_and_opens_an_empty_one(start):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    bench.place(make_decision(box))
    stale = bench.call('swap_bin', SwapBin.Request(bin_id='LDC-1', bin_revision=1))
    assert not stale.success
    assert 'revision 2' in stale.message
    answer = bench.call('swap_bin', SwapBin.Request(bin_id='LDC-1', bin_revision=2))
    assert (answer.success, answer.new_bin_id, answer.new_serial) == (True, 'LDC-3', 3)
    bench.wait(lambda: bench.of('bin_closed'), 'bin_closed')
    closed = bench.of('bin_closed')[0]
    assert (closed.bin_id, closed.status, len(closed.boxes)) == ('LDC-1', closed.STATUS_CLOSED, 1)
    bench.wait(lambda: len(bench.bins().bins[1].boxes) == 0, 'bins')
    assert [bin_.id for bin_ in bench.bins().bins] == ['LDC-2', 'LDC-3']
    assert bench.bins().bins[1].station == 'A'


def test_swap_bin_is_refused_while_a_placement_into_it_is_under_way(start):
    bench = start()
    box = make_box()
    bench.show(make_box(2), box)
    handle = bench.send(bench.goal_msg(make_decision(box)))
    bench.wait_mode(ExecutorState.MODE_EXECUTING)
    refused = bench.call('swap_bin', SwapBin.Request(bin_id='LDC-1'))
    assert not refused.success
    assert "is being placed into bin 'LDC-1'" in refused.message
    assert bench.call('swap_bin', SwapBin.Request(bin_id='LDC-2')).success
    bench.show(box, presented=box.id)
    assert bench.result(handle)[1].error_code == ErrorCode.NONE


def test_a_late_joiner_gets_the_bins_and_the_events(start, make_bench):
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    bench.place(make_decision(box))
    late = make_bench()
    late.wait(lambda: late.of('bin_state') and len(late.of('box_event')) == 2, 'state and events')
    assert [placed.box.id for placed in late.bins().bins[0].boxes] == [box.id]
    assert late.events(box.id) == ['PICKED', 'PLACED']


def test_the_heart_beats_ten_times_a_second_also_while_the_arm_moves(start):
    bench = start(speed=4.0)
    box = make_box()
    bench.show(box, presented=box.id)
    count = len(bench.of('executor_state'))
    bench.place(make_decision(box))
    bench.wait(lambda: len(bench.of('executor_state')) > count + 15, 'heartbeats')
    times = [at for topic, _, at in bench.heard if topic == 'executor_state'][count + 1 :]
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert statistics.median(gaps) == pytest.approx(0.1, abs=0.03)
    assert max(gaps) < 1.0
