"""Our own algorithm for support by mechanics: more places to choose from, and fuller bins."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from conveyor_sim.streams import load_boxes
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin
from pack_planner import pack
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.algorithms.foresight import WEIGHTS, foresight
from pack_planner.engine import Engine

UPRIGHT = replace(PROFILES['dense'], orientations='upright')


def drawn(seed: int, count: int) -> list[Box]:
    rng, (boxes, _) = random.Random(seed), load_boxes('cartons')
    return [
        replace(rng.choice(boxes), id=str(number), size_stddev_mm=(2.0, 2.0, 2.0))
        for number in range(count)
    ]


@pytest.mark.slow
def test_it_fills_bins_better_than_rollout_where_stacks_stand_by_mechanics():
    fills = {
        name: pack(drawn(401, 150), 'LDC', name, 5, 2, UPRIGHT).finish().fill_closed
        for name in ('rollout', 'foresight')
    }
    assert fills['foresight'] > fills['rollout'] + 2.0


@pytest.mark.parametrize(('name', 'x_mm'), [('rollout', 300), ('foresight', 350)])
def test_it_knows_the_place_flush_with_the_far_wall(name, x_mm):
    """Beside a low box a tall one touches little, at the far wall it touches all of one side."""
    low = Box('low', (296.0, 396.0, 100.0), max_top_load_n=0.0)
    content = Bin('b', 1, parse_bin('60x40x40'), (PlacedBox(low, (0, 0, 0), (300, 400, 100)),))
    engine = Engine(UPRIGHT)
    tall = Box('tall', (246.0, 386.0, 300.0))
    choice = find_algorithm(name)(Problem(engine, (tall,), (engine.model(content),)))
    assert choice.candidate.placed.corner_mm == (x_mm, 0, 0)


@pytest.mark.parametrize(('late', 'first'), [(0.0, 'far'), (WEIGHTS.late, 'near')])
def test_of_two_plans_as_good_it_begins_with_the_box_that_needs_no_tray(late, first):
    """The large one, which must be tipped, has farther to come to the tray."""
    boxes = (Box('near', (300.0, 250.0, 190.0)), Box('far', (200.0, 300.0, 260.0)))
    engine = Engine(PROFILES['dense'])
    low = Bin('b', 1, parse_bin('80x60x20'))
    weights = replace(WEIGHTS, late=late)
    choice = foresight(Problem(engine, boxes, (engine.model(low),), weights=weights))
    assert choice.candidate.placed.box.id == first
