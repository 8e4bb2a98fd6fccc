"""OPack and MPackLite on hand-made cases, after sections III-A.3, III-B and III-C of the paper."""

from __future__ import annotations

import random

import pytest
from planner_cases import SMALL, random_bin, random_box

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.algorithms.mpack_lite import least_objective, mpack_lite
from pack_planner.algorithms.opack import by_volume, opack
from pack_planner.engine import Engine, Weights

EMPTY = Bin('bin-1', 1, SMALL)


def cube(name, edge):
    return Box(name, (float(edge), float(edge), float(edge)))


def solve(engine, boxes, *bins, algorithm=mpack_lite):
    models = tuple(engine.model(target) for target in bins or (EMPTY,))
    return algorithm(Problem(engine, tuple(boxes), models))


def placed(name, corner, size):
    return PlacedBox(Box(name, tuple(float(edge) for edge in size)), corner, size)


def test_boxes_are_sorted_by_volume_then_height_then_belt():
    flat, tall = Box('flat', (200, 200, 100)), Box('tall', (200, 100, 200))
    twin = Box('twin', (200, 100, 200))
    assert [box.id for box in by_volume([flat, cube('large', 300), tall, twin])] == [
        'large', 'tall', 'twin', 'flat',
    ]  # fmt: skip


def test_the_largest_box_is_placed_first_even_when_a_smaller_one_is_nearer(paper):
    visited = []

    def rule(engine, box, bins, forbidden):
        visited.append(box.id)
        return least_objective(engine, box, bins, forbidden)

    solve(
        paper,
        [cube('small', 100), cube('large', 300)],
        algorithm=lambda problem: opack(problem, rule),
    )
    assert visited == ['large', 'small']


def test_each_virtual_placement_sees_those_before_it(paper):
    seen = []

    def rule(engine, box, bins, forbidden):
        seen.append([len(model.boxes) for model in bins])
        return least_objective(engine, box, bins, forbidden)

    boxes = [cube(f'box-{i}', 200) for i in range(3)]
    solve(paper, boxes, algorithm=lambda problem: opack(problem, rule))
    assert seen == [[0], [1], [2]]


def test_the_box_of_least_increase_is_chosen_not_the_first(paper):
    """Large takes the corner, 30 cm high; beside it small would cost 30 + 10 = 40 > 30."""
    choice = solve(paper, [cube('small', 100), cube('large', 300)])
    assert choice.candidate.placed.box.id == 'large'
    # beside a plate that leaves the corner to the small box alone, small is the cheaper one
    plate = placed('plate', (200, 0, 0), (400, 400, 50))
    choice = solve(paper, [cube('small', 100), cube('large', 300)], Bin('b', 1, SMALL, (plate,)))
    assert choice.candidate.placed.box.id == 'small'
    assert paper.increase(choice.candidate.placed) == 10.0


def test_a_box_that_would_stand_on_a_virtual_one_is_not_chosen():
    """With height for free, small costs least across plate and large, but large is not there."""
    engine = Engine(PROFILES['paper'], Weights(1.0, 0.0, 0.0))
    target = Bin('b', 1, SMALL, (placed('plate', (0, 0, 0), (100, 400, 100)),))
    large, small = Box('large', (500, 400, 100)), cube('small', 200)
    start = engine.model(target)
    first = engine.best_placement(large, [start])
    across = engine.best_placement(small, [engine.with_box(start, first.placed)])
    assert across.placed.corner_mm == (0, 0, 100)
    assert engine.increase(across.placed) < engine.increase(first.placed)
    assert not engine.stands(across.placed, start)
    assert solve(engine, [small, large], target).candidate.placed == first.placed


def test_older_bins_come_first_until_their_position_costs_more_than_the_index():
    older = Bin('bin-1', 1, SMALL, (placed('low', (0, 0, 0), (600, 400, 90)),))
    newer = Bin('bin-2', 2, SMALL)
    for w3, expected in ((100.0, 0), (1.0, 1)):
        engine = Engine(PROFILES['paper'], Weights(1.0, 1.0, w3))
        choice = solve(engine, [cube('a', 100)], older, newer)
        assert choice.candidate.bin_index == expected


def test_a_box_that_fits_nowhere_does_not_stop_the_others(paper):
    low_room = Bin('b', 1, SMALL, (placed('block', (0, 0, 0), (600, 400, 250)),))
    choice = solve(paper, [cube('large', 300), cube('small', 100)], low_room)
    assert choice.candidate.placed.box.id == 'small'


def test_no_answer_when_nothing_fits(paper):
    full = Bin('b', 1, SMALL, (placed('block', (0, 0, 0), (600, 400, 350)),))
    assert solve(paper, [cube('a', 100), cube('b', 200)], full) is None


def test_with_one_box_mpack_lite_is_the_exact_argmin(cell):
    rng = random.Random(11)
    for _ in range(20):
        target = random_bin(cell, rng, 6)
        box = random_box(rng, 'new')
        choice = solve(cell, [box], target)
        best = cell.best_placement(box, [cell.model(target)])
        assert (None if choice is None else choice.candidate) == best


@pytest.mark.parametrize('profile', PROFILES)
def test_mpack_lite_gives_the_same_answer_twice(profile):
    rng = random.Random(5)
    engine, other = Engine(PROFILES[profile]), Engine(PROFILES[profile])
    bins = tuple(random_bin(engine, rng, 5, f'bin-{i}') for i in (1, 2))
    boxes = tuple(random_box(rng, f'new-{i}') for i in range(5))
    assert solve(engine, boxes, *bins) == solve(other, boxes, *bins)


def test_an_unknown_algorithm_is_named_with_the_known_ones():
    with pytest.raises(ValueError, match=r'best_guess.*mpack_lite'):
        find_algorithm('best_guess')
