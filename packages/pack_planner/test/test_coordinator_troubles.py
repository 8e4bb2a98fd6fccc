"""What the planner does about refusals, failures, silence and answers that stay away."""

from __future__ import annotations

from dataclasses import replace

import pytest
from coordinator_rig import EMPTY, CoordinatorRig, box
from planner_cases import SMALL

from pack_msgs_py.cell_values import Decision, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode, PlacementStatus, Reason
from pack_msgs_py.values import Bin
from pack_planner.coordination.awaited_bins import BINS_TIMEOUT_S
from pack_planner.coordination.coordinator import SILENCE_S
from pack_planner.coordination.inputs import RESCAN_S
from pack_planner.coordination.running_goal import (
    ACCEPT_TIMEOUT_S,
    FORGOTTEN_S,
    MOTIONS_TRIED,
    REPORT_TIMEOUT_S,
)
from pack_planner.decision.planner import CloseStep, RejectStep, WaitStep
from pack_planner.decision.refusals import TRIES_IN_EMPTY_BIN


@pytest.fixture
def rig():
    return CoordinatorRig()


def test_a_box_is_tried_again_when_the_event_that_it_came_back_arrives_last(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['a', 'b'])
    rig.finish(ErrorCode.GRASP_FAILED)
    assert rig.take() == []
    rig.event('a', BoxEventKind.RETURNED)
    assert rig.take() == [('plan', 2)]


@pytest.mark.parametrize(
    ('code', 'avoided'),
    [
        (ErrorCode.GRASP_FAILED, True),
        (ErrorCode.PATH_TOLERANCE_VIOLATED, True),
        (ErrorCode.CANCELED, False),
    ],
)
def test_a_placement_whose_motion_failed_is_not_offered_again(rig, code, avoided):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.finish(code)
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])
    assert bool(rig.situations[2].forbidden.refused(box('a'), EMPTY)) is avoided


def fail(rig, code):
    rig.coordinator.on_answer(rig.goal_id, accepted=True)
    rig.event('a', BoxEventKind.PICKED)
    rig.finish(code)
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])


def test_a_box_whose_motions_fail_time_and_again_is_rejected(rig):
    rig.start('a')
    fail(rig, ErrorCode.COLLISION)
    for _ in range(MOTIONS_TRIED - 1):
        rig.planned('a')
        fail(rig, ErrorCode.GRASP_FAILED)
    assert rig.take()[-2] == ('announce', 'a')
    assert [box.id for box in rig.situations[max(rig.situations)].boxes] == ['b']


def test_a_box_that_is_not_what_was_scanned_twice_is_rejected(rig):
    rig.start('a')
    fail(rig, ErrorCode.BOX_MISMATCH)
    # It is not on offer by the old scan, but once it was scanned again.
    assert rig.take() == []
    rig.now += RESCAN_S
    rig.scan(['a', 'b'])
    assert rig.take() == [('plan', 2)]
    rig.planned('a')
    rig.take()
    fail(rig, ErrorCode.BOX_MISMATCH)
    rig.now += RESCAN_S
    rig.scan(['a', 'b'])
    assert rig.take()[0] == ('announce', 'a')


def test_bins_that_came_before_the_refusal_they_explain_are_used_at_once(rig):
    rig.start('a')
    rig.bins(replace(EMPTY, revision=3))
    rig.refuse(ErrorCode.STALE_BIN_REVISION)
    assert rig.take() == [('plan', 2)]
    assert rig.situations[2].bins[0].revision == 3


@pytest.mark.parametrize(
    'code', [ErrorCode.STALE_BIN_REVISION, ErrorCode.BUSY, ErrorCode.BOX_NOT_ON_BELT]
)
def test_a_refusal_that_is_not_about_the_placement_waits_for_new_inputs(rig, code):
    rig.start('a')
    rig.refuse(code)
    # The message of the newer bins may be lost: they are asked for.
    assert rig.take() == ([('refresh',)] if code is ErrorCode.STALE_BIN_REVISION else [])
    rig.bins(replace(EMPTY, revision=3))
    assert rig.take() == [('plan', 2)]
    assert rig.situations[2].forbidden.by_bin == {}


@pytest.mark.parametrize(
    'code',
    [ErrorCode.RULE_VIOLATION, ErrorCode.NO_IK_SOLUTION, ErrorCode.DEADLINE_UNREACHABLE],
)
def test_a_refused_placement_is_not_offered_again_and_not_every_one_is_tried(rig, code):
    rig.start('a')
    rig.refuse(code)
    assert rig.take() == [('plan', 2)]
    zones = rig.situations[2].forbidden.refused(box('a'), EMPTY)
    assert [zone.corner_mm for zone in zones] == [(0, 0, 0)]
    for tries in range(1, TRIES_IN_EMPTY_BIN):
        assert rig.situations[1 + tries].forbidden(box('a'), EMPTY) is not None
        rig.planned('a', (100 * tries, 0, 0))
        rig.refuse(code)
    last = rig.situations[1 + TRIES_IN_EMPTY_BIN].forbidden
    assert len(last.refused(box('a'), EMPTY)) == TRIES_IN_EMPTY_BIN
    assert last(box('a'), EMPTY) is None
    grown = replace(EMPTY, revision=5)
    rig.bins(grown)
    rig.planned('b')
    later = rig.situations[max(rig.situations)].forbidden
    lasting = code is ErrorCode.NO_IK_SOLUTION
    assert len(later(box('a'), grown)) == (TRIES_IN_EMPTY_BIN if lasting else 0)


def test_a_refusal_without_goal_id_is_matched_by_box_and_revision(rig):
    rig.start('a')
    rig.coordinator.on_report(Report('a', 'bin-1', 1, 0, ErrorCode.NO_IK_SOLUTION))
    rig.coordinator.on_answer(rig.goal_id, accepted=False)
    assert rig.take() == [('plan', 2)]


def test_a_box_that_the_executor_knows_to_be_in_a_bin_is_not_offered_again(rig):
    rig.start('a')
    rig.refuse(ErrorCode.DUPLICATE_BOX)
    rig.scan()
    assert [box.id for box in rig.situations[2].boxes] == ['b', 'c']


def test_nothing_fits_closes_the_bin_and_waits_for_the_new_one(rig):
    full = replace(EMPTY, revision=4)
    rig.bins(full)
    rig.scan()
    rig.beat()
    rig.outcome(CloseStep(full))
    assert rig.take() == [('plan', 1), ('swap', 'bin-1')]
    rig.scan()
    assert rig.take() == []
    rig.coordinator.on_swapped(success=True, message='')
    assert rig.take() == [], 'the new bin is not there yet'
    rig.bins(Bin('bin-2', 2, SMALL))
    assert rig.take() == [('plan', 2)]


def test_a_bin_is_never_closed_while_a_goal_runs(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.outcome(CloseStep(rig.situations[2].bins[0]))
    assert rig.take() == [('plan', 2)]
    rig.finish()
    assert rig.take() == [('swap', 'bin-1')]


def test_a_refused_swap_decides_again(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.outcome(CloseStep(EMPTY))
    rig.coordinator.on_swapped(success=False, message='busy')
    rig.take()
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_rejected_box_is_announced_and_no_longer_offered(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    decision = Decision(
        box('a'), status=PlacementStatus.REJECT, reject_reason=Reason.OVERSIZE, reason='too large'
    )
    rig.outcome(RejectStep(decision))
    assert rig.take() == [('plan', 1), ('announce', 'a'), ('plan', 2)]
    assert [box.id for box in rig.situations[2].boxes] == ['b', 'c']


def test_a_silent_executor_is_forgotten_with_its_goal_and_asked_for_its_bins(rig):
    rig.start('a')
    rig.now += SILENCE_S + 0.1
    rig.scan()
    assert rig.take() == []
    rig.report()
    rig.scan()
    assert rig.take() == []
    rig.beat()
    assert rig.take() == [('refresh',)]
    rig.scan()
    assert rig.take() == [], 'the bins of before may be wrong'
    rig.bins()
    assert rig.take() == [('plan', 2)]


def test_death_of_the_executor_during_planning_drops_the_decision(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.coordinator.on_executor_lost()
    rig.planned('a')
    assert rig.take() == [('plan', 1)]


def test_an_unanswered_goal_is_given_up(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.planned('a')
    rig.take()
    rig.wait(ACCEPT_TIMEOUT_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_refusal_without_a_report_is_given_up(rig):
    rig.start('a')
    rig.coordinator.on_answer(rig.goal_id, accepted=False)
    rig.wait(REPORT_TIMEOUT_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_goal_whose_result_got_lost_is_given_up(rig):
    rig.start('a')
    rig.wait(20, Mode.EXECUTING, 'a')
    rig.scan()
    assert rig.take() == []
    rig.wait(FORGOTTEN_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_bin_that_does_not_change_as_reported_does_not_stop_the_cell(rig):
    rig.start('a')
    rig.report()
    rig.coordinator.on_result(rig.goal_id, None)
    rig.wait(BINS_TIMEOUT_S - 0.2)
    rig.scan(['b', 'c'])
    assert rig.take() == []
    rig.wait(0.5)
    assert rig.take() == [('plan', 2)]


def test_a_decision_that_failed_is_tried_again_with_the_next_input(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.coordinator.on_planned(1, None, 'ValueError: broken')
    rig.take()
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_waiting_is_reconsidered_with_the_next_scan(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.outcome(WaitStep('nothing'))
    assert rig.take() == [('plan', 1)]
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_decision_for_bins_that_changed_meanwhile_is_made_again(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.bins(replace(EMPTY, revision=9))
    rig.planned('a')
    assert rig.take() == [('plan', 1), ('plan', 2)]


def test_nothing_is_begun_while_a_second_source_speaks(rig):
    rig.bins()
    rig.scan()
    rig.coordinator.hold('a second source speaks for the arm')
    rig.beat()
    rig.wait(3.0)
    assert rig.take() == []
    rig.coordinator.hold('')
    rig.beat()
    assert rig.take() == [('plan', 1)]


def test_a_decision_that_was_under_way_is_not_carried_out_while_a_second_source_speaks(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.take()
    rig.coordinator.hold('a second source speaks for the belt')
    rig.planned('a')
    rig.wait(1.0)
    assert rig.take() == []
    rig.coordinator.hold('')
    rig.beat()
    assert rig.take() == [('plan', 2)]
