"""A bin that is closed says why: what kept each box out, and what the arm had to do with it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from coordinator_rig import EMPTY, CoordinatorRig
from planner_cases import SMALL, engine_of

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.closing import Cause
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.coordination.negotiation import MARGIN_S
from pack_planner.decision.closing_causes import ClosingCauses
from pack_planner.decision.planner import CloseStep
from pack_planner.decision.policy import DecisionState
from pack_planner.decision.refusals import Refusals

SLOW, NO_PATH = ErrorCode.DEADLINE_UNREACHABLE, ErrorCode.PATH_IN_COLLISION
PROFILE = replace(
    PROFILES['dense'],
    orientations='upright',
    clearance_mm=0.0,
    size_sigmas=0.0,
    max_bin_weight_kg=100.0,
)


def block(length, breadth, height, corner=(0, 0, 0), **more):
    """A box that fills this space."""
    size = (length, breadth, height)
    box = Box(f'block {corner} {size}', tuple(map(float, size)), **more)
    return PlacedBox(box, corner, size)


def cube(name='a', edge=100.0, **more):
    return Box(name, (edge, edge, edge), **more)


def bin_of(*boxes, name='bin-1', **more):
    return Bin(name, 1, SMALL, boxes, 'A', len(boxes), **more)


#: What is in the bin, the box on offer, and what keeps it out.
CASES = {
    'to the rim': (bin_of(block(600, 400, 350)), cube(), Cause.TOO_HIGH),
    'a post in the middle': (
        bin_of(block(60, 60, 200, (270, 170, 0))), cube(edge=390.0), Cause.TOO_HIGH
    ),
    'stands on a small top only': (
        bin_of(block(60, 60, 200, (0, 0, 0))), Box('a', (600.0, 400.0, 200.0)), Cause.NO_SUPPORT
    ),
    'may carry nothing': (
        bin_of(block(600, 400, 200, max_top_load_n=0.0)), cube(), Cause.TOP_LOAD
    ),
    'weighs enough': (bin_of(block(600, 400, 20, weight_kg=99.5)), cube(), Cause.BIN_WEIGHT),
    'serves somebody else': (
        bin_of(block(60, 60, 60), destination='D1'), cube(destination='D2'), Cause.DESTINATION
    ),
    'has room': (bin_of(block(60, 60, 60)), cube(), Cause.OVERLOOKED),
}  # fmt: skip


@pytest.mark.parametrize('name', CASES)
def test_the_cause_is_the_rule_without_which_the_box_would_have_a_place(name):
    target, box, cause = CASES[name]
    causes = ClosingCauses(PROFILE).of(engine_of(PROFILE), DecisionState((box,), (target,)))
    assert causes == {cause: 1}


@pytest.mark.parametrize(
    ('codes', 'cause'),
    [((SLOW,), Cause.TOO_SLOW), ((NO_PATH,), Cause.REFUSED), ((SLOW, NO_PATH), Cause.REFUSED)],
)
def test_a_box_that_only_the_arm_refuses_is_told_apart_by_what_the_arm_said(codes, cause):
    target, box, refusals = bin_of(block(600, 400, 300)), cube(), Refusals()
    for code in codes:
        for x in range(0, 600, 50):
            for y in range(0, 400, 50):
                decision = Decision(box, target.id, 1, 1, 'xyz', (x, y, 300), (100, 100, 100))
                refusals.learn(target, decision, code, lasting=True)
    state = DecisionState((box,), (target,), refusals.snapshot((target,)))
    assert ClosingCauses(PROFILE).of(engine_of(PROFILE), state) == {cause: 1}


@pytest.fixture
def rig():
    cell = CoordinatorRig(candidates=8, timeout_s=0.4, deadline_s=5.5)
    cell.bins()
    cell.scan()
    cell.beat()
    return cell


def closed(rig, **causes):
    """Have the bin closed; the reason that went out before the swap."""
    rig.outcome(CloseStep(EMPTY, causes={Cause[name]: number for name, number in causes.items()}))
    assert rig.take()[-1] == ('swap', 'bin-1')
    [reason] = rig.reasons
    return reason


def test_the_reason_counts_what_the_arm_was_asked_in_that_bin_and_advises_what_would_do(rig):
    rig.planned('a')
    rig.answer(NO_PATH)
    rig.planned('a', (200, 0, 0), (0, 200, 0))
    rig.answer(7.3, 9.9)
    reason = closed(rig, TOO_HIGH=1, TOO_SLOW=1)
    assert (reason.boxes, reason.asked, reason.refused) == (2, 3, {NO_PATH: 1, SLOW: 2})
    assert reason.deadline_s - 0.5 < 7.3 + MARGIN_S <= reason.deadline_s
    assert reason.text == (
        'nothing fits: 1 of 2 boxes too high, 1 refused by the arm for the time; '
        'arm refused 3 of 3 places, 2 for time, 1 without a free path: try --deadline 7.5'
    )


def test_no_deadline_is_advised_when_time_keeps_no_box_out(rig):
    rig.planned('a')
    rig.answer(7.3)
    reason = closed(rig, TOO_HIGH=2)
    assert reason.deadline_s == 0.0
    assert (
        reason.text
        == 'nothing fits: 2 of 2 boxes too high; arm refused 1 of 1 places, all for time'
    )


def test_no_number_is_advised_for_places_that_the_arm_saw_in_an_earlier_content(rig):
    rig.planned('a')
    rig.answer(7.3)
    rig.bins(replace(EMPTY, revision=5))
    rig.outcome(CloseStep(rig.bins_now[0], causes={Cause.TOO_SLOW: 1}))
    rig.outcome(CloseStep(rig.bins_now[0], causes={Cause.TOO_SLOW: 1}))
    [reason] = rig.reasons
    assert reason.deadline_s == 0.0
    assert reason.text.endswith('all for time: try a longer --deadline')


def test_what_the_arm_said_of_a_bin_that_is_gone_is_forgotten(rig):
    rig.planned('a')
    rig.answer(NO_PATH)
    rig.bins(replace(EMPTY, id='bin-2', serial=2))
    rig.bins(EMPTY)
    assert closed(rig, TOO_HIGH=2).asked == 0
