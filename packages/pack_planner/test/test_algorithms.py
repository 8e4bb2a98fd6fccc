"""Every algorithm, under every profile, with every look-ahead and number of open bins."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from planner_cases import SMALL, Engines, random_box

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms import BUILT_IN, Problem, find_algorithm
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.policy import DecisionState, PolicySettings, next_step
from pack_planner.engine import Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM

ENGINES = Engines(PROFILES)
TINY = BinSpec('40x30x30', (400, 300, 300))
NEAREST_ONLY = ['first_fit', 'best_fit', 'dbl', 'lsah', 'heightmap_min', 'online_bph', 'walle',
                'floor_building', 'column_building', 'best_short_side_fit']  # fmt: skip


def pack(name, engine, boxes, look_ahead, open_bins, spec=SMALL, options=None):
    """Pack ``boxes`` in order; a bin is closed when nothing fits."""
    settings = PolicySettings(
        name, engine.profile, node_limit=100, options=options or DecisionOptions()
    )
    bins = [Bin(f'bin-{i}', i, spec) for i in range(1, open_bins + 1)]
    closed, waiting, order = [], list(boxes), []
    while waiting:
        step = next_step(settings, engine, DecisionState(tuple(waiting[:look_ahead]), tuple(bins)))
        assert step is not None, 'a box that fits an empty bin was placed nowhere'
        if isinstance(step, Bin):
            bins.remove(step)
            closed.append(step)
            serial = len(closed) + open_bins
            bins.append(Bin(f'bin-{serial}', serial, spec))
            continue
        placed, index = step.candidate.placed, step.candidate.bin_index
        assert step.candidate.objective == engine.objective(placed, index)
        assert placed.box in waiting[:look_ahead]
        waiting.remove(placed.box)
        order.append(placed.box.id)
        target = bins[index]
        bins[index] = replace(target, boxes=(*target.boxes, placed), revision=target.revision + 1)
    return [*closed, *bins], order


def any_way_up(rng, count):
    return [replace(random_box(rng, f'box-{i}', low=100), allowed_up=63) for i in range(count)]


def small_stream(profile, seed, count):
    """Boxes of a tenth of the bin and less, some that fit only one way up."""
    rng = random.Random(seed)
    drawn = [random_box(rng, f'box-{i}', low=80, high=220) for i in range(count)]
    boxes = [box for box in drawn if ENGINES[profile].fits_empty_bin(box, TINY)]
    assert len(boxes) > count * 2 // 3
    return boxes


@pytest.mark.parametrize('open_bins', [1, 2, 3])
@pytest.mark.parametrize('look_ahead', [1, 2, 5, 6])
@pytest.mark.parametrize('profile', PROFILES)
@pytest.mark.parametrize('name', BUILT_IN)
def test_every_placement_obeys_the_rules(name, profile, look_ahead, open_bins):
    boxes = small_stream(profile, f'{profile}{look_ahead}{open_bins}', 15)
    bins, order = pack(name, ENGINES[profile], boxes, look_ahead, open_bins, TINY)
    assert sorted(order) == sorted(box.id for box in boxes)
    assert validate_bins(bins, PROFILES[profile]) == []


@pytest.mark.parametrize('options', [
    DecisionOptions(cep=True), DecisionOptions(sort='arrival', selection='nearest'),
    DecisionOptions(sort='area', selection='largest', closing='oldest'),
    DecisionOptions(sort='height', selection='large_when_empty', closing='least_useful'),
    DecisionOptions(max_passed_over=5, selection='largest', cep=True),
], ids=lambda rules: f'{rules.sort}-{rules.selection}-{rules.closing}-{rules.cep}')  # fmt: skip
@pytest.mark.parametrize('profile', PROFILES)
@pytest.mark.parametrize('name', [name for name in BUILT_IN if name not in NEAREST_ONLY])
def test_every_placement_obeys_the_rules_whatever_the_options(name, profile, options):
    boxes = small_stream(profile, f'{profile}{options}', 18)
    bins, order = pack(name, ENGINES[profile], boxes, 4, 2, TINY, options)
    assert sorted(order) == sorted(box.id for box in boxes)
    assert validate_bins(bins, PROFILES[profile]) == []


@pytest.mark.parametrize('name', NEAREST_ONLY)
def test_heuristics_without_look_ahead_pack_in_order_of_arrival(name):
    boxes = any_way_up(random.Random(5), 12)
    assert pack(name, ENGINES['paper'], boxes, 4, 2)[1] == [box.id for box in boxes]


@pytest.mark.parametrize('name', ['o_first_fit', 'o_best_fit', 'o_jampack'])
def test_opack_makes_use_of_the_look_ahead(name):
    boxes = any_way_up(random.Random(5), 12)
    assert pack(name, ENGINES['paper'], boxes, 4, 2)[1] != [box.id for box in boxes]


@pytest.mark.parametrize(('plain', 'with_opack'), [
    ('first_fit', 'o_first_fit'), ('best_fit', 'o_best_fit'),
])  # fmt: skip
def test_opack_with_one_box_is_the_plain_rule(plain, with_opack):
    boxes = any_way_up(random.Random(8), 30)
    assert pack(plain, ENGINES['paper'], boxes, 1, 3) == pack(
        with_opack, ENGINES['paper'], boxes, 1, 3
    )


def two_bins(engine):
    """An old bin with a low box and a young one with a large box; both have room on the floor."""
    low = PlacedBox(Box('low', (300.0, 400.0, 50.0)), (0, 0, 0), (300, 400, 50))
    large = PlacedBox(Box('large', (400.0, 400.0, 300.0)), (0, 0, 0), (400, 400, 300))
    return tuple(
        engine.model(Bin(name, serial, SMALL, (placed,)))
        for name, serial, placed in (('old', 1, low), ('young', 2, large))
    )


@pytest.mark.parametrize(('name', 'index'), [
    ('first_fit', 0), ('o_first_fit', 0), ('best_fit', 1), ('o_best_fit', 1), ('dbl', 0),
])  # fmt: skip
def test_first_fit_takes_the_oldest_bin_and_best_fit_the_fullest(name, index):
    engine = ENGINES['paper']
    problem = Problem(engine, (Box('new', (100.0, 100.0, 100.0)),), two_bins(engine))
    assert find_algorithm(name)(problem).candidate.bin_index == index


def corner_of(name, box, *placed):
    engine = ENGINES['paper']
    problem = Problem(engine, (box,), (engine.model(Bin('a', 1, SMALL, placed)),))
    return find_algorithm(name)(problem).candidate.placed


SLAB = PlacedBox(Box('slab', (300.0, 400.0, 100.0)), (0, 0, 0), (300, 400, 100))
CUBE = Box('cube', (100.0, 100.0, 100.0))


@pytest.mark.parametrize('name', ['dbl', 'floor_building', 'online_bph', 'first_fit'])
def test_floor_comes_before_the_top_of_a_box(name):
    assert corner_of(name, CUBE, SLAB).corner_mm == (300, 0, 0)


def test_column_building_stacks_at_the_origin():
    assert corner_of('column_building', CUBE, SLAB).corner_mm == (0, 0, 100)


def test_floor_building_lies_a_box_down():
    assert corner_of('floor_building', Box('new', (100.0, 200.0, 60.0))).size_mm[2] == 60


def test_lsah_keeps_the_bounding_box_small():
    # beside the slab the bounding box grows along x, on top of it along z
    low = PlacedBox(Box('low', (300.0, 200.0, 200.0)), (0, 0, 0), (300, 200, 200))
    assert corner_of('lsah', Box('twin', (300.0, 200.0, 200.0)), low).corner_mm == (0, 200, 0)


def test_heightmap_minimisation_loses_no_volume():
    # one 100 mm step: across it some volume would be lost below
    placed = corner_of('heightmap_min', Box('new', (200.0, 400.0, 50.0)), SLAB)
    assert placed.corner_mm[2] in (0, 100)
    x, far = placed.corner_mm[0], placed.far_mm[0]
    assert far <= 300 or x >= 300


def test_walle_prefers_a_level_neighbour():
    # at the slab's edge the top is level with the slab: flush cells and no variation there
    placed = corner_of('walle', Box('new', (300.0, 400.0, 100.0)), SLAB)
    assert placed.corner_mm == (300, 0, 0) and placed.size_mm == (300, 400, 100)


def test_best_short_side_fit_fills_the_gap_that_fits():
    # a gap of 120 mm between two walls of boxes takes the side of 120 mm with nothing left over
    left = PlacedBox(Box('left', (300.0, 400.0, 300.0)), (0, 0, 0), (300, 400, 300))
    right = PlacedBox(Box('right', (180.0, 400.0, 300.0)), (420, 0, 0), (180, 400, 300))
    placed = corner_of('best_short_side_fit', Box('new', (120.0, 150.0, 140.0)), left, right)
    assert (placed.corner_mm[0], placed.size_mm[0]) == (300, 120)


def test_online_bph_turns_a_box_to_fit_the_gap():
    left = PlacedBox(Box('left', (300.0, 400.0, 300.0)), (0, 0, 0), (300, 400, 300))
    right = PlacedBox(Box('right', (150.0, 400.0, 300.0)), (450, 0, 0), (150, 400, 300))
    placed = corner_of('online_bph', Box('new', (120.0, 150.0, 100.0)), left, right)
    assert placed.corner_mm == (300, 0, 0) and placed.size_mm[0] == 150


@pytest.mark.parametrize('name', BUILT_IN)
def test_a_refused_corner_of_an_empty_bin_does_not_stop_the_cell(name):
    engine = ENGINES['cell']
    empty = engine.model(Bin('a', 1, SMALL))
    zones = (Zone('xyz', (0, 0, 0)), Zone('yxz', (0, 0, 0)))
    problem = Problem(
        engine, (Box('new', (200.0, 150.0, 100.0)),), (empty,), lambda _box, _bin: zones
    )
    choice = find_algorithm(name)(problem)
    assert choice is not None
    assert max(choice.candidate.placed.corner_mm[:2]) >= REFUSED_RADIUS_MM
