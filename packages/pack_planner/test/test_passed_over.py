"""No box waits for ever, whatever comes after it."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import engine_of, random_box

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.algorithms import BUILT_IN, Choice
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.policy import DecisionState, PassedOver, PolicySettings, due, next_step

SPEC = BinSpec('40x30x30', (400, 300, 300))
PAPER = PROFILES['paper']
LARGE_BOX, SMALL_BOX = (300.0, 200.0, 200.0), (100.0, 100.0, 50.0)


def boxes(count):
    return tuple(Box(f'box-{i}', (1.0, 1.0, 1.0)) for i in range(count))


def longest_wait(stream, limit, look_ahead, algorithm='mpack_lite', open_bins=1, **options):
    """Pack a stream; the most decisions in which one box on offer was passed over."""
    choose = PolicySettings(
        algorithm, PROFILES['paper'], node_limit=200,
        options=DecisionOptions(max_passed_over=limit, **options),
    )  # fmt: skip
    waiting, counter, waits = list(stream), PassedOver(), {}
    bins = [Bin(f'bin-{i}', i, SPEC) for i in range(1, open_bins + 1)]
    serial = open_bins
    while waiting:
        offered = tuple(waiting[:look_ahead])
        waits.update({box.id: count for box, count in zip(
            offered, counter.of(offered), strict=True)})  # fmt: skip
        step = next_step(
            choose,
            engine_of(PAPER),
            DecisionState(offered, tuple(bins), passed_over=counter.of(offered)),
        )
        assert step is not None
        if isinstance(step, Choice):
            placed, index = step.candidate.placed, step.candidate.bin_index
            old = bins[index]
            bins[index] = Bin(
                old.id, old.serial, SPEC, (*old.boxes, placed), revision=old.revision + 1
            )
            counter.take(placed.box, offered)
            waiting.remove(placed.box)
        else:
            serial += 1
            bins.remove(step)
            bins.append(Bin(f'bin-{serial}', serial, SPEC))
    return max(waits.values())


#: Large boxes first, and then for a long time small ones, which always cost less.
SPITEFUL = [Box(f'large-{i}', LARGE_BOX) for i in range(3)] + [
    Box(f'small-{i}', SMALL_BOX) for i in range(40)
]


def test_without_a_limit_a_large_box_waits_as_long_as_small_ones_come():
    assert longest_wait(SPITEFUL, 0, 4) > 15


@pytest.mark.parametrize('limit', [3, 6, 12])
@pytest.mark.parametrize('algorithm', ['mpack_lite', 'o_first_fit', 'mpack'])
def test_no_box_is_passed_over_more_often_than_the_limit_says(algorithm, limit):
    assert longest_wait(SPITEFUL, limit, 4, algorithm) <= limit


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6), look_ahead=st.integers(1, 6), limit=st.integers(1, 8),
    selection=st.sampled_from(['least_increase', 'least_growth', 'largest', 'large_when_empty']),
    open_bins=st.integers(1, 2),
)  # fmt: skip
def test_the_limit_holds_on_any_stream(seed, look_ahead, limit, selection, open_bins):
    rng = random.Random(seed)
    drawn = [random_box(rng, f'box-{i}', high=260) for i in range(20)]
    stream = [box for box in drawn if engine_of(PAPER).fits_empty_bin(box, SPEC)]
    worst = longest_wait(stream, limit, look_ahead, open_bins=open_bins, selection=selection)
    assert worst <= max(limit, look_ahead - 1)


@pytest.mark.parametrize('algorithm', BUILT_IN)
def test_a_box_that_is_due_is_next_for_every_algorithm(algorithm):
    choose = PolicySettings(
        algorithm, PROFILES['paper'], options=DecisionOptions(max_passed_over=5)
    )
    offered = (Box('a', SMALL_BOX), Box('due', LARGE_BOX), Box('b', SMALL_BOX))
    step = next_step(
        choose,
        engine_of(PAPER),
        DecisionState(offered, (Bin('b', 1, SPEC),), passed_over=(1, 5, 0)),
    )
    assert step.candidate.placed.box.id == 'due'


def test_a_bin_is_closed_for_a_box_that_is_due_though_others_would_fit():
    large, half = Box('due', LARGE_BOX), Bin('b', 1, SPEC)
    choose = PolicySettings(
        'mpack_lite', PROFILES['paper'], options=DecisionOptions(max_passed_over=5)
    )
    first = next_step(choose, engine_of(PAPER), DecisionState((Box('first', LARGE_BOX),), (half,)))
    half = Bin('b', 1, SPEC, (first.candidate.placed,), revision=1)
    offered = (Box('a', SMALL_BOX), large)
    assert isinstance(
        next_step(choose, engine_of(PAPER), DecisionState(offered, (half,), passed_over=(0, 4))),
        Choice,
    )
    assert (
        next_step(choose, engine_of(PAPER), DecisionState(offered, (half,), passed_over=(0, 5)))
        == half
    )


def test_boxes_that_are_due_together_are_seen_to_in_time():
    offered = boxes(4)
    assert due(offered, (0, 0, 0, 0), 3) == offered
    # two that may wait once more: one of them must go now, the other then
    assert due(offered, (0, 4, 0, 4), 5) == (offered[1], offered[3])
    assert due(offered, (0, 4, 0, 5), 5) == (offered[3],)
    assert due(offered, (0, 9, 0, 5), 5) == (offered[1],)


def test_no_limit_or_no_count_offers_all():
    offered = boxes(3)
    assert due(offered, (9, 9, 9), 0) == offered
    assert due(offered, (), 2) == offered
