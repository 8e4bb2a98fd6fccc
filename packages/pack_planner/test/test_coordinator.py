"""When the planner decides, announces and sends, as long as all goes well."""

from __future__ import annotations

from dataclasses import replace

import pytest
from coordinator_rig import EMPTY, CoordinatorRig

from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_planner.coordination.patience import Patience
from pack_planner.decision.planner import expected_bins


@pytest.fixture
def rig():
    return CoordinatorRig()


@pytest.mark.parametrize('order', ['sbh', 'shb', 'bsh', 'bhs', 'hsb', 'hbs'])
def test_it_decides_as_soon_as_it_has_scan_bins_and_an_idle_arm_in_any_order(rig, order):
    inputs = {'s': rig.scan, 'b': rig.bins, 'h': rig.beat}
    for letter in order[:2]:
        inputs[letter]()
        assert rig.take() == []
    inputs[order[2]]()
    assert rig.take() == [('plan', 1)]
    rig.planned('a')
    assert rig.take() == [('announce', 'a'), ('send', 'a')]
    assert rig.unhidden_s == 0.5


def test_it_offers_only_the_look_ahead(rig):
    rig.start()
    assert [box.id for box in rig.situations[1].boxes] == ['a', 'b']


def test_it_waits_for_a_full_look_ahead_but_not_for_ever(rig):
    rig.bins()
    rig.scan(['a'])
    rig.beat()
    rig.wait(Patience(2).seconds - 0.2)
    assert rig.take() == []
    rig.wait(0.4)
    assert rig.take() == [('plan', 1)]


def test_its_patience_begins_when_there_is_something_to_wait_with(rig):
    rig.bins()
    rig.scan([])
    rig.wait(60.0)
    rig.scan(['a'])
    rig.wait(1.0)
    assert rig.take() == [], 'the second box of a burst may come in a moment'
    rig.scan(['a', 'b'])
    assert rig.take() == [('plan', 1)]


def test_with_enough_on_the_belt_it_does_not_wait_for_the_rest():
    rig = CoordinatorRig(look_ahead=5, patience=Patience(5, least=2, seconds=60.0))
    rig.bins()
    rig.beat()
    rig.scan(['a'])
    assert rig.take() == []
    rig.scan(['a', 'b'])
    assert rig.take() == [('plan', 1)]


def test_the_end_of_the_stream_is_as_good_as_a_full_look_ahead(rig):
    rig.remaining = 0
    rig.bins()
    rig.scan(['a'])
    rig.beat()
    assert rig.take() == [('plan', 1)]


def test_it_waits_while_the_arm_carries_out_the_goal_of_someone_else(rig):
    rig.bins()
    rig.scan()
    rig.wait(10, Mode.EXECUTING, 'z')
    assert rig.take() == []
    rig.beat()
    assert rig.take() == [('plan', 1)]


@pytest.mark.parametrize('mode', [mode for mode in Mode if mode not in (Mode.IDLE, Mode.EXECUTING)])
def test_it_waits_while_the_arm_takes_no_goals(rig, mode):
    rig.bins()
    rig.scan()
    rig.wait(3, mode)
    assert rig.take() == []


def test_boxes_that_are_picked_placed_or_rejected_are_not_offered(rig):
    rig.event('a', BoxEventKind.PICKED)
    rig.event('b', BoxEventKind.PLACED)
    rig.event('b', BoxEventKind.RETURNED)
    rig.remaining = 0
    rig.start('b')
    assert [box.id for box in rig.situations[1].boxes] == ['b', 'c']


def test_while_the_arm_moves_it_plans_the_next_box_against_the_expected_bins(rig):
    rig.start('a')
    rig.scan(['b', 'c'])
    assert rig.take() == [], 'not before the box is picked'
    rig.event('a', BoxEventKind.PICKED)
    assert rig.take() == [('plan', 2)]
    ahead = rig.situations[2]
    assert [box.id for box in ahead.boxes] == ['b', 'c']
    assert ahead.bins[0].revision == 1
    assert [placed.box.id for placed in ahead.bins[0].boxes] == ['a']
    rig.planned('b')
    assert rig.take() == [('announce', 'b')], 'so that the belt brings it'
    rig.finish()
    assert rig.take() == [('send', 'b')]
    assert rig.unhidden_s == 0.0


def test_planning_that_the_motion_did_not_hide_counts(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.finish()
    assert rig.take() == [('plan', 2)]
    rig.now += 0.2
    rig.planned('b')
    assert rig.take() == [('announce', 'b'), ('send', 'b')]
    assert rig.unhidden_s == pytest.approx(0.2)


def test_it_plans_ahead_only_when_the_belt_was_refilled(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b'])
    assert rig.take() == []
    rig.scan(['b', 'c'])
    assert rig.take() == [('plan', 2)]


def test_a_plan_made_ahead_is_dropped_when_the_bins_came_out_otherwise(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    other = replace(expected_bins((EMPTY,), rig.sent)[0], revision=7)
    rig.bins(other)
    rig.report()
    rig.coordinator.on_result(rig.goal_id, None)
    assert rig.take() == [('plan', 3)]
    assert rig.situations[3].bins[0].revision == 7


def test_a_plan_made_ahead_is_dropped_when_its_box_left_the_belt(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    rig.scan(['c', 'd'])
    assert rig.take() == [('plan', 3)]


def test_a_failed_motion_drops_the_plan_made_ahead_and_decides_again_on_new_inputs(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    rig.finish(ErrorCode.GRASP_FAILED)
    assert rig.take() == []
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])
    assert rig.take() == [('plan', 3)]
    assert [box.id for box in rig.situations[3].boxes] == ['a', 'b']


def test_a_box_that_came_back_before_the_report_is_tried_again_at_once(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])
    rig.take()
    rig.finish(ErrorCode.GRASP_FAILED)
    assert rig.take() == [('plan', 3)]
