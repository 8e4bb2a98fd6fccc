"""What a stack carries all the way down, held against forces that a linear program finds."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from pack_msgs_py.geometry.polygon import overlap
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.rules import Rule, violations
from pack_msgs_py.statics import planned_bearing, sure_footprint
from pack_msgs_py.values import BinSpec, Box, PlacedBox

RULE = Profile('statics', min_vertices=0, stability_margin_mm=0.0, support_tolerance_mm=0)
SPEC = BinSpec('60x40x80', (600, 400, 800))


def placed(name, corner, size, weight_kg=1.0):
    box = Box(name, tuple(float(edge) for edge in size), weight_kg=weight_kg)
    return PlacedBox(box, corner, size)


def in_equilibrium(boxes, centres, profile):
    """Whether contact forces, none of them pulling, hold every box level and still.

    The forces act at the corners of what two boxes surely share; ``centres`` are the centres of
    mass by box id. Decided by a linear program.
    """
    columns, rows = [], {placed.box.id: 3 * i for i, placed in enumerate(boxes)}
    for upper in boxes:
        base = sure_footprint(upper, profile.bearing_inset_mm)
        if upper.corner_mm[2] == 0:
            columns += [(upper, None, x, y) for x in base[::2] for y in base[1::2]]
            continue
        for lower in boxes:
            gap = upper.corner_mm[2] - lower.top_mm
            shared = overlap(base, sure_footprint(lower, profile.bearing_inset_mm))
            if 0 <= gap <= profile.support_tolerance_mm and shared:
                columns += [(upper, lower, x, y) for x in shared[::2] for y in shared[1::2]]
    matrix = np.zeros((3 * len(boxes), len(columns)))
    for column, (upper, lower, x, y) in enumerate(columns):
        first = rows[upper.box.id]
        matrix[first : first + 3, column] = (1, x, y)
        if lower is not None:
            first = rows[lower.box.id]
            matrix[first : first + 3, column] = (-1, -x, -y)
    weights = [
        value
        for placed in boxes
        for value in np.multiply(placed.box.weight_kg, (1, *centres[placed.box.id]))
    ]
    if not columns:
        return False
    return linprog(np.zeros(len(columns)), A_eq=matrix, b_eq=weights, method='highs').success


def middle(box):
    return (box.corner_mm[0] + box.size_mm[0] / 2, box.corner_mm[1] + box.size_mm[1] / 2)


def stands(box, others, profile, margin_mm):
    bearing = planned_bearing(others, profile)
    return box.corner_mm[2] == 0 or bearing.stability_mm(box, middle(box)) >= margin_mm


def random_stack(rng, profile, count):
    """Boxes dropped at random places, kept where the rule lets them stay."""
    boxes = []
    for number in range(count):
        size = tuple(rng.randrange(40, 240, 10) for _ in range(3))
        x, y = rng.randrange(0, 600 - size[0], 10), rng.randrange(0, 400 - size[1], 10)
        box = placed(f'{number}', (x, y, 0), size, weight_kg=rng.choice((0.2, 1.0, 5.0, 20.0)))
        under = [
            one.top_mm
            for one in boxes
            if overlap((x, y, x + size[0], y + size[1]), (*one.corner_mm[:2], *one.far_mm[:2]))
        ]
        box = replace(box, corner_mm=(x, y, max(under, default=0)))
        if (
            box.corner_mm[2] == 0
            or planned_bearing(boxes, profile).stability_mm(box, middle(box)) >= 0.0
        ):
            boxes.append(box)
    return boxes


def test_a_heavy_box_may_not_stand_on_the_free_corner_of_a_light_one():
    """Three corners of the light box rest; what stands on the fourth tips both."""
    below = [
        placed('a', (0, 0, 0), (100, 300, 100)),
        placed('b', (100, 0, 0), (200, 100, 100)),
    ]
    light = placed('light', (0, 0, 100), (300, 300, 100), 1.5)
    heavy = placed('heavy', (200, 200, 200), (100, 100, 100), 2.0)
    paper = PROFILES['paper']
    stack = [*below, light]
    assert not list(violations(light, below, SPEC, paper))
    assert not list(violations(heavy, stack, SPEC, paper))
    centres = {one.box.id: middle(one) for one in (*stack, heavy)}
    assert not in_equilibrium([*stack, heavy], centres, RULE)
    broken = [one.rule for one in violations(heavy, stack, SPEC, replace(paper, **_statics(0.0)))]
    assert broken == [Rule.STABILITY]


def _statics(margin_mm):
    return {'stability_margin_mm': margin_mm, 'bearing_inset_mm': 0.0}


def test_a_bridge_over_two_towers_may_be_loaded_everywhere_between_them():
    towers = [
        placed('left', (0, 0, 0), (100, 100, 200)),
        placed('right', (400, 0, 0), (100, 100, 200)),
    ]
    bridge = placed('bridge', (0, 0, 200), (500, 100, 50))
    assert sorted(planned_bearing(towers, RULE).of(bridge)) == [
        (0, 0),
        (0, 100),
        (500, 0),
        (500, 100),
    ]
    load = placed('load', (200, 0, 250), (100, 100, 100), 20.0)
    assert planned_bearing([*towers, bridge], RULE).stability_mm(load, middle(load)) == 50.0


def test_an_overhang_may_be_loaded_over_its_support_only():
    base = placed('base', (0, 0, 0), (200, 200, 100))
    plank = placed('plank', (60, 0, 100), (240, 200, 50))
    assert sorted(planned_bearing([base], RULE).of(plank)) == [
        (60, 0),
        (60, 200),
        (200, 0),
        (200, 200),
    ]
    over = placed('over', (220, 0, 150), (80, 200, 50))
    assert planned_bearing([base, plank], RULE).of(over) == []


def test_what_is_surely_covered_is_the_scanned_box_less_the_inset():
    box = PlacedBox(Box('a', (200.0, 100.0, 50.0)), (10, 20, 0), (220, 120, 50))
    assert sure_footprint(box, 5.0) == (25.0, 35.0, 215.0, 125.0)
    assert sure_footprint(box, 50.0) is None


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), inset_mm=st.sampled_from([0.0, 4.0, 9.0]))
def test_a_stack_that_the_rule_builds_is_in_equilibrium_whatever_the_weights(seed, inset_mm):
    profile = replace(RULE, bearing_inset_mm=inset_mm)
    rng = random.Random(seed)
    boxes = random_stack(rng, profile, 14)
    for _ in range(3):
        heavy = [
            replace(one, box=replace(one.box, weight_kg=rng.choice((0.1, 1.0, 30.0))))
            for one in boxes
        ]
        assert in_equilibrium(heavy, {one.box.id: middle(one) for one in heavy}, profile)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_a_margin_covers_centres_of_mass_that_nobody_knows(seed):
    """With 20 mm of margin any box may be heavier at one side by as much, all at once."""
    profile, margin_mm = replace(RULE, bearing_inset_mm=3.0), 20.0
    rng = random.Random(seed)
    boxes = [one for one in random_stack(rng, profile, 12) if min(one.size_mm[:2]) > 2 * margin_mm]
    kept: list[PlacedBox] = []
    for one in sorted(boxes, key=lambda it: it.corner_mm[2]):
        if (
            one.corner_mm[2] == 0
            or planned_bearing(kept, profile).stability_mm(one, middle(one)) >= margin_mm
        ):
            kept.append(one)
    centres = {
        one.box.id: tuple(at + rng.uniform(-1, 1) * margin_mm / 2**0.5 for at in middle(one))
        for one in kept
    }
    assert not kept or in_equilibrium(kept, centres, profile)


@pytest.mark.parametrize('name', ['cell', 'dense'])
def test_what_the_arm_builds_by_is_safe_all_the_way_down(name):
    assert PROFILES[name].stability_margin_mm is not None
    assert PROFILES[name].bearing_inset_mm > 0
