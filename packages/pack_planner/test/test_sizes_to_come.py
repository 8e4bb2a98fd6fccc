"""What is known of the boxes to come, and for how much of it a bin has room."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import SMALL, Engines, coarse, random_bin, random_box

from pack_msgs_py.values import Bin, Box, PlacedBox, Walls
from pack_planner.algorithms import Problem
from pack_planner.algorithms.foresight import WEIGHTS
from pack_planner.algorithms.play_out import best_plan
from pack_planner.algorithms.sizes_to_come import SizesToCome
from pack_planner.algorithms.virtual_bins import Outlook
from pack_planner.engine.placements import all_spots

ENGINES = Engines(
    {
        'paper': coarse('paper', 10),
        'cell': coarse('cell', 10, orientations='any'),
        'dense': coarse('dense', 10, orientations='any'),
    }
)


def problem_of(engine, boxes, *bins):
    return Problem(engine, tuple(boxes), tuple(engine.model(target) for target in bins))


def block(name, size, corner=(0, 0, 0)):
    return PlacedBox(Box(name, tuple(float(edge) for edge in size)), corner, size)


@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(3, 16))
def test_a_size_has_room_where_some_place_of_it_is_allowed(name, seed, count):
    engine, rng = ENGINES[name], random.Random(seed)
    target = random_bin(engine, rng, count)
    boxes = [random_box(rng, f'{number}', high=300) for number in range(6)]
    sizes = SizesToCome(problem_of(engine, boxes, Bin('empty', 1, SMALL)), 0)
    model = engine.model(target)
    lost = [
        box.volume_mm3 for box in boxes if not len(all_spots(engine, box, model, far_ends=True))
    ]
    volume = sum(box.volume_mm3 for box in boxes)
    assert sizes.without_room(model) == pytest.approx(sum(lost) / volume)


def test_mixtures_have_the_length_of_one_the_breadth_of_another_the_height_of_a_third():
    engine = ENGINES['paper']
    small, large = Box('s', (200.0, 100.0, 50.0)), Box('l', (400.0, 300.0, 350.0))
    content = Bin('b', 1, SMALL, (block('block', (600, 400, 300)),))  # room for what is low
    problem = problem_of(engine, (small, large), Bin('empty', 2, SMALL))
    alone = SizesToCome(problem, 0).without_room(engine.model(content))
    assert alone == pytest.approx(large.volume_mm3 / (small.volume_mm3 + large.volume_mm3))
    # small's length and height with large's breadth finds room, and the other way round not
    low, high = 200 * 300 * 50, 400 * 100 * 350
    total = small.volume_mm3 + large.volume_mm3 + low + high
    mixed = SizesToCome(problem, 1).without_room(engine.model(content))
    assert mixed == pytest.approx((large.volume_mm3 + high) / total)


def test_boxes_that_came_last_into_the_bin_count_too():
    engine = ENGINES['dense']
    content = Bin('b', 1, SMALL, (block('flat', (600, 400, 250)),))
    low, full = Box('low', (100.0, 100.0, 100.0)), engine.model(content)
    of_bin = SizesToCome(problem_of(engine, (low,), content), 0).without_room(full)
    volume = content.boxes[0].box.volume_mm3
    assert of_bin == pytest.approx(volume / (volume + low.volume_mm3))


@pytest.mark.parametrize('seed', range(4))
def test_where_room_alone_counts_the_move_that_takes_least_of_it_is_made(seed):
    engine, rng = ENGINES['dense'], random.Random(seed)
    target, box = random_bin(engine, rng, 7), random_box(rng, 'new')
    problem = problem_of(engine, (box,), target)
    weights = replace(WEIGHTS, room=1e9)
    outlook = Outlook(problem, weights, 12)
    moves = outlook.bins[0].moves([0])[0]
    taken = {
        outlook.placed(move).corner_mm: outlook.bins[0].after(move).room_taken() for move in moves
    }
    chosen = best_plan(problem, weights, 12)
    assert taken[chosen.candidate.placed.corner_mm] == pytest.approx(min(taken.values()))
    assert outlook.bins[0].room_taken() == 0.0


def test_room_counts_only_where_walls_are_all_around():
    engine, rng = ENGINES['dense'], random.Random(5)
    target, box = random_bin(engine, rng, 12), random_box(rng, 'new', high=390)
    closed = {}
    for walls in Walls:
        problem = problem_of(engine, (box,), replace(target, spec=replace(SMALL, walls=walls)))
        closed[walls] = Outlook(problem, WEIGHTS, 3).bins[0].closed_to()
    assert closed[Walls.OPEN_FRONT] == closed[Walls.NONE] == 0.0 < closed[Walls.CLOSED]
