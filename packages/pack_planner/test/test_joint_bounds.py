"""Bounds of where boxes can be lose no better solution, and the narrowed model finds it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joint_cases import EveryOrder, tiny_problem
from planner_cases import Engines, coarse

from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms.incumbent import greedy
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine import Engine, Weights
from pack_planner.engine.engine import nothing_forbidden
from pack_planner.joint.by_solver.narrowing import Narrowing, alike
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.solution import joint_violations
from pack_planner.joint.solve import JointSearch

ENGINES = Engines({name: coarse(name, 50) for name in ('paper', 'cell')})


def joint(problem, start=None):
    return JointSearch(
        problem.engine, problem.boxes, problem.bins, problem.forbidden, start, cep=problem.cep
    )


def narrowed(problem, start, reach, at_least=0.0):
    return solve_joint(
        problem.engine, problem.boxes, problem.bins, problem.forbidden, start, 'cp_sat', 30.0,
        cep=problem.cep, reach=reach, at_least=at_least,
    )  # fmt: skip


def assert_within(reach, problem, candidates):
    """Each placement stands where the bounds allow its box, at a cost between them."""
    step = problem.engine.profile.resolution_mm
    numbers = {box.id: number for number, box in enumerate(problem.boxes)}
    for one in candidates:
        placed, number = one.placed, numbers[one.placed.box.id]
        x, y, z = placed.corner_mm
        shapes = reach.grounds[one.bin_index].shapes
        bases = [
            low[x // step, y // step]
            for low, shape in zip(reach.low[one.bin_index], shapes, strict=True)
            if shape[0] == number and tuple(shape[2:]) == placed.size_mm
        ]
        assert min(bases) <= z
        assert reach.least[one.bin_index, number] <= 10 * one.objective + 1e-6
        assert 10 * one.objective <= reach.caps[number] + 1e-6


@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(2, 3), informed=st.booleans())
def test_the_best_solution_lies_within_the_bounds(name, seed, count, informed):
    problem = tiny_problem(ENGINES[name], seed, count)
    start = greedy(problem, by_volume(problem.boxes)) if informed else None
    search = joint(problem, start)
    result = search.run(10**6, lambda: False)
    assert result.proven
    if result.candidates is not None:
        assert_within(search.reach, problem, result.candidates)


@pytest.mark.parametrize('cep', [False, True])
@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=12, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), informed=st.booleans())
def test_the_narrowed_model_finds_what_every_order_and_position_allows(name, cep, seed, informed):
    problem = replace(tiny_problem(ENGINES[name], seed, 2), cep=cep)
    start = greedy(problem, by_volume(problem.boxes)) if informed else None
    if start is not None and cep:
        start = None  # the greedy one asks each box for contact at its moment, not all together
    result = narrowed(problem, start, joint(problem, start).reach)
    assert result.proven
    if result.candidates is not None:
        assert joint_violations(result.candidates, problem.bins, problem.engine) == []
    bound = result.objective - 1e-6
    assert EveryOrder(problem.engine, cep).least(problem.boxes, problem.bins, bound) == bound


@pytest.mark.parametrize('weights', [(1, 1, 100), (3, 1, 10), (0.3, 2.7, 1.1)])
def test_any_weights_lead_to_the_same_optimum_from_a_poor_start(weights):
    engine = Engine(coarse('paper', 50), Weights(*weights))
    problem = tiny_problem(engine, 4, 3)
    wanted = joint(problem).run(10**6, lambda: False)
    poor = greedy(problem, sorted(problem.boxes, key=lambda box: box.volume_mm3))
    assert wanted.proven
    found = narrowed(problem, poor, joint(problem, poor).reach)
    assert found.proven
    assert found.objective == pytest.approx(wanted.objective)


def test_boxes_that_could_only_hold_each_other_up_can_be_nowhere():
    """On a tower beside a shaft, each has two corners on air and fits under no other."""
    engine = ENGINES['paper']
    tower = PlacedBox(Box('tower', (150.0, 200.0, 150.0)), (0, 0, 0), (150, 200, 150), 'xyz')
    bins = (engine.model(Bin('a', 1, BinSpec('300x200x400', (300, 200, 400)), boxes=(tower,))),)
    boxes = tuple(Box(name, (300.0, 200.0, 100.0), allowed_up=48) for name in ('a', 'b'))
    search = JointSearch(engine, boxes, bins, nothing_forbidden)
    assert (search.reach.least == float('inf')).all()
    result = search.run(1, lambda: False)
    assert result.proven
    assert result.candidates is None


def test_boxes_that_differ_in_their_id_alone_are_alike():
    one = Box('a', (100.0, 200.0, 300.0), weight_kg=2.0)
    boxes = (one, replace(one, id='b'), replace(one, id='c', weight_kg=3.0), replace(one, id='d'))
    assert alike(boxes, (), nothing_forbidden) == ((0, 1), (1, 3))


def test_costs_of_solutions_are_known_to_be_multiples():
    problem = tiny_problem(ENGINES['paper'], 4, 3)
    reach = joint(problem).reach
    assert Narrowing(reach, 50, problem.engine.weights).grain == 10  # heights are rounded to 10 mm
    assert Narrowing(reach, 50, Weights(0.33, 1, 1)).grain == 0
