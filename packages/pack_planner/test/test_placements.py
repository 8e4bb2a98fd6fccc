"""Placements that heuristics rank: all of them are allowed, and none is missing."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import SMALL, Engines, coarse, random_bin, random_box

from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.engine import Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.engine.placements import all_spots, spots_at
from pack_planner.engine.points import corner_points, extreme_points
from pack_planner.engine.surroundings import border, gaps, lost_volume

ENGINES = Engines(
    {
        'paper': coarse('paper', 20),
        'paper-any': coarse('paper', 20, orientations='any'),
        'cell': coarse('cell', 20),
    }
)


def rest_height(target, x, y, size):
    under = [
        other.top_mm
        for other in target.boxes
        if other.corner_mm[0] < x + size[0]
        and x < other.far_mm[0]
        and other.corner_mm[1] < y + size[1]
        and y < other.far_mm[1]
    ]
    return max(under, default=0)


def allowed_placements(engine, box, target):
    """Every allowed placement on the grid, by the slow rules."""
    profile = engine.profile
    for orientation in allowed_orientations(box, profile.orientations):
        size = planned_size(box, orientation, profile)
        for x in range(0, target.spec.size_mm[0] - size[0] + 1, profile.resolution_mm):
            for y in range(0, target.spec.size_mm[1] - size[1] + 1, profile.resolution_mm):
                corner = (x, y, rest_height(target, x, y, size))
                placed = PlacedBox(box, corner, size, orientation)
                if next(violations(placed, target.boxes, target.spec, profile), None) is None:
                    yield placed


def rows(spots):
    return {spots.placed(row) for row in range(len(spots))}


@pytest.mark.parametrize('far_ends', [False, True])
@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(0, 10))
def test_every_spot_is_allowed(name, far_ends, seed, count):
    engine, rng = ENGINES[name], random.Random(seed)
    target = random_bin(engine, rng, count)
    spots = all_spots(engine, random_box(rng, 'new'), engine.model(target), far_ends=far_ends)
    assert len(rows(spots)) == len(spots)
    for placed in rows(spots):
        assert list(violations(placed, target.boxes, SMALL, engine.profile)) == []


@pytest.mark.parametrize('name', ['paper', 'paper-any'])
@settings(max_examples=12, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(0, 9))
def test_far_ends_hold_the_extremes_of_every_direction(name, seed, count):
    """Whatever one wants, near or far along x and y, at each height: the spots have it."""
    engine, rng = ENGINES[name], random.Random(seed)
    target, box = random_bin(engine, rng, count), random_box(rng, 'new')
    everywhere = list(allowed_placements(engine, box, target))
    listed = rows(all_spots(engine, box, engine.model(target), far_ends=True))
    near = rows(all_spots(engine, box, engine.model(target)))
    assert listed <= set(everywhere) and near <= listed
    for turn in {spot.orientation for spot in everywhere}:
        for z in {spot.corner_mm[2] for spot in everywhere if spot.orientation == turn}:
            for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):

                def best(spots, sx=sx, sy=sy, turn=turn, z=z):
                    return min(
                        sx * spot.corner_mm[0] + 1.001 * sy * spot.corner_mm[1]
                        for spot in spots
                        if spot.orientation == turn and spot.corner_mm[2] == z
                    )

                assert best(listed) == best(everywhere)
                if (sx, sy) == (1, 1):
                    assert best(near) == best(everywhere)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_the_best_spot_is_the_engines_best_placement(seed):
    engine, rng = ENGINES['paper'], random.Random(seed)
    model = engine.model(random_bin(engine, rng, 9))
    box = random_box(rng, 'new')
    spots = all_spots(engine, box, model)
    best = engine.best_placement(box, [model])
    if best is None:
        assert len(spots) == 0
    else:
        assert min(spots.candidate(i, 0, engine).objective for i in range(len(spots))) == (
            best.objective
        )


def test_refused_zones_are_left_out():
    engine = ENGINES['paper']
    model = engine.model(Bin('a', 1, SMALL))
    box = Box('new', (200.0, 150.0, 100.0))
    zones = (Zone('xyz', (0, 0, 0)),)
    spots = all_spots(engine, box, model, lambda _box, _bin: zones)
    kept = [spots.placed(row) for row in range(len(spots))]
    refused = [
        spot
        for spot in kept
        if spot.orientation == 'xyz' and max(spot.corner_mm[:2]) < REFUSED_RADIUS_MM
    ]
    assert kept and not refused
    assert any(spot.orientation == 'xyz' for spot in kept)
    assert len(all_spots(engine, box, model, lambda _box, _bin: None)) == 0


def test_points_off_the_grid_move_to_the_next_grid_position():
    engine = ENGINES['paper']
    spots = spots_at(
        engine, Box('new', (100.0, 100.0, 100.0)), engine.model(Bin('a', 1, SMALL)),
        np.array([[13, 20]]),
    )  # fmt: skip
    assert {tuple(corner) for corner in spots.corners.tolist()} == {(20, 20, 0)}


def stack(*boxes):
    return Bin(
        'a', 1, SMALL,
        tuple(
            PlacedBox(Box(f'b{i}', (1.0, 1.0, 1.0)), corner, size)
            for i, (corner, size) in enumerate(boxes)
        ),
    )  # fmt: skip


def test_extreme_points_of_two_boxes():
    engine = ENGINES['paper']
    target = stack(((0, 0, 0), (200, 100, 100)), ((200, 0, 0), (100, 300, 200)))
    points = {tuple(point) for point in extreme_points(engine.model(target)).tolist()}
    # corners of the first; of the second, (200, 300) also slides back to the wall at x = 0
    # and its top, higher than the first, slides to x = 0
    assert points == {(0, 0), (200, 0), (0, 100), (300, 0), (200, 300), (0, 300)}


def test_corner_points_lie_right_of_behind_and_on_each_box():
    engine = ENGINES['paper']
    target = stack(((0, 0, 0), (200, 100, 100)), ((200, 0, 0), (400, 300, 200)))
    points = {tuple(point) for point in corner_points(engine.model(target)).tolist()}
    # right of the second is the wall, so there is none
    assert points == {(0, 0), (200, 0), (0, 100), (200, 300)}


def test_what_lies_around_a_placement():
    engine = ENGINES['paper']
    target = stack(((0, 0, 0), (200, 400, 100)), ((400, 0, 0), (100, 200, 40)))
    model = engine.model(target)
    spots = spots_at(engine, Box('new', (100.0, 100.0, 100.0)), model, np.array([[200, 0]]))
    assert spots.corners.tolist() == [[200, 0, 0]] * len(spots)
    assert gaps(spots, model)[0].tolist() == [0, 100, 0, 300]
    # left: 10 cells level; right: 10 cells of floor, 10 cm lower; behind: the same
    assert border(spots, model)[0].tolist() == [200.0, 0.0, 10.0]
    assert lost_volume(spots, model)[0] == 0.0
    bridge = spots_at(engine, Box('new', (300.0, 100.0, 100.0)), model, np.array([[0, 0]]))
    flat = [
        row for row in range(len(bridge))
        if bridge.placed(row).orientation == ORIENTATIONS[0] and bridge.corners[row, 2] == 100
    ]  # fmt: skip
    assert flat == [], 'two of four vertices are not enough'
