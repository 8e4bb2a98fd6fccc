"""MPack under the constraints for efficient packing, by every backend."""

from __future__ import annotations

from dataclasses import replace

import pytest
from joint_cases import TINY, EveryOrder, tiny_problem
from planner_cases import coarse, engine_of

from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.algorithms import Problem
from pack_planner.algorithms.incumbent import best_incumbent
from pack_planner.algorithms.mpack import mpack
from pack_planner.joint.bin_by_bin.search import JointSearch
from pack_planner.joint.budget import Budget
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.solution import all_touch, joint_violations

PAPER = coarse('paper', 50)
SEEDS = range(8)


def solve(problem, backend):
    about = (engine_of(PAPER), problem.boxes, problem.bins, problem.forbidden, None)
    if backend == 'search':
        return JointSearch(*about, cep=problem.cep).run(Budget())
    return solve_joint(*about, backend, 30.0, cep=problem.cep)


@pytest.mark.parametrize('backend', ['search', 'cp_sat', 'milp'])
@pytest.mark.parametrize('seed', SEEDS)
def test_with_contact_every_backend_finds_what_trying_everything_finds(seed, backend):
    problem = tiny_problem(engine_of(PAPER), seed, 2, cep=True)
    result = solve(problem, backend)
    assert result.proven
    if result.candidates is not None:
        assert all_touch(result.candidates, problem.bins, engine_of(PAPER))
        assert joint_violations(result.candidates, problem.bins, engine_of(PAPER)) == []
    bound = result.objective - 1e-6
    assert EveryOrder(engine_of(PAPER), cep=True).least(problem.boxes, problem.bins, bound) == bound


@pytest.mark.parametrize('backend', ['search', 'cp_sat', 'milp'])
def test_a_box_that_could_only_stand_free_goes_to_another_bin(backend):
    pedestal = PlacedBox(Box('pedestal', (200.0, 150.0, 50.0)), (50, 50, 0), (200, 150, 50), 'xyz')
    bins = (Bin('a', 1, TINY, (pedestal,)), Bin('b', 2, TINY))
    box = Box('new', (200.0, 150.0, 100.0))
    problem = Problem(
        engine_of(PAPER), (box,), tuple(engine_of(PAPER).model(target) for target in bins)
    )
    free, touching = solve(problem, backend), solve(replace(problem, cep=True), backend)
    assert free.proven and touching.proven
    assert [candidate.bin_index for candidate in free.candidates] == [0]
    assert [candidate.bin_index for candidate in touching.candidates] == [1]
    assert touching.objective > free.objective


@pytest.mark.parametrize('seed', SEEDS)
def test_the_start_and_the_decision_touch_too(seed):
    problem = tiny_problem(engine_of(PAPER), seed, 3, cep=True)
    start = best_incumbent(problem, problem.boxes, Budget())
    if start is not None:
        assert all_touch(start, problem.bins, engine_of(PAPER))
        assert mpack(problem) is not None
