"""Our own algorithm: what it prefers, and that it packs better than MPackLite."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from planner_cases import SMALL, coarse, random_bin, random_box

from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.engine import Engine
from pack_planner.engine.placements import all_spots


def cube(name, edge):
    return Box(name, (float(edge), float(edge), float(edge)))


def placed(name, corner, size):
    return PlacedBox(Box(name, tuple(float(edge) for edge in size)), corner, size)


def decide(engine, boxes, *bins, **more):
    models = tuple(engine.model(target) for target in bins)
    return find_algorithm('rollout')(Problem(engine, tuple(boxes), models, **more))


def test_a_box_goes_where_it_fits_snugly(paper):
    # a slot of 120 mm between two blocks, and a lot of open floor behind them
    left, right = placed('l', (0, 0, 0), (240, 200, 300)), placed('r', (360, 0, 0), (240, 200, 300))
    choice = decide(paper, [Box('new', (120.0, 150.0, 140.0))], Bin('b', 1, SMALL, (left, right)))
    placement = choice.candidate.placed
    assert (placement.corner_mm[:2], placement.size_mm[0]) == ((240, 0), 120)


def test_a_first_move_is_judged_by_what_becomes_of_the_other_boxes(paper):
    # alone, the flat box touches most in the slot; but only there the tall one finds room
    walls = (
        placed('a', (0, 0, 0), (400, 400, 380)),
        placed('b', (520, 0, 0), (80, 400, 380)),
        placed('c', (400, 200, 0), (120, 200, 380)),
    )
    target = Bin('b', 1, SMALL, walls)
    tall, flat = Box('tall', (120.0, 200.0, 400.0)), Box('flat', (300.0, 200.0, 20.0))
    only = decide(paper, [tall, flat], target).candidate.placed
    done = replace(target, boxes=(*walls, only), revision=1)
    other = flat if only.box is tall else tall
    rest = decide(paper, [other], done)
    assert rest is not None, 'both find a place when the first leaves one'


def test_no_bin_is_closed_while_any_box_fits():
    """Where a rule varies between the candidate lines, a box may fit at none of them."""
    engine = Engine(coarse('paper', 10, min_vertices=0, com_margin_mm=45.0, orientations='upright'))
    # the box can only balance on a narrow tower in a pit, its centre over the tower's
    pit = placed('wall', (300, 0, 0), (300, 400, 400)), placed('t', (100, 0, 0), (100, 400, 200))
    target, box = Bin('b', 1, SMALL, pit), Box('new', (200.0, 400.0, 150.0))
    assert len(all_spots(engine, box, engine.model(target))) == 0
    assert decide(engine, [box], target).candidate.placed.corner_mm == (50, 0, 200)


def test_the_same_state_has_the_same_answer(cell):
    rng = random.Random(3)
    bins = [replace(random_bin(cell, rng, 6, f'bin-{i}'), serial=i) for i in (1, 2)]
    boxes = [random_box(rng, f'new-{i}') for i in range(5)]
    twin = Engine(PROFILES['cell'])
    assert decide(cell, boxes, *bins) == decide(twin, boxes, *bins)


def test_a_decision_ends_with_its_nodes_and_has_an_answer(cell):
    rng = random.Random(3)
    target = random_bin(cell, rng, 6)
    boxes = [random_box(rng, f'new-{i}', high=160) for i in range(5)]
    cut, whole = (decide(cell, boxes, target, node_limit=limit) for limit in (4, None))
    assert (cut.status, whole.status) == (PlacementStatus.BUDGET, PlacementStatus.OPTIMAL)
    assert cut == decide(cell, boxes, target, node_limit=4)
    assert 'of 1 plan ' in cut.reason and 'of 1 plan ' not in whole.reason
    late = decide(cell, boxes, target, budget_s=0.0)
    assert late.candidate == decide(cell, boxes, target, node_limit=0).candidate


def test_it_names_what_it_would_do_instead(cell):
    rng = random.Random(4)
    target, boxes = random_bin(cell, rng, 6, 'bin-1'), [random_box(rng, f'n-{i}') for i in range(4)]
    choice = decide(cell, boxes, target)
    every = (choice.candidate, *choice.others)
    assert len(choice.others) > 3 and len({str(other.placed) for other in every}) == len(every)
    for candidate in every:
        assert cell.broken_rules(candidate, target) == ''


def test_nothing_fits_is_no_answer(paper):
    full = Bin('b', 1, SMALL, (placed('block', (0, 0, 0), (600, 400, 350)),))
    assert decide(paper, [cube('a', 100), cube('b', 200)], full) is None


@pytest.mark.parametrize('profile', PROFILES)
def test_it_fills_bins_better_than_mpack_lite(profile):
    fills = {}
    for name in ('mpack_lite', 'rollout'):
        case = Case(name, parse_bin('SYN'), 5, 1, CollectionSource('SYN, cut from ten bins'))
        packed = pack_collection(case, BenchSettings(PROFILES[profile], boxes_per_bin=14), 0)
        fills[name] = packed.fills['fill_closed']
    assert fills['rollout'] > fills['mpack_lite'] + 2.0
