"""Constraints for efficient packing: the engine against a scan of every grid position."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_cases import SMALL, Engines, coarse, random_bin, random_box

from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.engine import Engine
from pack_planner.engine.contact import solids, touches, touching

ENGINES = Engines(
    {
        'paper': coarse('paper', 20),
        'cell': coarse('cell', 20),
        'cell-any': coarse('cell', 20, orientations='any'),
    }
)


def placed(corner, size, name='box'):
    return PlacedBox(Box(name, tuple(float(edge) for edge in size)), corner, size)


BLOCK = placed((200, 100, 0), (100, 100, 100), 'block')


@pytest.mark.parametrize(('new', 'expected'), [
    (placed((0, 0, 0), (50, 50, 50)), (True, True)),
    (placed((550, 350, 0), (50, 50, 50)), (True, True)),
    (placed((300, 100, 0), (50, 50, 50)), (True, False)),
    (placed((220, 200, 0), (50, 50, 50)), (False, True)),
    (placed((300, 0, 0), (50, 110, 50)), (True, True)),
    # the plane of a face counts, also beyond the face
    (placed((300, 200, 0), (50, 50, 50)), (True, True)),
    (placed((300, 220, 100), (50, 50, 50)), (True, False)),
    (placed((310, 110, 0), (50, 50, 50)), (False, False)),
    # in the plane of a face that looks the same way
    (placed((200, 100, 100), (100, 100, 50)), (False, False)),
])  # fmt: skip
def test_a_box_touches_what_it_lies_in_one_plane_with(new, expected):
    assert touches(new, [BLOCK], SMALL.size_mm, 10) == expected
    model = ENGINES['paper'].model(Bin('b', 1, SMALL, (BLOCK,)))
    contacts = touching(solids(model), SMALL.size_mm, new.corner_mm, new.size_mm, 10)
    assert contacts == all(expected)


def test_a_face_off_the_grid_is_touched_from_the_nearest_grid_position():
    odd = placed((0, 0, 0), (103, 100, 100), 'odd')
    assert touches(placed((110, 0, 0), (50, 50, 50)), [odd], SMALL.size_mm, 10)[0]
    assert not touches(placed((120, 0, 0), (50, 50, 50)), [odd], SMALL.size_mm, 10)[0]
    narrow = (605, 400, 400)
    assert touches(placed((550, 0, 0), (50, 50, 50)), [], narrow, 10)[0]


def scan_touching(engine, box, bins):
    """Best (key, placement) over every grid position that touches both ways, by slow rules."""
    profile, w = engine.profile, engine.weights
    step, best = profile.resolution_mm, None
    for index, target in enumerate(bins):
        length, breadth, _ = target.spec.size_mm
        for turn in allowed_orientations(box, profile.orientations):
            size = planned_size(box, turn, profile)
            for x in range(0, length - size[0] + 1, step):
                for y in range(0, breadth - size[1] + 1, step):
                    z = max((under.top_mm for under in target.boxes
                             if under.corner_mm[0] < x + size[0] and x < under.far_mm[0]
                             and under.corner_mm[1] < y + size[1] and y < under.far_mm[1]),
                            default=0)  # fmt: skip
                    objective = (
                        w.position * (x + y)
                        + w.height * (z + size[2])
                        + 10.0 * w.bin_index * (index + 1)
                    )
                    key = (objective, index, z, y, x, ORIENTATIONS.index(turn))
                    if best is not None and key >= best[0]:
                        continue
                    under = PlacedBox(box, (x, y, z), size, turn)
                    if all(touches(under, target.boxes, target.spec.size_mm, step)) and not any(
                        violations(under, target.boxes, target.spec, profile)
                    ):
                        best = (key, under, index)
    return best


@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(0, 14), odd=st.booleans())
def test_the_argmin_under_contact_is_that_of_a_scan(name, seed, count, odd):
    engine, rng = ENGINES[name], random.Random(seed)
    builder = Engine(coarse(name.split('-')[0], 7)) if odd else engine
    bins = [random_bin(builder, rng, count, 'bin-1'), random_bin(engine, rng, count // 2, 'bin-2')]
    for trial in range(2):
        box = random_box(rng, f'new-{trial}')
        expected = scan_touching(engine, box, bins)
        placement = engine.best_placement(box, [engine.model(target) for target in bins], cep=True)
        if expected is None:
            assert placement is None
        else:
            assert (placement.placed, placement.bin_index) == expected[1:]
            assert placement.objective == pytest.approx(expected[0][0] / 10)


def test_every_box_that_is_really_placed_touches_along_x_and_y():
    profile = replace(ENGINES['cell-any'].profile, clearance_mm=4.0)
    engine, rng = Engine(profile), random.Random(2)
    spec = BinSpec('80x45x45', (800, 450, 450))
    target, waiting, apart = Bin('a', 1, spec), [], 0
    for number in range(60):
        waiting.append(random_box(rng, f'box-{number}'))
        if len(waiting) < 4:
            continue
        model = engine.model(target)
        with_contact = Problem(engine, tuple(waiting), (model,), cep=True)
        choice = find_algorithm('mpack_lite')(with_contact)
        if choice is None:
            target, waiting = Bin(f'{number}', 1, spec), waiting[1:]
            continue
        placement = choice.candidate.placed
        assert all(touches(placement, target.boxes, spec.size_mm, 20))
        free = engine.best_placement(placement.box, [model])
        apart += not all(touches(free.placed, target.boxes, spec.size_mm, 20))
        target = Bin(target.id, 1, spec, (*target.boxes, placement), revision=target.revision + 1)
        waiting.remove(placement.box)
    assert apart, 'without the constraints some box would stand apart'
