"""Bounds of where boxes can be lose no better solution."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joint_cases import tiny_problem
from planner_cases import Engines, coarse

from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms.incumbent import greedy
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine.engine import nothing_forbidden
from pack_planner.joint.bin_by_bin.search import JointSearch, twins
from pack_planner.joint.budget import Budget
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.reach import find_reach

ENGINES = Engines({name: coarse(name, 50) for name in ('paper', 'cell')})


def assert_within(reach, problem, candidates):
    """Each placement stands where the bounds allow its box, at a cost between them."""
    step = problem.engine.profile.resolution_mm
    numbers = {box.id: number for number, box in enumerate(problem.boxes)}
    for candidate in candidates:
        placed, number = candidate.placed, numbers[candidate.placed.box.id]
        x, y, z = placed.corner_mm
        shapes = reach.grounds[candidate.bin_index].shapes
        bases = [
            low[x // step, y // step]
            for low, shape in zip(reach.low[candidate.bin_index], shapes, strict=True)
            if shape[0] == number and tuple(shape[2:]) == placed.size_mm
        ]
        assert min(bases) <= z
        assert reach.least[candidate.bin_index, number] <= 10 * candidate.objective + 1e-6
        assert 10 * candidate.objective <= reach.caps[number] + 1e-6


@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(2, 3), informed=st.booleans())
def test_the_best_solution_lies_within_the_bounds(name, seed, count, informed):
    problem = tiny_problem(ENGINES[name], seed, count)
    start = greedy(problem, by_volume(problem.boxes)) if informed else None
    about = (problem.engine, problem.boxes, problem.bins, problem.forbidden, start)
    result = solve_joint(*about, 'cp_sat', 30.0)
    assert result.proven
    if result.candidates is not None:
        assert_within(find_reach(*about, Budget()), problem, result.candidates)


def test_boxes_that_could_only_hold_each_other_up_can_be_nowhere():
    """On a tower beside a shaft, each has two corners on air and fits under no other."""
    engine = ENGINES['paper']
    tower = PlacedBox(Box('tower', (150.0, 200.0, 150.0)), (0, 0, 0), (150, 200, 150), 'xyz')
    bins = (engine.model(Bin('a', 1, BinSpec('300x200x400', (300, 200, 400)), boxes=(tower,))),)
    boxes = tuple(Box(name, (300.0, 200.0, 100.0), allowed_up=48) for name in ('a', 'b'))
    search = JointSearch(engine, boxes, bins, nothing_forbidden)
    result = search.run(Budget(nodes=1))
    assert (search.reach.least == float('inf')).all()
    assert result.proven
    assert result.candidates is None


def test_boxes_that_differ_in_their_id_alone_are_alike():
    box = Box('a', (100.0, 200.0, 300.0), weight_kg=2.0)
    boxes = (box, replace(box, id='b'), replace(box, id='c', weight_kg=3.0), replace(box, id='d'))
    assert twins(boxes, (), nothing_forbidden) == ((0, 1), (1, 3))
