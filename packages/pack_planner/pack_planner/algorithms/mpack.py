"""MPack (Ojha et al., section III-A): the joint optimum of eq. (1) over the whole look-ahead."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_msgs_py.wording import how_many
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.incumbent import best_incumbent, greedy
from pack_planner.algorithms.registry import algorithm
from pack_planner.algorithms.selection import selection_key, selection_rule
from pack_planner.engine import Candidate, Engine
from pack_planner.engine.engine import nothing_forbidden
from pack_planner.joint.bin_by_bin.search import JointSearch
from pack_planner.joint.budget import Budget
from pack_planner.joint.by_solver.solvers import solve_joint
from pack_planner.joint.solution import JointResult

#: About what one node costs, seconds.
NODE_S = 0.0001


def mpack(problem: Problem) -> Choice | None:
    """Place all boxes of the look-ahead on paper as well as possible, then one of them really.

    When there is no room for all, the box farthest from the arm is left out, and so on; a single
    box last: then every box of the look-ahead is tried on its own. Of those that stand on real
    boxes alone, the one that box selection prefers is placed; equal ones in the order of the belt.

    The joint solution starts from that of MPackLite on the same boxes and so is never worse. When
    the budget ends first, the best one found is used and the status says so.

    Backend `search` is the search bin by bin of :mod:`pack_planner.joint.bin_by_bin`, the others
    state the problem to a solver of OR-Tools.
    """
    with Budget(problem.budget_s, _nodes_of(problem)) as budget:
        proven = True
        for count in range(len(problem.boxes), 1, -1):
            result = _solve(problem, count, budget)
            if result.candidates is not None:
                return replace(_select(problem, result, proven), nodes=budget.taken)
            proven = proven and result.proven
        choice = _singly(problem, proven)
        return None if choice is None else replace(choice, nodes=budget.taken)


def _nodes_of(problem: Problem) -> float:
    return math.inf if problem.node_limit is None else problem.node_limit


def _solve(problem: Problem, count: int, budget: Budget) -> JointResult:
    """The joint optimum of the first ``count`` boxes, as far as the budget goes."""
    engine, boxes = problem.engine, problem.boxes[:count]
    known = best_incumbent(problem, boxes, budget)
    # perhaps there is no solution: a proof of that must leave time for fewer boxes
    by_half = known is None and count > 2
    if problem.backend != 'search':
        return solve_joint(
            engine, boxes, problem.bins, problem.forbidden, known, problem.backend,
            budget.seconds_left / (1 + by_half), cep=problem.cep,
        )  # fmt: skip
    search = JointSearch(engine, boxes, problem.bins, problem.forbidden, known, cep=problem.cep)
    if by_half:
        with budget.half() as half:
            search.find(half)
        budget.take(half.taken)
        if not search.found:
            return search.result()
    return search.run(budget)


def _select(problem: Problem, result: JointResult, fewest_left_out: bool) -> Choice:
    """``fewest_left_out``: it is proven that no more boxes can be placed together."""
    assert result.candidates is not None
    chosen = _least(problem, result.candidates)
    if problem.memory is not None:
        problem.memory.plan = tuple(
            (problem.bins[candidate.bin_index].source.id, candidate.placed)
            for candidate in result.candidates
            if candidate is not chosen
        )
    reason = (
        f'joint objective {result.objective:g} of {how_many(len(result.candidates), "box")}, '
        f'at least {result.lower_bound:g}'
    )
    gap = result.gap if fewest_left_out else math.inf
    return Choice(chosen, _status(fewest_left_out and result.proven), reason, gap)


def _singly(problem: Problem, proven: bool) -> Choice | None:
    engine = problem.engine
    placements = [
        engine.best_placement(box, problem.bins, problem.forbidden, cep=problem.cep)
        for box in problem.boxes
    ]
    alone = [candidate for candidate in placements if candidate is not None]
    if not alone:
        return None
    chosen = _least(problem, alone)
    reason = f'no two boxes fit together; least of {len(alone)} boxes that fit alone'
    return Choice(chosen, _status(proven), reason, 0.0 if proven else math.inf)


def _status(proven: bool) -> PlacementStatus:
    return PlacementStatus.OPTIMAL if proven else PlacementStatus.BUDGET


def _least(problem: Problem, candidates: Sequence[Candidate]) -> Candidate:
    """Box selection of section III-A.3; the lowest box always stands on real boxes alone."""
    engine, bins = problem.engine, problem.bins
    order: dict[Box, int] = {box: index for index, box in enumerate(problem.boxes)}
    key = selection_key(problem, selection_rule(problem, own='least_growth'))
    alone = [c for c in candidates if engine.stands(c.placed, bins[c.bin_index])]
    touching = [c for c in alone if engine.stands(c.placed, bins[c.bin_index], cep=problem.cep)]
    return min(touching or alone, key=lambda c: (*key(c), order[c.placed.box]))


def warm_up(engine: Engine) -> None:
    """Compile the search, or load it, so that no decision has to."""
    boxes = [Box(f'warm-up {i}', (200.0, 160.0, 80.0 + 20 * i)) for i in range(3)]
    spec = BinSpec('warm-up', (400, 300, 300))
    bins = [engine.model(Bin(f'warm-up {i}', i, spec)) for i in range(2)]
    # a poor start, all in the last bin, so that the search has something to find
    alone = greedy(Problem(engine, tuple(boxes), (bins[-1],)), boxes)
    assert alone is not None
    last = len(bins) - 1
    start = [Candidate(c.placed, last, engine.objective(c.placed, last)) for c in alone]
    for known in (start, None):
        JointSearch(engine, boxes, bins, nothing_forbidden, known).run(Budget())


algorithm('mpack', backends=True, alternatives='mpack_lite', prepare=warm_up, node_s=NODE_S)(mpack)
