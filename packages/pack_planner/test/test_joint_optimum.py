"""The joint search finds the optimum over every order and position; all backends agree on it."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joint_cases import EveryOrder, tiny_problem
from planner_cases import Engines, coarse, random_bin, random_box

from pack_planner.algorithms import Problem
from pack_planner.algorithms.incumbent import best_incumbent, greedy
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine import Engine, Weights, Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.joint.bin_by_bin.search import JointSearch
from pack_planner.joint.budget import Budget
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.solution import joint_violations

ENGINES = Engines({name: coarse(name, 50) for name in ('paper', 'cell')})


def search(problem, incumbent=None, nodes=10**6):
    joint = JointSearch(problem.engine, problem.boxes, problem.bins, problem.forbidden, incumbent)
    return joint.run(Budget(nodes=nodes))


def assert_optimal(problem, result):
    """Nothing is better, by the oracle, and what was found obeys the rules."""
    assert result.proven
    if result.candidates is not None:
        assert joint_violations(result.candidates, problem.bins, problem.engine) == []
        total = sum(candidate.objective for candidate in result.candidates)
        assert total == pytest.approx(result.objective)
    bound = result.objective - 1e-6
    assert EveryOrder(problem.engine).least(problem.boxes, problem.bins, bound) == bound


@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), informed=st.booleans())
def test_two_boxes_are_placed_as_well_as_any_order_and_position_allows(name, seed, informed):
    problem = tiny_problem(ENGINES[name], seed, 2)
    start = greedy(problem, by_volume(problem.boxes)) if informed else None
    assert_optimal(problem, search(problem, start))


@pytest.mark.parametrize('name', ENGINES)
@pytest.mark.parametrize('seed', [0, 3, 4, 9, 15, 17, 22, 28])
def test_three_boxes_are_placed_as_well_as_any_order_and_position_allows(name, seed):
    problem = tiny_problem(ENGINES[name], seed, 3)
    assert_optimal(problem, search(problem))


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    weights=st.sampled_from([(1, 0, 0), (0, 1, 0), (3, 1, 10), (0.3, 2.7, 1.1)]),
)
def test_the_optimum_holds_for_any_weights(seed, weights):
    problem = tiny_problem(Engine(coarse('paper', 50), Weights(*weights)), seed, 2)
    assert_optimal(problem, search(problem))


@pytest.mark.parametrize('name', ENGINES)
@pytest.mark.parametrize('seed', range(6))
def test_search_cp_sat_and_milp_agree(name, seed):
    engine = ENGINES[name]
    rng = random.Random(seed)
    bins = [random_bin(engine, rng, rng.choice((0, 3, 8)), 'a'), random_bin(engine, rng, 4, 'b')]
    models = tuple(engine.model(target) for target in bins[: 1 + seed % 2])
    problem = Problem(engine, tuple(random_box(rng, f'new-{k}') for k in range(2)), models)
    start = greedy(problem, by_volume(problem.boxes)) if seed % 3 else None
    wanted = search(problem, start)
    assert wanted.proven
    for backend in ('cp_sat', 'milp'):
        result = solve_joint(
            engine, problem.boxes, models, problem.forbidden, start, backend, budget_s=30.0
        )
        assert result.proven, backend
        assert result.objective == pytest.approx(wanted.objective), backend
        if result.candidates is not None:
            assert joint_violations(result.candidates, models, engine) == []


def test_a_refused_position_is_in_no_joint_solution():
    problem = tiny_problem(ENGINES['paper'], 2, 3)
    first = search(problem)
    zones = tuple(
        Zone(candidate.placed.orientation, candidate.placed.corner_mm)
        for candidate in first.candidates
    )
    barred = replace(problem, forbidden=lambda _box, _bin: zones)
    objectives = set()
    for result in (
        search(barred),
        solve_joint(
            barred.engine, barred.boxes, barred.bins, barred.forbidden, None, 'cp_sat', 30.0
        ),
    ):
        assert result.proven
        assert result.objective >= first.objective
        objectives.add(round(result.objective, 6))
        for candidate in result.candidates:
            for zone in zones:
                near = all(
                    abs(candidate.placed.corner_mm[axis] - zone.corner_mm[axis]) < REFUSED_RADIUS_MM
                    for axis in (0, 1)
                )
                same = (candidate.placed.orientation, candidate.placed.corner_mm[2]) == (
                    zone.orientation, zone.corner_mm[2],
                )  # fmt: skip
                assert not (near and same)
    assert len(objectives) == 1


def test_a_cut_short_search_keeps_its_start_and_says_what_is_proven():
    cut = 0
    for seed in range(20):
        problem = tiny_problem(ENGINES['paper'], seed, 3)
        start = greedy(problem, by_volume(problem.boxes))
        if start is None:
            continue
        best, short = search(problem, start), search(problem, start, nodes=3)
        assert short.nodes <= 3
        assert short.lower_bound <= best.objective + 1e-6 <= short.objective + 2e-6
        assert (short.gap > 0) != short.proven
        assert short.objective <= sum(candidate.objective for candidate in start)
        cut += not short.proven
    assert cut > 3


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_the_start_is_never_worse_than_mpack_lite(seed):
    problem = tiny_problem(ENGINES['cell'], seed, 4)
    lite = greedy(problem, by_volume(problem.boxes))
    best = best_incumbent(problem, problem.boxes, Budget())
    if lite is not None:
        assert best is not None
        assert (
            sum(candidate.objective for candidate in best)
            <= sum(candidate.objective for candidate in lite) + 1e-9
        )
    if best is not None:
        assert joint_violations(best, problem.bins, problem.engine) == []
