"""MPack on whole decisions: box selection, fewer boxes, budgets, memory, backends."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from joint_cases import TINY, tiny_box, tiny_problem
from planner_cases import coarse, engine_of, random_bin, random_box

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.rules import violations
from pack_msgs_py.validator import validate_sequence, with_box
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms import Problem
from pack_planner.algorithms.base import BACKENDS, Memory
from pack_planner.algorithms.incumbent import greedy
from pack_planner.algorithms.mpack import mpack
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine.engine import nothing_forbidden
from pack_planner.joint.bin_by_bin.search import JointSearch
from pack_planner.joint.budget import Budget

PAPER = coarse('paper', 10)
# limits of what a top carries can keep a proof from ending; the tests of the optimum have them
CELL = coarse('cell', 50, check_top_load=False)
#: Seconds, enough for a proof on a machine that does much else.
UNHURRIED_S = 60.0


def pack(engine, spec, boxes, look_ahead, **options):
    """Fill one bin until nothing fits; its content and the choices."""
    target, belt, choices = Bin('bin-1', 1, spec), list(boxes), []
    memory = Memory()
    while belt:
        ahead = tuple(belt[:look_ahead])
        problem = Problem(engine, ahead, (engine.model(target),), memory=memory, **options)
        choice = mpack(problem)
        if choice is None:
            break
        choices.append(choice)
        target = with_box(target, choice.candidate.placed)
        belt.remove(choice.candidate.placed.box)
    return target, choices


def joint_objective(choice):
    """Objective over the whole look-ahead; ``None`` when each box was tried alone."""
    if choice is None or not choice.reason.startswith('joint objective'):
        return None
    return float(choice.reason.split()[2])


def test_the_joint_objective_is_never_above_that_of_mpack_lite_and_often_below():
    engine = engine_of(coarse('paper', 50))
    better = compared = 0
    for seed in range(25):
        problem = tiny_problem(engine, seed, 3)
        joint = joint_objective(mpack(problem))
        lite = greedy(problem, by_volume(problem.boxes))
        if lite is None or joint is None:
            continue
        compared += 1
        total = sum(candidate.objective for candidate in lite)
        assert joint <= total + 1e-3
        better += joint < total - 1e-3
    assert compared > 10 and better > 2


@pytest.mark.parametrize('seed', range(12))
def test_the_chosen_box_stands_on_real_boxes_alone(seed):
    problem = tiny_problem(engine_of(CELL), seed, 4, budget_s=UNHURRIED_S)
    choice = mpack(problem)
    if choice is None:
        for box in problem.boxes:
            assert engine_of(CELL).best_placement(box, problem.bins) is None
        return
    assert choice.status is PlacementStatus.OPTIMAL and choice.gap == 0.0
    target = problem.bins[choice.candidate.bin_index].source
    placed = choice.candidate.placed
    assert not list(violations(placed, target.boxes, target.spec, CELL))


def test_the_farthest_box_is_left_out_when_not_all_fit():
    spec = BinSpec('20x10x10', (200, 100, 100))
    half, whole = Box('half', (100.0, 100.0, 100.0)), Box('whole', (200.0, 100.0, 100.0))
    model = engine_of(PAPER).model(Bin('a', 1, spec))
    choice = mpack(Problem(engine_of(PAPER), (half, replace(half, id='other'), whole), (model,)))
    assert choice is not None and choice.status is PlacementStatus.OPTIMAL
    assert 'of 2 boxes' in choice.reason
    # no two together: each is tried alone, the one of least increase is placed
    choice = mpack(Problem(engine_of(PAPER), (whole, half), (model,)))
    assert choice is not None and choice.status is PlacementStatus.OPTIMAL
    assert choice.candidate.placed.box == whole
    full = with_box(model.source, choice.candidate.placed)
    assert mpack(Problem(engine_of(PAPER), (half, whole), (engine_of(PAPER).model(full),))) is None


def test_a_single_box_goes_where_mpack_lite_puts_it():
    for seed in range(8):
        problem = tiny_problem(engine_of(CELL), seed, 1)
        lite, joint = mpack_lite(problem), mpack(problem)
        assert (lite is None) == (joint is None)
        if lite is not None:
            assert joint.candidate == lite.candidate


def test_a_whole_bin_packed_by_mpack_obeys_the_rules():
    rng = random.Random(4)
    boxes = [tiny_box(rng, f'box-{i}') for i in range(30)]
    target, choices = pack(engine_of(CELL), TINY, boxes, 4, budget_s=UNHURRIED_S)
    assert len(target.boxes) > 5
    assert validate_sequence(target.boxes, TINY, CELL) == []
    assert all(choice.status is PlacementStatus.OPTIMAL for choice in choices)


def test_a_budget_of_nodes_gives_the_same_plan_every_time():
    rng = random.Random(8)
    boxes = [random_box(rng, f'box-{i}') for i in range(12)]
    spec = BinSpec('60x40x40', (600, 400, 400))
    plans = [pack(engine_of(PAPER), spec, boxes, 5, node_limit=40, budget_s=1e6) for _ in range(2)]
    assert plans[0] == plans[1]
    assert {choice.status for choice in plans[0][1]} == {
        PlacementStatus.BUDGET, PlacementStatus.OPTIMAL,
    }  # fmt: skip
    assert all(
        (choice.gap > 0) == (choice.status is PlacementStatus.BUDGET) for choice in plans[0][1]
    )


def test_without_any_time_there_is_still_an_answer():
    rng = random.Random(11)
    boxes = tuple(random_box(rng, f'box-{i}') for i in range(5))
    model = engine_of(PAPER).model(random_bin(engine_of(PAPER), rng, 2))
    for backend in BACKENDS:
        choice = mpack(Problem(engine_of(PAPER), boxes, (model,), budget_s=0.0, backend=backend))
        assert choice is not None and choice.status is PlacementStatus.BUDGET
        assert choice.gap > 0


def test_the_previous_plan_is_a_start_for_the_next_decision():
    engine = engine_of(coarse('paper', 50))
    continued = 0
    for seed in range(12):
        memory = Memory()
        problem = tiny_problem(engine, seed, 4, memory=memory)
        first = mpack(problem)
        if first is None or 'of 4 boxes' not in first.reason:
            continue
        chosen = first.candidate
        rest = tuple(box for box in problem.boxes if box != chosen.placed.box)
        assert {placed.box for _, placed in memory.plan} == set(rest)
        bins = list(problem.bins)
        bins[chosen.bin_index] = engine.with_box(bins[chosen.bin_index], chosen.placed)
        second = mpack(replace(problem, boxes=rest, bins=tuple(bins), node_limit=0))
        planned = joint_objective(first) - chosen.objective
        assert joint_objective(second) <= planned + 1e-3
        continued += 1
    assert continued > 3


@pytest.mark.parametrize('backend', ['cp_sat', 'milp'])
@pytest.mark.parametrize('decide', [mpack, mpack_lite])
def test_a_decision_by_a_solver_has_the_objective_of_our_own(backend, decide):
    engine = engine_of(coarse('paper', 50))
    for seed in (0, 2, 7):
        problem = tiny_problem(engine, seed, 2)
        ours, theirs = decide(problem), decide(replace(problem, backend=backend, budget_s=30.0))
        assert (ours is None) == (theirs is None)
        if ours is None:
            continue
        assert theirs.status is PlacementStatus.OPTIMAL
        if decide is mpack:
            assert joint_objective(theirs) == joint_objective(ours)
        target = problem.bins[theirs.candidate.bin_index].source
        assert engine.broken_rules(theirs.candidate, target) == ''


def test_an_unknown_backend_is_refused():
    with pytest.raises(ValueError, match=r"unknown backend 'gurobi'.*search, cp_sat, milp"):
        Problem(engine_of(PAPER), (), (), backend='gurobi')


def test_the_example_on_the_page_ends_as_it_is_drawn():
    """The one of docs/mpack.md: B needs A beside P before it, and a start there is none."""
    engine = engine_of(coarse('paper', 100, resolution_z_mm=100, orientations='upright'))
    size = (200.0, 200.0, 100.0)
    there = PlacedBox(Box('P', size), (0, 0, 0), (200, 200, 100), 'xyz')
    model = engine.model(Bin('a', 1, BinSpec('40x20x30', (400, 200, 300)), (there,)))
    boxes = tuple(Box(name, (length, *size[1:])) for name, length in
                  (('A', 200.0), ('B', 300.0), ('C', 100.0)))  # fmt: skip
    assert greedy(Problem(engine, boxes, (model,)), by_volume(boxes)) is None
    result = JointSearch(engine, boxes, (model,), nothing_forbidden).run(Budget())
    assert result.proven and result.objective == 380.0
    places = {c.placed.box.id: (c.placed.corner_mm[0], c.placed.corner_mm[2], c.objective)
              for c in result.candidates}  # fmt: skip
    assert places == {'A': (200, 0, 130.0), 'B': (100, 100, 130.0), 'C': (0, 100, 120.0)}
