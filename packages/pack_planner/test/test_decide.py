"""From belt and bins to what is to be done."""

from __future__ import annotations

from dataclasses import replace

import pytest
from planner_cases import SMALL

from pack_msgs_py.codes import PlacementStatus, Reason
from pack_msgs_py.geometry.resting import rest_height_mm
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.decision.planner import (
    CloseStep,
    DecisionState,
    PlaceStep,
    Planner,
    PolicySettings,
    RejectStep,
    WaitStep,
    expected_bins,
    refreshed_target,
)
from pack_planner.decision.refusals import Forbidden
from pack_planner.decision.weights import WeightTable
from pack_planner.engine import EngineMismatch, Weights

EMPTY = Bin('bin-1', 1, SMALL, revision=4)


class Clock:
    """Each look at it costs a quarter of a second."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 0.25
        return self.now


@pytest.fixture
def planner():
    return Planner(PolicySettings('mpack_lite', PROFILES['paper']), Clock())


def state(boxes, *bins, forbidden=None):
    return DecisionState(tuple(boxes), bins or (EMPTY,), forbidden or Forbidden())


def block(height, name='block', size=(600, 400)):
    return PlacedBox(
        Box(name, (float(size[0]), float(size[1]), float(height))), (0, 0, 0), (*size, height)
    )


def test_a_decision_says_all_that_the_executor_needs(planner):
    box = Box('a', (195.0, 96.0, 47.0), 2.0)
    decision = planner.decide(state([box])).decision
    assert (decision.bin_id, decision.bin_serial, decision.bin_revision) == ('bin-1', 1, 4)
    assert (decision.corner_mm, decision.size_mm) == ((0, 0, 0), (200, 100, 50))
    assert decision.target.position == pytest.approx((0.1, 0.05, 0.0235))
    assert decision.objective == 5 + 100
    assert (decision.algorithm, decision.profile) == ('mpack_lite', 'paper')
    assert decision.status is PlacementStatus.OPTIMAL
    assert decision.planning_s == 0.25


def test_an_empty_belt_or_no_bin_is_waited_for(planner):
    assert isinstance(planner.decide(DecisionState((), (EMPTY,), Forbidden())), WaitStep)
    assert isinstance(
        planner.decide(DecisionState((Box('a', (1, 1, 1)),), (), Forbidden())), WaitStep
    )


def test_nothing_fits_closes_the_bin_with_the_highest_fill_rate(planner):
    low, high = Bin('low', 1, SMALL, (block(350),)), Bin('high', 2, SMALL, (block(380),))
    outcome = planner.decide(state([Box('a', (100.0, 100.0, 100.0))], low, high))
    assert isinstance(outcome, CloseStep) and outcome.target is high


def test_equally_full_bins_are_closed_oldest_first(planner):
    one = Bin('one', 1, SMALL, (block(380),))
    outcome = planner.decide(
        state([Box('a', (100.0, 100.0, 100.0))], one, replace(one, id='two', serial=2))
    )
    assert isinstance(outcome, CloseStep) and outcome.target is one


@pytest.mark.parametrize(
    ('box', 'reason', 'said'),
    [
        (Box('a', (700.0, 100.0, 100.0), 1.0), Reason.OVERSIZE, '700x100x100'),
        (Box('a', (100.0, 100.0, 100.0), 20.5), Reason.OVERWEIGHT, '20.5 kg'),
    ],
)
def test_a_box_that_fits_no_empty_bin_is_rejected_first(box, reason, said):
    planner = Planner(PolicySettings('mpack_lite', PROFILES['cell']), Clock())
    outcome = planner.decide(state([Box('good', (100.0, 100.0, 100.0)), box]))
    assert isinstance(outcome, RejectStep)
    assert outcome.decision.box.id == 'a'
    assert outcome.decision.status is PlacementStatus.REJECT
    assert outcome.decision.reject_reason is reason
    assert said in outcome.decision.reason


def test_a_box_that_only_the_orientation_rule_keeps_out_is_oversize():
    tall = Box('tall', (100.0, 100.0, 500.0))
    upright = replace(PROFILES['paper'], orientations='upright')
    assert isinstance(
        Planner(PolicySettings('mpack_lite', upright), Clock()).decide(state([tall])), RejectStep
    )
    assert isinstance(
        Planner(PolicySettings('mpack_lite', PROFILES['paper']), Clock()).decide(state([tall])),
        PlaceStep,
    )


def test_a_box_comes_to_rest_on_measured_tops_not_on_rounded_ones():
    below = replace(
        block(100), box=Box('below', (595.0, 395.0, 93.0)), measured_mm=(300.0, 200.0, 46.8)
    )
    placed = PlacedBox(Box('a', (100.0, 100.0, 50.0)), (0, 0, 100), (100, 100, 50))
    assert rest_height_mm(placed, (below,)) == pytest.approx(93.3)
    assert rest_height_mm(placed, (replace(below, measured_mm=None),)) == 100
    assert rest_height_mm(replace(placed, corner_mm=(0, 0, 0)), ()) == 0


def test_a_neighbour_that_shifted_under_the_footprint_is_not_stood_on():
    below = replace(block(100), measured_mm=(300.0, 200.0, 50.0))
    beside = PlacedBox(
        Box('beside', (100.0, 100.0, 200.0)), (100, 0, 100), (100, 100, 200),
        measured_mm=(148.0, 50.0, 200.0),
    )  # fmt: skip
    placed = PlacedBox(Box('a', (100.0, 100.0, 50.0)), (0, 0, 100), (100, 100, 50))
    assert rest_height_mm(placed, (below, beside)) == 100


def test_the_expected_bins_hold_the_box_where_it_will_come_to_rest(planner):
    decision = planner.decide(state([Box('a', (195.0, 96.0, 47.0))])).decision
    (expected,) = expected_bins((EMPTY,), decision)
    assert expected.revision == 5
    assert expected.boxes[0].measured_mm == pytest.approx((100.0, 50.0, 23.5))
    assert EMPTY.boxes == ()


def test_the_pose_of_a_plan_follows_the_box_below_as_measured(planner):
    full_plate = replace(block(100), measured_mm=(300.0, 200.0, 50.0))
    target = Bin('b', 1, SMALL, (full_plate,))
    decision = planner.decide(state([Box('a', (200.0, 100.0, 50.0))], target)).decision
    lower = replace(target, boxes=(replace(full_plate, measured_mm=(300.0, 200.0, 48.5)),))
    moved = refreshed_target(decision, lower)
    assert decision.target.position[2] - moved.target.position[2] == pytest.approx(0.0015)
    assert moved.corner_mm == decision.corner_mm


def test_settings_change_between_two_decisions(planner):
    box = Box('a', (150.0, 150.0, 150.0))
    planner.use(PolicySettings('mpack_lite', PROFILES['cell'], WeightTable(Weights(1, 1, 1))))
    decision = planner.decide(state([box])).decision
    assert (decision.profile, decision.size_mm) == ('cell', (160, 160, 150))
    with pytest.raises(ValueError, match='guess'):
        planner.use(PolicySettings('guess', PROFILES['cell']))
    assert planner.decide(state([box])).decision == replace(decision)


def test_a_placement_that_breaks_a_rule_never_leaves_the_planner(planner, monkeypatch):
    from pack_planner.algorithms import AlgorithmSpec, Choice
    from pack_planner.algorithms.registry import SPECS
    from pack_planner.engine import Candidate

    box = Box('a', (100.0, 100.0, 100.0))
    floating = PlacedBox(box, (0, 0, 50), (100, 100, 100))
    spec = AlgorithmSpec('mpack_lite', lambda problem: Choice(Candidate(floating, 0, 1.0)))
    monkeypatch.setitem(SPECS, 'mpack_lite', spec)
    with pytest.raises(EngineMismatch, match='support'):
        planner.decide(state([box]))
