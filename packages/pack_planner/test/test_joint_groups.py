"""The search proves the same optima as trying every order and position, and its parts."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joint_cases import EveryOrder, tiny_problem
from numba import njit
from planner_cases import Engines, coarse

from pack_planner.algorithms.incumbent import best_incumbent, greedy
from pack_planner.algorithms.mpack import warm_up
from pack_planner.engine import Engine, Weights, Zone
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.joint.bin_by_bin.assignments import assignments, later
from pack_planner.joint.bin_by_bin.disjoint_pairs import matched as compiled_matched
from pack_planner.joint.bin_by_bin.disjoint_pairs import matched_wholes as compiled_wholes
from pack_planner.joint.bin_by_bin.group import explore
from pack_planner.joint.bin_by_bin.group_problem import PlacedTops
from pack_planner.joint.bin_by_bin.option_pairs import pair_costs
from pack_planner.joint.bin_by_bin.options import BoxOptions, holding
from pack_planner.joint.bin_by_bin.search import JointSearch
from pack_planner.joint.bin_by_bin.who_goes_behind import least_behind as compiled_behind
from pack_planner.joint.bin_by_bin.who_goes_behind import room_for
from pack_planner.joint.budget import Budget
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.solution import all_touch, joint_violations

ENGINES = Engines({name: coarse(name, 50) for name in ('paper', 'cell')})


@njit
def matched(count, extra):
    return compiled_matched(count, extra)


@njit
def matched_wholes(count, extra, whole, matches):
    return compiled_wholes(count, extra, whole, matches)


@njit
def least_behind(count, pairs, most, room):
    return compiled_behind(count, pairs, most, room)


#: Never raised.
GO_ON = np.zeros(1, np.bool_)


def grouped(problem, start, budget=None):
    about = (problem.engine, problem.boxes, problem.bins, problem.forbidden, start)
    return JointSearch(*about, cep=problem.cep).run(budget or Budget())


def by_cp_sat(problem, start=None):
    about = (problem.engine, problem.boxes, problem.bins, problem.forbidden, start)
    return solve_joint(*about, 'cp_sat', 10.0, cep=problem.cep)


def poor_start(problem):
    """Small boxes first; with contact whatever there is."""
    if problem.cep:
        return best_incumbent(problem, problem.boxes, Budget())
    return greedy(problem, sorted(problem.boxes, key=lambda box: box.volume_mm3))


def assert_optimal(problem, result):
    assert result.proven
    assert joint_violations(result.candidates, problem.bins, problem.engine) == []
    assert not problem.cep or all_touch(result.candidates, problem.bins, problem.engine)
    assert sum(candidate.objective for candidate in result.candidates) == pytest.approx(
        result.objective
    )
    bound = result.objective - 1e-6
    least = EveryOrder(problem.engine, problem.cep).least(problem.boxes, problem.bins, bound)
    assert least == bound


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
@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(3, 4))
def test_it_agrees_with_cp_sat(cep, seed, count):
    problem = replace(tiny_problem(ENGINES['paper'], seed, count), cep=cep)
    start = poor_start(problem)
    if start is None:
        return
    wanted, result = by_cp_sat(problem, start), grouped(problem, start)
    assert result.proven
    assert result.lower_bound <= wanted.objective + 1e-6
    assert result.objective >= wanted.lower_bound - 1e-6
    if wanted.proven:
        assert result.objective == pytest.approx(wanted.objective)


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


@pytest.mark.parametrize('weights', [(1, 1, 100), (3, 1, 10), (0.3, 2.7, 1.1)])
def test_any_weights_lead_to_the_same_optimum_from_a_poor_start(weights):
    problem = tiny_problem(Engine(coarse('paper', 50), Weights(*weights)), 4, 3)
    wanted, result = grouped(problem, None), grouped(problem, poor_start(problem))
    assert wanted.proven and result.proven
    assert result.objective == pytest.approx(wanted.objective)


def test_a_refused_position_is_in_no_solution():
    problem = tiny_problem(ENGINES['paper'], 2, 3)
    first = grouped(problem, poor_start(problem))
    zones = tuple(
        Zone(candidate.placed.orientation, candidate.placed.corner_mm)
        for candidate in first.candidates
    )
    barred = replace(problem, forbidden=lambda _box, _bin: zones)
    result = grouped(barred, poor_start(barred))
    assert result.proven
    for candidate in result.candidates:
        for zone in zones:
            x, y, z = (
                a - b for a, b in zip(candidate.placed.corner_mm, zone.corner_mm, strict=True)
            )
            assert (
                candidate.placed.orientation != zone.orientation
                or z != 0
                or max(abs(x), abs(y)) >= REFUSED_RADIUS_MM
            )
    assert result.objective == pytest.approx(by_cp_sat(barred).objective)


def test_nothing_is_compiled_after_the_warm_up():
    warm_up(ENGINES['paper'])
    before = len(explore.signatures)
    for name, engine in ENGINES.items():
        for seed in range(4):
            problem = tiny_problem(engine, seed, 3)
            start = poor_start(problem)
            assert start is None or grouped(problem, start).proven, name
    assert len(explore.signatures) == before == 1


def test_a_search_cut_short_keeps_its_start_and_a_bound_that_holds():
    cut = 0
    for seed in range(20):
        problem = tiny_problem(ENGINES['paper'], seed, 4)
        start = poor_start(problem)
        if start is None:
            continue
        best = grouped(problem, start)
        for budget in (Budget(seconds=0.0), Budget(nodes=0), Budget(nodes=5), Budget(nodes=50)):
            short = grouped(problem, start, budget)
            assert short.nodes <= 50
            assert short.lower_bound <= best.objective + 1e-6 <= short.objective + 2e-6
            assert short.objective <= sum(candidate.objective for candidate in start) + 1e-9
            cut += not short.proven
    assert cut > 3


def free_rows(count, cells):
    """Rows whose boxes can be at every cell."""
    return np.zeros((count, cells), np.int16)


def test_two_boxes_that_both_want_a_corner_pay_for_the_lesser_step_aside():
    rows, cells = np.array([[0, 0], [1, 1]]), 40
    sizes, box = np.array([[10, 20], [15, 8]]), np.array([0, 1])
    free, zeros, limits = free_rows(2, cells), np.zeros(2), np.full((2, 2), 1e6)
    costs, behind = np.zeros((2, 2)), np.zeros((2, 2))

    def compare(*spans):
        pair_costs(
            rows, free, free, sizes, np.array(spans), box, zeros, zeros, 10.0, limits,
            np.array([1, 0]), costs, behind, GO_ON,
        )  # fmt: skip

    compare([0, 300], [100, 400])
    assert costs[0, 1] == costs[1, 0] == 80.0  # the first one 8 cells behind the second
    assert (behind[1, 0], behind[0, 1]) == (80.0, 100.0)
    costs[:], behind[:] = 0.0, 0.0
    compare([0, 300], [300, 600])
    assert not costs.any() and not behind.any()


def listed(costs, leans, holds, upper):
    """Assignments of options, as many for each of the boxes, that cost less than ``upper``."""
    count, each = len(costs), len(costs[0])
    extra = np.zeros((count * each, count * each))
    starts = np.arange(0, count * each + 1, each)
    costs, leans = np.array(costs, float).ravel(), np.array(leans, bool)
    picks = assignments(
        starts, costs, extra, extra, np.arange(count * each), np.full(count, -1), leans, holds,
        np.ascontiguousarray(holds.T), 3, later(starts, costs, leans, holds, 3, GO_ON),
        room_for(count), upper, 100, 10**6, GO_ON,
    )  # fmt: skip
    return {tuple(pick) for pick in picks.tolist()}


def test_an_option_that_leans_is_only_had_with_one_that_holds_it_up_and_its_price():
    holds = np.zeros((4, 4), np.int8)
    holds[1, 3] = 4  # option 1 of the first box leans on option 3 of the second
    costs, leans = [[10, 12], [10, 17]], [False, True, False, False]
    assert listed(costs, leans, holds, 100.0) == {(0, 2), (0, 3), (1, 3)}
    assert listed(costs, leans, holds, 29.0) == {(0, 2), (0, 3)}
    holds[1, 3] = 2  # where it reaches two corners alone
    assert listed(costs, leans, holds, 100.0) == {(0, 2), (0, 3)}


def test_two_options_hold_up_what_none_of_them_could_alone():
    holds = np.zeros((6, 6), np.int8)
    holds[0, 3], holds[0, 5] = 2, 1
    costs, leans = [[5, 9], [10, 12], [10, 13]], [True, *[False] * 5]
    assert {pick for pick in listed(costs, leans, holds, 100.0) if pick[0] == 0} == {(0, 3, 5)}
    assert {pick for pick in listed(costs, leans, holds, 30.0) if pick[0] == 0} == set()


def every_assignment(starts, costs, extra, _behind, rank, twin, leans, holds, needed, upper):
    """The same by trying all, for :func:`test_no_assignment_is_missed_and_none_too_many`."""
    picks = set()
    for pick in product(*(range(a, b) for a, b in pairwise(starts.tolist()))):
        chosen = list(pick)
        held = all(holds[o, chosen].sum() >= needed for o in chosen if leans[o])
        ordered = all(t < 0 or rank[pick[t]] <= rank[o] for t, o in zip(twin, pick, strict=True))
        pays = extra[np.ix_(chosen, chosen)].copy()
        if held and ordered and costs[chosen].sum() + matched(len(pick), pays) < upper - 1e-6:
            picks.add(pick)
    return picks


@pytest.mark.parametrize('count', [1, 2, 3, 4, 5])
def test_no_assignment_is_missed_and_none_too_many(count):
    random = np.random.default_rng(count)
    total = 0
    for _ in range(40):
        sizes = random.integers(1, 6, count)
        starts = np.concatenate([[0], np.cumsum(sizes)])
        costs = np.concatenate([np.sort(random.integers(0, 30, n)) for n in sizes]).astype(float)
        n = len(costs)
        extra = random.choice([0.0] * 7 + [4.0, 9.0, np.inf], (n, n))
        extra = np.maximum(extra, extra.T)
        rank, leans = random.integers(0, 5, n), random.random(n) < 0.5
        holds = random.choice(np.array([0, 0, 0, 1, 2, 4], np.int8), (n, n))
        np.fill_diagonal(holds, 0)
        needed = int(random.integers(1, 5))
        twin = np.array([i - 1 if random.random() < 0.2 else -1 for i in range(count)])
        given = (starts, costs, extra, np.zeros((n, n)), rank, twin, leans, holds)
        upper = float(costs[starts[:-1]].sum() + random.integers(5, 80))
        held = np.ascontiguousarray(holds.T)
        after = later(starts, costs, leans, holds, needed, GO_ON)
        about = (*given, held, needed, after, room_for(count), upper)
        picks = assignments(*about, 10**5, 10**7, GO_ON).tolist()
        wanted = every_assignment(*given, needed, upper)
        assert len(picks) == len(wanted)
        assert {tuple(pick) for pick in picks} == wanted
        total += len(wanted)
        if len(wanted) > 1:
            most = len(wanted) - 1
            assert len(assignments(*about, most, 10**7, GO_ON)) == len(wanted)
            assert len(assignments(*about, most, 10**7, ~GO_ON)) > most
    assert total > 40


def least_by_trying(pays, count):
    """What boxes pay at least, by all ways to say who of each pair goes behind."""
    least = np.inf
    for ways in product((0, 1), repeat=len(pays)):
        asked = [pays[n, way] for n, way in enumerate(ways)]
        least = min(least, np.max([np.zeros(count), *asked], axis=0).sum())
    return least


@pytest.mark.parametrize('count', [2, 3, 4, 5])
def test_of_two_boxes_that_meet_one_goes_behind_and_pays_once_for_all_before_it(count):
    random = np.random.default_rng(count)
    for _ in range(60):
        pairs = int(random.integers(0, count * (count - 1) // 2 + 1))
        room = room_for(count)
        pays = random.choice([0.0, 0.0, 3.0, 4.0, 10.0, 1e18], (pairs, 2, count))
        room[0][:pairs] = pays
        wanted = least_by_trying(pays, count)
        most = float(random.choice([5.0, 20.0, np.inf]))
        assert least_behind(count, pairs, most, room) == min(wanted, most)


def test_of_boxes_that_all_want_one_corner_all_but_one_pay():
    room = room_for(4)
    for pair, (i, k) in enumerate(combinations(range(4), 2)):
        room[0][pair, 0, k] = room[0][pair, 1, i] = 10.0
    assert least_behind(4, 6, np.inf, room) == 30.0


def held_corners(sizes, height, needed=3):
    """Corners of the second box that the first one may hold; bases sorted, the second on top."""
    count = len(sizes)
    top = np.arange(1, count + 1) * 100
    flags = np.arange(count) > 0
    options = BoxOptions(
        np.arange(count), top - 100, top, flags, np.array([(*size, 10) for size in sizes]),
        *[np.zeros(count)] * 2, *[np.zeros((count, 2), int)] * 2, *[np.zeros((1, 1), np.int16)] * 2,
    )  # fmt: skip
    return int(
        holding(options, PlacedTops(np.full((3, 3), height, np.int32), 5, needed), GO_ON)[1, 0]
    )


def test_a_box_holds_no_more_corners_than_it_is_large():
    assert held_corners([(4, 6), (4, 6)], 0) == 4
    assert held_corners([(4, 6), (5, 6)], 0) == 2  # an edge of 5 on one of 6
    assert held_corners([(4, 6), (7, 9)], 0) == 1
    # a placed top at the same height may hold the others
    assert held_corners([(4, 6), (7, 9)], 98) == 3
    assert held_corners([(4, 6), (7, 9)], 90) == 1


@pytest.mark.parametrize('cep', [False, True])
@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), count=st.integers(2, 4))
def test_without_a_known_solution_it_finds_one_or_proves_there_is_none(cep, seed, count):
    problem = replace(tiny_problem(ENGINES['paper'], seed, count), cep=cep)
    wanted, result = by_cp_sat(problem), grouped(problem, None)
    assert result.lower_bound <= wanted.objective + 1e-6
    if result.proven and wanted.proven:
        assert result.objective == pytest.approx(wanted.objective)
    if result.candidates is not None:
        assert joint_violations(result.candidates, problem.bins, problem.engine) == []
        assert result.objective >= wanted.lower_bound - 1e-6


@pytest.mark.parametrize('weights', [(0, 0, 0), (0, 0, 1), (0, 1, 0)])
def test_without_a_known_solution_any_weights_will_do(weights):
    engine = Engine(coarse('paper', 50), Weights(*weights))
    for seed in range(4):
        problem = tiny_problem(engine, seed, 3)
        assert_optimal(problem, grouped(problem, None))


def test_boxes_that_do_not_fit_together_are_proven_not_to():
    proven = 0
    for seed in range(240):
        problem = tiny_problem(ENGINES['paper'], seed, 4)
        result = grouped(problem, None)
        assert result.proven
        if result.candidates is None:
            wanted = by_cp_sat(problem)
            assert wanted.candidates is None
            assert result.lower_bound == np.inf
            proven += wanted.proven
    assert proven > 3


def test_pairs_that_share_no_box_add_up_and_triples_count_half():
    extra = np.zeros((4, 4))
    for i, k, pays in ((0, 1, 6.0), (2, 3, 4.0), (0, 2, 7.0), (1, 2, 7.0)):
        extra[i, k] = extra[k, i] = pays
    assert matched(2, extra[:2, :2].copy()) == 6.0
    assert matched(3, extra[:3, :3].copy()) == 10.0  # half of 6 + 7 + 7
    assert matched(4, extra) == 10.0


def test_a_box_pays_for_what_rests_on_it_and_no_box_pays_twice():
    extra = np.zeros((3, 3))
    extra[0, 1] = extra[1, 0] = 6.0
    extra[1, 2] = extra[2, 1] = 5.0
    assert matched_wholes(3, extra, np.array([0b001, 0b010, 0b100]), np.empty(8)) == 6.0
    # the third box rests on the second: no pair of these is left for it
    assert matched_wholes(3, extra, np.array([0b001, 0b110, 0b100]), np.empty(8)) == 6.0
    # ... and none is possible that would need it twice
    assert matched_wholes(3, extra, np.array([0b101, 0b110, 0b100]), np.empty(8)) == 0.0
