"""What the planner remembers of what the arm refused, and what it offers instead."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from planner_cases import SMALL
from test_decide import EMPTY, block, state

from pack_msgs_py.cell_values import Decision, Scan, ScannedBox
from pack_msgs_py.codes import ErrorCode, Reason
from pack_msgs_py.geometry.pose import Pose, about_z
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box
from pack_planner.coordination.alternatives import planned, quick
from pack_planner.coordination.answers import CheckAnswer
from pack_planner.coordination.negotiation import learn
from pack_planner.decision.planner import CloseStep, PlaceStep, Planner, PolicySettings, RejectStep
from pack_planner.decision.refusals import (
    PREDICTIONS_PER_TRY,
    TRIES_IN_EMPTY_BIN,
    TRIES_PER_BOX,
    TRIES_PER_CONTENT,
    Refusals,
)
from pack_planner.engine.engine import REFUSED_RADIUS_MM


@pytest.fixture
def planner():
    return Planner(PolicySettings('mpack_lite', PROFILES['paper']), lambda: 0.0)


def refused(target, box_id, *corners, code=ErrorCode.RULE_VIOLATION, size=(100.0, 100.0, 100.0)):
    memory = Refusals()
    for corner in corners:
        decision = Decision(Box(box_id, size, 5.0), target.id, corner_mm=corner)
        lasting = code is ErrorCode.DEADLINE_UNREACHABLE
        memory.learn(target, decision, code, lasting=lasting)
    return memory


def test_a_refused_box_goes_at_least_four_centimetres_away(planner):
    box = Box('a', (100.0, 100.0, 100.0))
    memory = refused(EMPTY, 'a', (0, 0, 0))
    decision = planner.decide(state([box], forbidden=memory.snapshot())).decision
    assert decision.corner_mm == (REFUSED_RADIUS_MM, 0, 0)


SIX = [(x, y, 0) for x in (0, 100, 200) for y in (0, 100)]


#: Every tenth centimetre of the floor, and every fifth along x.
FLOOR = [(x, y, 0) for x in range(0, 501, 100) for y in range(0, 301, 100)]
MANY = [*FLOOR, *((x + 50, y, 0) for x, y, _ in FLOOR[:6])]


def test_a_box_is_offered_far_from_six_refused_places_of_an_empty_bin(planner):
    box = Box('a', (100.0, 100.0, 100.0))
    memory = refused(EMPTY, 'a', *SIX, code=ErrorCode.DEADLINE_UNREACHABLE)
    outcome = planner.decide(state([box], forbidden=memory.snapshot()))
    assert isinstance(outcome, PlaceStep)
    assert outcome.decision.corner_mm not in SIX


def test_a_box_refused_thirty_times_in_an_empty_bin_is_unreachable(planner):
    assert len(MANY) == TRIES_IN_EMPTY_BIN
    box = Box('a', (20.0, 20.0, 20.0))
    memory = refused(EMPTY, 'a', *MANY, size=box.size_mm)
    outcome = planner.decide(state([box], forbidden=memory.snapshot()))
    assert isinstance(outcome, RejectStep)
    assert outcome.decision.reject_reason is Reason.UNREACHABLE
    other = Bin('bin-2', 2, SMALL)
    outcome = planner.decide(state([box], EMPTY, other, forbidden=memory.snapshot()))
    assert isinstance(outcome, PlaceStep) and outcome.decision.bin_id == 'bin-2'


STATION_C = replace(EMPTY, id='far', serial=9, station='C')
LEFT = Bin('near', 2, SMALL, (block(400),), 'A', revision=2)


def test_a_box_out_of_reach_at_one_station_waits_for_an_empty_bin_at_another(planner):
    box = Box('a', (100.0, 100.0, 100.0))
    known = refused(STATION_C, 'a', *MANY, code=ErrorCode.DEADLINE_UNREACHABLE).snapshot()
    # At A there is no room left; an empty bin there may be within reach.
    outcome = planner.decide(state([box], LEFT, STATION_C, forbidden=known))
    assert isinstance(outcome, CloseStep) and outcome.target == LEFT
    # Another box that fits goes first.
    other = Box('b', (100.0, 100.0, 100.0))
    outcome = planner.decide(state([box, other], LEFT, STATION_C, forbidden=known))
    assert isinstance(outcome, PlaceStep) and outcome.decision.box.id == 'b'


def test_a_box_out_of_reach_at_every_station_or_too_heavy_for_the_arm_is_rejected(planner):
    box = Box('a', (100.0, 100.0, 100.0))
    memory = refused(STATION_C, 'a', *MANY, code=ErrorCode.DEADLINE_UNREACHABLE)
    empty = Bin('near', 2, SMALL, (), 'A')
    for corner in MANY:
        decision = Decision(box, empty.id, corner_mm=corner)
        memory.learn(empty, decision, ErrorCode.NO_IK_SOLUTION)
    outcome = planner.decide(state([box], empty, STATION_C, forbidden=memory.snapshot()))
    assert isinstance(outcome, RejectStep)
    heavy = refused(STATION_C, 'a', *SIX, code=ErrorCode.LIMITS_EXCEEDED).snapshot()
    assert isinstance(planner.decide(state([box], LEFT, STATION_C, forbidden=heavy)), RejectStep)


def test_when_everything_is_refused_the_fullest_bin_is_closed(planner):
    target = Bin('b', 1, SMALL, (block(100),), revision=2)
    memory = refused(target, 'a', *((x, y, 100) for x, y, _ in SIX))
    box = Box('a', (100.0, 100.0, 100.0))
    outcome = planner.decide(state([box], target, forbidden=memory.snapshot()))
    assert isinstance(outcome, CloseStep) and outcome.target == target


def test_before_a_bin_is_closed_everything_is_offered_that_was_not_refused_itself(planner):
    target = Bin('b', 1, SMALL, (block(100),), revision=2)
    box = Box('a', (100.0, 100.0, 100.0))
    known = refused(target, 'a', *((x, y, 100) for x, y, _ in SIX)).snapshot()
    offered = []
    while True:
        offer = planned(planner.decide, planner.decide, state([box], target, forbidden=known), 1)
        if isinstance(offer.outcome, CloseStep):
            break
        decision = offer.outcome.decision
        offered.append(decision.corner_mm)
        known = known.plus(target, decision)
    far = lambda a, b: max(abs(a[0] - b[0]), abs(a[1] - b[1])) >= REFUSED_RADIUS_MM  # noqa: E731
    assert len(offered) > 20 and known.leaves_out
    assert all(far(a, b) for a, b in itertools.combinations(offered, 2))
    # What is left is near a place that was refused, wherever on the grid.
    places = [*offered, *(zone.corner_mm for zone in known.refused(box, target))]
    for x, y in itertools.product(range(0, 501, 10), range(0, 301, 10)):
        assert not all(far((x, y), place) for place in places)


def test_what_is_only_predicted_counts_less():
    target = Bin('b', 1, SMALL, (block(100),), revision=2)
    box, memory = Box('a', (20.0, 20.0, 20.0)), Refusals()
    places = itertools.product(range(0, 501, 50), range(0, 301, 50))
    for number, (x, y) in enumerate(places, 1):
        decision = Decision(box, target.id, corner_mm=(x, y, 100))
        memory.learn(target, decision, ErrorCode.NO_IK_SOLUTION, predicted=True)
        left_out = memory.snapshot((target,))(box, target) is None
        assert left_out == (number >= TRIES_PER_BOX * PREDICTIONS_PER_TRY)
    assert memory.snapshot((target,)).to_the_last()(box, target) is not None


def test_a_refusal_also_holds_in_the_bin_as_virtual_packing_goes_on():
    snapshot = refused(EMPTY, 'a', (0, 0, 0)).snapshot()
    box = Box('a', (100.0, 100.0, 100.0))
    packed_virtually = replace(EMPTY, boxes=(block(100),), revision=EMPTY.revision + 1)
    assert snapshot(box, packed_virtually) == snapshot(box, EMPTY) != ()
    assert snapshot(Box('b', box.size_mm), packed_virtually) == ()


def test_refusals_are_forgotten_when_the_bin_changes():
    memory = refused(EMPTY, 'a', (0, 0, 0))
    memory.forget_old((EMPTY,))
    assert memory.snapshot().by_bin
    memory.forget_old((replace(EMPTY, revision=5),))
    assert not memory.snapshot().by_bin


def test_what_no_path_leads_to_is_refused_as_long_as_the_bin_stands():
    memory = refused(EMPTY, 'a', (0, 0, 0), code=ErrorCode.PATH_IN_COLLISION)
    grown = replace(EMPTY, revision=9)
    memory.forget_old((grown,))
    assert memory.snapshot((grown,)).refused(Box('a', (100.0, 100.0, 100.0)), grown)
    memory.forget_old((Bin('another', 2, SMALL),))
    assert memory.snapshot().by_bin == {}


def test_a_hole_too_narrow_for_one_box_is_not_offered_to_a_wider_one():
    memory = refused(EMPTY, 'a', (200, 100, 0), code=ErrorCode.PATH_IN_COLLISION)
    snapshot = memory.snapshot((EMPTY,))
    wider, narrower = Box('w', (140.0, 120.0, 50.0)), Box('n', (90.0, 90.0, 50.0))
    corners = {zone.orientation: zone.corner_mm for zone in snapshot(wider, EMPTY)}
    assert corners['xyz'] == (180, 90, 0)
    assert snapshot(narrower, EMPTY) == ()


@pytest.mark.parametrize(
    ('x', 'yaw', 'odd'),
    [(0.0, 0.0, False), (0.01, 0.02, False), (0.05, 0.0, True), (0.0, 0.5, True)],
)
def test_what_is_refused_to_a_box_that_lies_oddly_is_open_to_others_and_later(x, yaw, odd):
    box = Box('a', (300.0, 200.0, 100.0), 5.0)
    at = Pose((x, 0.65, 0.8), about_z(yaw))
    scan = Scan(1, 10.0, (ScannedBox(box, at, pick_open_s=9.0),))
    decision = Decision(box, EMPTY.id, corner_mm=(0, 0, 0))
    answer = CheckAnswer(ErrorCode.PATH_IN_COLLISION)
    memory = Refusals()
    learn(memory, (EMPTY,), [decision], [answer], 5.5, scan)
    wider = Box('b', (400.0, 300.0, 100.0), 5.0)
    assert memory.snapshot()(box, EMPTY)  # that box is not offered there at once again
    assert bool(memory.snapshot()(wider, EMPTY)) is not odd
    memory.forget_old((replace(EMPTY, revision=EMPTY.revision + 1),))
    assert bool(memory.snapshot()(box, EMPTY)) is not odd


def test_a_way_too_long_for_one_box_is_not_offered_to_a_heavier_one():
    memory = refused(EMPTY, 'a', (200, 100, 0), code=ErrorCode.DEADLINE_UNREACHABLE)
    snapshot = memory.snapshot((EMPTY,))
    heavier, lighter = Box('h', (90.0, 90.0, 50.0), 7.0), Box('l', (300.0, 300.0, 50.0), 2.0)
    assert snapshot(heavier, EMPTY) != ()
    assert snapshot(lighter, EMPTY) == ()


def test_a_placement_that_only_the_asking_made_late_is_offered_once_more():
    memory = Refusals()
    decision = Decision(Box('a', (100.0, 100.0, 100.0)), EMPTY.id, candidates_checked=1)
    memory.learn(EMPTY, decision, ErrorCode.DEADLINE_UNREACHABLE)
    assert memory.snapshot().by_bin == {}
    memory.learn(EMPTY, decision, ErrorCode.DEADLINE_UNREACHABLE)
    assert memory.snapshot().by_bin != {}


def test_a_box_too_slow_at_six_places_is_not_offered_to_that_bin_again():
    memory = refused(EMPTY, 'a', *SIX, code=ErrorCode.DEADLINE_UNREACHABLE)
    grown = replace(EMPTY, revision=9, boxes=(block(100),))
    memory.forget_old((grown,))
    assert memory.snapshot((grown,))(Box('a', (100.0, 100.0, 100.0)), grown) is None


def test_a_full_bin_in_which_the_arm_refused_thirty_placements_is_left_alone():
    target = Bin('b', 1, SMALL, (block(100),), revision=2)
    memory = Refusals()
    for number in range(TRIES_PER_CONTENT):
        other = Decision(Box(f'box {number}', (100.0, 100.0, 100.0)), target.id)
        memory.learn(target, other, ErrorCode.NO_IK_SOLUTION)
    box = Box('new', (100.0, 100.0, 100.0))
    assert memory.snapshot((target,))(box, target) is None
    grown = replace(target, revision=3)
    memory.forget_old((grown,))
    assert memory.snapshot((grown,))(box, grown) == ()


def test_refusals_for_what_did_not_come_about_are_forgotten():
    expected = replace(EMPTY, revision=EMPTY.revision + 1)
    memory = refused(expected, 'a', (0, 0, 0), code=ErrorCode.PATH_IN_COLLISION)
    memory.forget_expected((EMPTY,))
    assert memory.snapshot((EMPTY,)).by_bin == {}


def test_alternatives_keep_away_from_each_other_and_come_best_first(planner):
    box = Box('a', (100.0, 100.0, 100.0))
    offer = planned(planner.decide, planner.decide, state([box]), 4)
    corners = [first.corner_mm for first in offer.candidates()]
    objectives = [first.objective for first in offer.candidates()]
    assert len(corners) == 4 and objectives == sorted(objectives)
    for first, other in itertools.combinations(offer.candidates(), 2):
        apart = max(abs(a - b) for a, b in zip(first.corner_mm, other.corner_mm, strict=True))
        assert first.orientation != other.orientation or apart >= REFUSED_RADIUS_MM


def test_alternatives_of_mpack_come_from_mpack_lite():
    settings = PolicySettings('mpack', PROFILES['cell'], backend='milp')
    assert (quick(settings).algorithm, quick(settings).backend) == ('mpack_lite', 'search')
    assert quick(replace(settings, algorithm='dbl')).algorithm == 'dbl'
