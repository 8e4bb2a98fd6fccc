"""The search bin by bin proves the same optima as trying every order and position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joint_cases import Oracle, tiny_problem
from planner_cases import coarse

from pack_planner.algorithms.incumbent import best_incumbent, greedy
from pack_planner.engine import Engine, Weights, Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.joint.assign import pair_costs
from pack_planner.joint.grouped import GroupedSearch
from pack_planner.joint.relations import matched
from pack_planner.joint.solution import all_touch, joint_violations
from pack_planner.joint.solve import JointSearch

ENGINES = {name: Engine(coarse(name, 50)) for name in ('paper', 'cell')}
ENDLESS = 1 << 60


def grouped(problem, start, most_hard=ENDLESS, out_of_time=lambda: False):
    joint = JointSearch(
        problem.engine, problem.boxes, problem.bins, problem.forbidden, start, cep=problem.cep
    )
    search = GroupedSearch(
        problem.engine, problem.boxes, problem.bins, problem.forbidden, start, joint.reach, 0.0,
        cep=problem.cep,
    )  # fmt: skip
    return search.run(most_hard, out_of_time)


def poor_start(problem):
    """Small boxes first; with contact whatever there is."""
    if problem.cep:
        return best_incumbent(problem, problem.boxes)
    return greedy(problem, sorted(problem.boxes, key=lambda box: box.volume_mm3))


def assert_optimal(problem, result):
    assert result.proven
    assert joint_violations(result.candidates, problem.bins, problem.engine) == []
    assert not problem.cep or all_touch(result.candidates, problem.bins, problem.engine)
    assert sum(one.objective for one in result.candidates) == pytest.approx(result.objective)
    bound = result.objective - 1e-6
    found = Oracle(problem.engine, problem.cep).least(problem.boxes, problem.bins, bound)
    assert found == bound


@pytest.mark.parametrize('cep', [False, True])
@pytest.mark.parametrize('name', ENGINES)
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_two_boxes_are_placed_as_well_as_any_order_and_position_allows(name, cep, seed):
    problem = replace(tiny_problem(ENGINES[name], seed, 2), cep=cep)
    start = poor_start(problem)
    if start is not None:
        assert_optimal(problem, grouped(problem, start))


@pytest.mark.parametrize('name', ENGINES)
@pytest.mark.parametrize('seed', [0, 3, 4, 9, 15, 17, 22, 28])
def test_three_boxes_are_placed_as_well_as_any_order_and_position_allows(name, seed):
    problem = tiny_problem(ENGINES[name], seed, 3)
    start = poor_start(problem)
    if start is not None:
        assert_optimal(problem, grouped(problem, start))


@pytest.mark.parametrize('cep', [False, True])
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(3, 5))
def test_it_agrees_with_the_search_over_places(cep, seed, count):
    problem = replace(tiny_problem(ENGINES['paper'], seed, count), cep=cep)
    start = poor_start(problem)
    if start is None:
        return
    over_places = JointSearch(
        problem.engine, problem.boxes, problem.bins, problem.forbidden, start, cep=cep
    ).run(20_000, lambda: False)
    found = grouped(problem, start)
    assert found.proven
    assert found.lower_bound <= over_places.objective + 1e-6
    assert found.objective >= over_places.lower_bound - 1e-6
    if over_places.proven:
        assert found.objective == pytest.approx(over_places.objective)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    weights=st.sampled_from([(1, 0, 0), (0, 1, 0), (3, 1, 10), (0.3, 2.7, 1.1)]),
)
def test_the_optimum_holds_for_any_weights(seed, weights):
    problem = tiny_problem(Engine(coarse('paper', 50), Weights(*weights)), seed, 2)
    start = poor_start(problem)
    if start is not None:
        assert_optimal(problem, grouped(problem, start))


def test_a_refused_position_is_in_no_solution():
    problem = tiny_problem(ENGINES['paper'], 2, 3)
    first = grouped(problem, poor_start(problem))
    zones = tuple(Zone(one.placed.orientation, one.placed.corner_mm) for one in first.candidates)
    barred = replace(problem, forbidden=lambda _box, _bin: zones)
    found = grouped(barred, poor_start(barred))
    assert found.proven
    for one in found.candidates:
        for zone in zones:
            x, y, z = (a - b for a, b in zip(one.placed.corner_mm, zone.corner_mm, strict=True))
            assert (
                one.placed.orientation != zone.orientation
                or z != 0
                or max(abs(x), abs(y)) >= REFUSED_RADIUS_MM
            )
    wanted = JointSearch(barred.engine, barred.boxes, barred.bins, barred.forbidden)
    assert found.objective == pytest.approx(wanted.run(10**6, lambda: False).objective)


def test_a_search_cut_short_keeps_its_start_and_a_bound_that_holds():
    cut = 0
    for seed in range(20):
        problem = tiny_problem(ENGINES['paper'], seed, 4)
        start = poor_start(problem)
        if start is None:
            continue
        best = grouped(problem, start)
        looks = iter([False, *[True] * 10**6])
        for short in (
            grouped(problem, start, most_hard=0),
            grouped(problem, start, out_of_time=lambda looks=looks: next(looks)),
        ):
            assert short.lower_bound <= best.objective + 1e-6 <= short.objective + 2e-6
            assert short.objective <= sum(one.objective for one in start) + 1e-9
            cut += not short.proven
    assert cut > 3


def test_two_boxes_that_both_want_a_corner_pay_for_the_lesser_step_aside():
    low = np.zeros((2, 40, 40), np.int32)
    shapes = np.array([[10, 20, 300], [15, 8, 300]])
    areas = np.array([[0, 30, 0, 20, 0, 0], [0, 25, 0, 32, 0, 0]])
    costs = pair_costs(
        low, shapes, areas, np.zeros(2), np.array([0, 1]), (10.0, 1.0), np.full((2, 2), 1e6)
    )
    assert costs[0, 1] == costs[1, 0] == 80.0  # the first one 8 cells behind the second


def test_pairs_that_share_no_box_add_up_and_triples_count_half():
    extra = np.zeros((4, 4))
    for i, k, pays in ((0, 1, 6.0), (2, 3, 4.0), (0, 2, 7.0), (1, 2, 7.0)):
        extra[i, k] = extra[k, i] = pays
    assert matched(2, extra[:2, :2].copy()) == 6.0
    assert matched(3, extra[:3, :3].copy()) == 10.0  # half of 6 + 7 + 7
    assert matched(4, extra) == 10.0
