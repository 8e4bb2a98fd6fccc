"""The compiled search for what wastes least finds what a plain look at every placement finds."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import SMALL, Engines, coarse, random_bin, random_box

from pack_msgs_py.rules import violations
from pack_msgs_py.values import Bin, Box, Walls
from pack_planner.algorithms import Problem
from pack_planner.algorithms.virtual_bins import Outlook
from pack_planner.algorithms.waste_weights import WasteWeights
from pack_planner.engine.placements import all_spots
from pack_planner.engine.room import unusable
from pack_planner.engine.surroundings import lost_volume

ENGINES = Engines(
    {
        'paper': coarse('paper', 10),
        'cell': coarse('cell', 10, orientations='any'),
        'dense': coarse('dense', 10, orientations='any'),
    }
)
NOTHING = WasteWeights(
    lost=0.0, touched=0.0, level=0.0, spread=0.0, younger=0.0, large_first=0.0, no_place=0.0
)
#: Each term alone, and all of them.
WEIGHTS = {
    'lost': {'lost': 1.0},
    'touched': {'touched': 2.0},
    'level': {'level': 1.0, 'level_mm': 20.0},
    'spread': {'spread': 1.0},
    'snug': {'snug': 1.0, 'near_mm': 70.0},
    'hollow': {'hollow': 1.0},
    'above': {'above': 1.0},
    'beside': {'beside': 1.0},
    'tall': {'tall': -1.0},
    'slender': {'slender': 0.5},
    'shut_off': {'shut_off': 0.7},
}
WEIGHTS['all'] = {name: value for terms in WEIGHTS.values() for name, value in terms.items()}


def heights_of(target, step=10):
    """Heights by centimetre with the walls around, (L + 2, B + 2)."""
    length, breadth, _ = target.spec.size_mm
    heights = np.zeros((length // step + 2, breadth // step + 2))
    for other in target.boxes:
        (x0, y0, _), (x1, y1, top) = other.corner_mm, other.far_mm
        part = heights[x0 // step + 1 : x1 // step + 1, y0 // step + 1 : y1 // step + 1]
        np.maximum(part, top, out=part)
    heights[0], heights[-1], heights[:, 0], heights[:, -1] = [np.inf] * 4
    return heights


def around(placed, target):
    """(Room, box, room) along each row and each column of cells that the box lies on."""
    heights, z = heights_of(target), placed.corner_mm[2]
    i0, j0 = (edge // 10 + 1 for edge in placed.corner_mm[:2])
    i1, j1 = (edge // 10 + 1 for edge in placed.far_mm[:2])
    pairs = []
    for lines, low, high in ((heights[:, j0:j1].T, i0, i1), (heights[i0:i1], j0, j1)):
        for line in lines:
            below = next(gap for gap in range(low) if line[low - 1 - gap] > z)
            beyond = next(gap for gap in range(len(line)) if line[high + gap] > z)
            pairs.append((10 * below, 10 * (high - low), 10 * beyond))
    return pairs


def sides_of(placed, target):
    """Rooms at each of the four sides."""
    lines, rows = around(placed, target), placed.size_mm[1] // 10
    along_x, along_y = zip(*lines[:rows], strict=True), zip(*lines[rows:], strict=True)
    return [rooms for low, _, high in (along_x, along_y) for rooms in (low, high)]


def shut_off(placed, target):
    """Room behind a placement that is hidden from the front by it alone, mm^3."""
    heights, room = heights_of(target)[1:-1, 1:-1], 0.0
    for column in range(placed.corner_mm[0] // 10, placed.far_mm[0] // 10):
        for row in range(placed.corner_mm[1] // 10):
            seen_from = heights[column, row:].max()
            room += 100 * max(0.0, placed.top_mm - seen_from)
    return room


def plain_waste(placed, target, weights, rooms, tolerance):
    """Waste of one placement, centimetre by centimetre."""
    length, breadth, limit = target.spec.size_mm
    heights, (above, beside) = heights_of(target), rooms
    (x0, y0, z), (x1, y1, top), (dx, dy, dz) = placed.corner_mm, placed.far_mm, placed.size_mm
    i0, j0, i1, j1 = x0 // 10 + 1, y0 // 10 + 1, x1 // 10 + 1, y1 // 10 + 1
    under = heights[i0:i1, j0:j1]
    border = np.concatenate(
        [heights[i0 - 1, j0:j1], heights[i1, j0:j1], heights[i0:i1, j0 - 1], heights[i0:i1, j1]]
    )
    gained = sum(above[limit - int(h)] for h in under.flat) / under.size
    dead = sum(
        beside[low] + beside[high] - beside[low + own + high]
        for low, own, high in around(placed, target)
    )
    snug = [0 < min(gaps) < weights.near_mm for gaps in sides_of(placed, target)]
    level = (np.abs(border - top) <= weights.level_mm) & (border > z)
    return (
        weights.lost * (z - under).mean() / dz
        - weights.touched * np.clip(np.minimum(border, top) - z, 0, None).mean() / dz
        - weights.level * level.mean()
        - weights.snug * np.mean(snug)
        + weights.spread * (x0 + y0) / (length + breadth)
        + weights.hollow * (under < z - tolerance).mean()
        + weights.above * (above[limit - top] - gained) / dz
        + weights.beside * dead * 10 / (dx * dy)
        + weights.tall * top / limit
        + weights.slender * dz / min(dx, dy)
        + weights.shut_off * shut_off(placed, target) / (dx * dy * dz)
    )


@pytest.mark.parametrize('terms', WEIGHTS)
@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=6, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(0, 10), far_ends=st.booleans())
def test_it_finds_the_placements_of_least_waste(name, terms, seed, count, far_ends):
    weights = replace(NOTHING, **WEIGHTS[terms], far_ends=far_ends)
    engine, rng = ENGINES[name], random.Random(seed)
    target, box = random_bin(engine, rng, count), random_box(rng, 'new')
    target = replace(target, spec=replace(SMALL, walls=Walls.OPEN_FRONT))
    model = engine.model(target)
    outlook = Outlook(Problem(engine, (box,), (model,)), weights, 3)
    moves = outlook.bins[0].moves([0])[0]

    by = weights, outlook.rooms(SMALL.size_mm), engine.profile.support_tolerance_mm
    for move in moves:
        placed = outlook.placed(move)
        assert list(violations(placed, target.boxes, SMALL, engine.profile)) == []
        assert move.waste == pytest.approx(plain_waste(placed, target, *by), abs=1e-9)
    spots = all_spots(engine, box, model, far_ends=far_ends)
    assert len(moves) == min(3, len(spots))
    known = {outlook.placed(move) for move in moves}
    others = [spot for spot in map(spots.placed, range(len(spots))) if spot not in known]
    for spot in rng.sample(others, min(25, len(others))):
        assert plain_waste(spot, target, *by) >= moves[-1].waste - 1e-9


def test_only_an_open_front_is_kept_open():
    engine, rng = ENGINES['dense'], random.Random(5)
    target, boxes = random_bin(engine, rng, 6), (random_box(rng, 'new'),)
    weights = replace(NOTHING, shut_off=1.0)
    wastes = []
    for walls in Walls:
        model = engine.model(replace(target, spec=replace(SMALL, walls=walls)))
        moves = Outlook(Problem(engine, boxes, (model,)), weights, 30).bins[0].moves([0])[0]
        wastes.append({move.waste for move in moves})
    of_walls = dict(zip(Walls, wastes, strict=True))
    assert of_walls[Walls.CLOSED] == of_walls[Walls.NONE] == {0.0}
    assert max(of_walls[Walls.OPEN_FRONT]) > 0


def test_lost_volume_is_that_of_the_cells():
    engine, rng = ENGINES['dense'], random.Random(2)
    target = random_bin(engine, rng, 8)
    model = engine.model(target)
    spots = all_spots(engine, random_box(rng, 'new'), model, far_ends=True)
    assert len(spots) > 10
    for row in range(0, len(spots), 5):
        placed = spots.placed(row)
        x0, y0, z = placed.corner_mm
        x1, y1, _ = placed.far_mm
        under = heights_of(target)[x0 // 10 + 1 : x1 // 10 + 1, y0 // 10 + 1 : y1 // 10 + 1]
        assert lost_volume(spots, model)[row] == pytest.approx((z - under).sum() * 100)


def test_the_order_of_moves_does_not_matter_to_the_bin_after_them():
    engine = ENGINES['dense']
    boxes = tuple(Box(name, (150.0, 150.0, 100.0)) for name in 'ab')
    models = (engine.model(Bin('bin', 1, SMALL)),)
    outlook = Outlook(Problem(engine, boxes, models), replace(NOTHING, touched=1.0), 3)
    start = outlook.bins[0]
    first, second = start.moves([0])[0][0], start.moves([1])[1][2]
    assert start.after(first).after(second) is start.after(second).after(first)


class TestRoomThatStaysEmpty:
    """:func:`unusable`."""

    @staticmethod
    def of(extents, limit, choices=1.0, shares=None):
        shares = [1 / len(extents)] * len(extents) if shares is None else shares
        return unusable(np.array(extents), np.array(shares), limit, 5, choices)

    def test_one_kind_of_box_leaves_the_rest_of_a_division(self):
        assert self.of([100], 350)[[0, 90, 100, 130, 200, 350]].tolist() == [0, 90, 0, 30, 0, 50]

    def test_what_fits_and_what_does_not_come_as_often(self):
        # 100 or 200 into 200: 200 at once, or 100 and then again 100 or nothing
        empty = self.of([100, 200], 200)
        assert empty[200] == pytest.approx(0.5 * 0 + 0.5 * (0.5 * 0 + 0.5 * 100))

    def test_the_better_of_two_is_taken(self):
        # of two boxes one is 200 in three of four cases, otherwise 100 stands on 100 as often
        empty = self.of([100, 200], 200, choices=2.0)
        assert empty[100] == pytest.approx(25.0)
        assert empty[200] == pytest.approx(0.25 * 25.0)
