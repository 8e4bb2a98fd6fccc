"""The engine finds exactly what a scan of every position with the slow rules finds."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import SMALL, Engines, coarse, random_bin, random_box

from pack_msgs_py.geometry.taken_up import taken_up
from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import PROFILES, planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.validator import validate_sequence
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.engine import Engine, Weights, Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM

# The rules are asked at every position, and measured that takes three times as long.
pytestmark = pytest.mark.no_cover


def scan_everything(engine, box, bins, zones=()):
    """Best (key, placement) over every grid position, orientation and bin, by the slow rules."""
    profile, w = engine.profile, engine.weights
    step = profile.resolution_mm
    best = None
    for index, target in enumerate(bins):
        length, breadth, _ = target.spec.size_mm
        below = [(other.corner_mm, other.far_mm, other.top_mm) for other in target.boxes]
        for orientation in allowed_orientations(box, profile.orientations):
            size = planned_size(box, orientation, profile)
            for x in range(0, length - size[0] + 1, step):
                for y in range(0, breadth - size[1] + 1, step):
                    z = max(
                        (
                            top
                            for corner, far, top in below
                            if corner[0] < x + size[0]
                            and x < far[0]
                            and corner[1] < y + size[1]
                            and y < far[1]
                        ),
                        default=0,
                    )
                    if any(
                        zone.orientation == orientation
                        and zone.corner_mm[2] == z
                        and abs(zone.corner_mm[0] - x) < REFUSED_RADIUS_MM
                        and abs(zone.corner_mm[1] - y) < REFUSED_RADIUS_MM
                        for zone in zones
                    ):
                        continue
                    objective = (
                        w.position * (x + y)
                        + w.height * (z + size[2])
                        + 10.0 * w.bin_index * (index + 1)
                    )
                    key = (objective, index, z, y, x, ORIENTATIONS.index(orientation))
                    if best is not None and key >= best[0]:
                        continue
                    placed = PlacedBox(box, (x, y, z), size, orientation)
                    if next(violations(placed, target.boxes, target.spec, profile), None) is None:
                        best = (key, placed, index)
    return best


def assert_same(engine, box, bins, zones=(), scanned=None):
    """``scanned`` are the bins as the slow rules see them, where that is not as the engine does."""
    expected = scan_everything(engine, box, scanned or bins, zones)
    candidate = engine.best_placement(
        box, [engine.model(target) for target in bins], lambda _box, _bin: tuple(zones)
    )
    if expected is None:
        assert candidate is None
    else:
        assert candidate is not None, f'the scan finds {expected}'
        assert (candidate.placed, candidate.bin_index) == expected[1:]
        assert candidate.objective == pytest.approx(expected[0][0] / 10)


PROFILE_CASES = {
    'paper': coarse('paper', 20),
    'paper-any': coarse('paper', 20, orientations='any'),
    'cell': coarse('cell', 20),
    'cell-any': coarse('cell', 20, orientations='any'),
    'share-only': coarse('paper', 20, min_support_share=0.8),
    'com-only': coarse('paper', 20, com_margin_mm=30.0),
    'dense': coarse('dense', 20),
    'dense-any': coarse('dense', 20, orientations='any', min_support_share=0.0),
    'stability-only': coarse(
        'paper', 20, min_vertices=0, stability_margin_mm=0.0, bearing_inset_mm=0.0
    ),
}
ENGINES = Engines(PROFILE_CASES)


@pytest.mark.parametrize('name', PROFILE_CASES)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(0, 14))
def test_best_placement_is_the_argmin_over_every_position(name, seed, count):
    engine = ENGINES[name]
    rng = random.Random(seed)
    bins = [random_bin(engine, rng, count, 'bin-1'), random_bin(engine, rng, count // 2, 'bin-2')]
    for trial in range(2):
        assert_same(engine, random_box(rng, f'new-{trial}'), bins)


@pytest.mark.parametrize('name', ['paper', 'dense-any'])
@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 10))
def test_boxes_that_stick_out_of_their_places_have_room_where_they_were_measured(name, seed, count):
    engine = ENGINES[name]
    rng = random.Random(seed)
    target = random_bin(engine, rng, count)
    shifted = []
    for placed in target.boxes:
        x, y = (placed.corner_mm[axis] + placed.size_mm[axis] / 2 for axis in (0, 1))
        off = (rng.uniform(-30, 30), rng.uniform(-30, 30)) if rng.random() < 0.5 else (0.0, 0.0)
        centre = (x + off[0], y + off[1], placed.top_mm - placed.size_mm[2] / 2)
        shifted.append(replace(placed, measured_mm=centre))
    measured = replace(target, boxes=tuple(shifted), revision=target.revision + 100)
    step = engine.profile.resolution_mm
    grown = replace(measured, boxes=taken_up(measured.boxes, measured.spec, step))
    assert_same(engine, random_box(rng, 'new'), [measured], scanned=[grown])


@pytest.mark.parametrize('name', ['paper', 'cell'])
@settings(max_examples=3, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_the_argmin_holds_on_the_real_grid(name, seed):
    engine = Engine(PROFILES[name])
    rng = random.Random(seed)
    assert_same(engine, random_box(rng, 'new'), [random_bin(engine, rng, 10)])


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    weights=st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 0), (3, 1, 10), (0.3, 2.7, 1.1)]),
)
def test_the_argmin_holds_for_any_weights(seed, weights):
    engine = Engine(PROFILE_CASES['cell-any'], Weights(*weights))
    rng = random.Random(seed)
    bins = [random_bin(engine, rng, 6, 'bin-1'), random_bin(engine, rng, 6, 'bin-2')]
    assert_same(engine, random_box(rng, 'new'), bins)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), name=st.sampled_from(['paper', 'cell']))
def test_refused_zones_are_left_out_and_nothing_else(seed, name):
    engine = ENGINES[name]
    rng = random.Random(seed)
    bins = [random_bin(engine, rng, 5)]
    box = random_box(rng, 'new')
    zones = []
    for _ in range(3):
        candidate = engine.best_placement(box, [engine.model(bins[0])], lambda _b, _t: tuple(zones))
        if candidate is None:
            break
        zones.append(Zone(candidate.placed.orientation, candidate.placed.corner_mm))
    assert_same(engine, box, bins, zones)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), name=st.sampled_from(['paper', 'cell']))
def test_a_bin_packed_on_another_grid_is_planned_exactly(seed, name):
    rng = random.Random(seed)
    fine = random_bin(Engine(coarse(name, 7)), rng, 8)
    assert_same(ENGINES[name], random_box(rng, 'new'), [fine])


@pytest.mark.parametrize('name', ['paper', 'cell'])
@pytest.mark.parametrize('resolution', [1, 10])
def test_long_random_sequences_break_no_rule(name, resolution):
    engine = Engine(coarse(name, resolution))
    rng = random.Random(7)
    for _ in range(4):
        filled = random_bin(engine, rng, 60)
        assert len(filled.boxes) > 5
        assert validate_sequence(filled.boxes, SMALL, engine.profile) == []


def test_stands_agrees_with_the_rules():
    rng = random.Random(3)
    agreed = {True: 0, False: 0}
    for name, engine in ENGINES.items():
        for _ in range(12):
            target = random_bin(engine, rng, 8)
            model = engine.model(target)
            box = replace(random_box(rng, f'new-{name}'), allowed_up=63)
            for _ in range(60):
                orientation = rng.choice(allowed_orientations(box, engine.profile.orientations))
                size = planned_size(box, orientation, engine.profile)
                tops = [0] + [other.top_mm for other in target.boxes]
                corner = (rng.randrange(0, 400, 20), rng.randrange(0, 200, 20), rng.choice(tops))
                placed = PlacedBox(box, corner, size, orientation)
                # a box is planned where it rests, never with a gap below it
                allowed = not list(violations(placed, target.boxes, SMALL, engine.profile))
                lower = any(
                    top < corner[2] <= top + 2 and top in tops for top in tops
                )  # tolerance lets the rules accept a gap of 2 mm
                if not (allowed and lower):
                    assert engine.stands(placed, model) == allowed
                    agreed[allowed] += 1
    assert min(agreed.values()) > 10


def test_a_box_that_is_too_heavy_for_the_bin_goes_into_the_next(cell):
    full = Bin(
        'a', 1, SMALL, (PlacedBox(Box('lead', (600, 400, 10), 495.0), (0, 0, 0), (600, 400, 10)),)
    )
    candidate = cell.best_placement(
        Box('new', (100, 100, 100), 10.0), [cell.model(full), cell.model(Bin('b', 2, SMALL))]
    )
    assert candidate is not None and candidate.bin_index == 1


def test_an_overloaded_bin_takes_nothing_more(cell):
    weak = PlacedBox(
        Box('weak', (296, 396, 100), 1.0, max_top_load_n=1.0), (0, 0, 0), (300, 400, 100)
    )
    heavy = PlacedBox(Box('heavy', (296, 396, 100), 9.0), (0, 0, 100), (300, 400, 100))
    model = cell.model(Bin('a', 1, SMALL, (weak, heavy)))
    assert 'weak' in model.blocked
    assert cell.best_placement(Box('new', (100, 100, 100)), [model]) is None


def test_cost_does_not_grow_with_resolution():
    rng = random.Random(5)
    box = random_box(rng, 'new')
    fine, usual = Engine(coarse('paper', 1)), Engine(coarse('paper', 10))
    target = random_bin(usual, rng, 12)
    assert len(fine.model(target).lines_x) == len(usual.model(target).lines_x)
    a = fine.best_placement(replace(box, size_mm=(100, 90, 80)), [fine.model(target)])
    b = usual.best_placement(replace(box, size_mm=(100, 90, 80)), [usual.model(target)])
    assert a == b


@pytest.mark.parametrize('bad', [-1.0, float('nan'), float('inf')])
def test_weights_that_make_no_sense_are_refused(bad):
    with pytest.raises(ValueError, match='w2'):
        Weights(1.0, bad, 100.0)


@settings(max_examples=10, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    margin=st.sampled_from([None, 20.0, 45.0, 70.0]),
    share=st.sampled_from([0.6, 0.8, 0.93]),
    tolerance=st.sampled_from([0, 2]),
)
def test_the_argmin_inside_a_cell_holds_for_large_overhanging_boxes(seed, margin, share, tolerance):
    profile = coarse(
        'paper', 10, com_margin_mm=margin, min_support_share=share, orientations='any',
        check_top_load=True, support_tolerance_mm=tolerance,
    )  # fmt: skip
    engine, rng = Engine(profile), random.Random(seed)
    target = random_bin(engine, rng, 6)
    for trial in range(2):
        assert_same(engine, random_box(rng, f'new-{trial}', low=60, high=390), [target])
