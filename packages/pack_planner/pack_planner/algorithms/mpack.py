"""MPack (Ojha et al., section III-A): the joint optimum of eq. (1) over the whole look-ahead."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.incumbent import best_incumbent, greedy
from pack_planner.algorithms.registry import algorithm
from pack_planner.algorithms.selection import selection_key, selection_rule
from pack_planner.engine import Candidate, Engine
from pack_planner.engine.engine import nothing_forbidden
from pack_planner.joint.bin_by_bin.search import GroupedSearch
from pack_planner.joint.by_solver.solvers import cp_sat_installed, solve_joint
from pack_planner.joint.solution import JointResult
from pack_planner.joint.solve import MOST_ENTRIES, JointSearch

#: How long our search over places tries before the others do, seconds.
HEAD_START_S = 0.1
#: Places that are listed in a bin for each second of the budget, where CP-SAT can take over.
_ENTRIES_PER_S = 20_000


def mpack(problem: Problem) -> Choice | None:
    """Place all boxes of the look-ahead on paper as well as possible, then one of them really.

    When there is no room for all, the box farthest from the arm is left out, and so on; a single
    box last: then every box of the look-ahead is tried on its own. Of those that stand on real
    boxes alone, the one that box selection prefers is placed; equal ones in the order of the belt.

    The joint solution starts from that of MPackLite on the same boxes and so is never worse. When
    the budget ends first, the best one found is used and the status says so.

    Backend `search`: a search over places proves most decisions in a few hundredths of a second.
    What is left after :data:`HEAD_START_S` goes to a search bin by bin, and where that finds too
    much to list, to CP-SAT, where OR-Tools is installed; each starts from what the one before found
    and proved. A limit of nodes keeps to the first, since it alone counts them.
    """
    deadline = time.monotonic() + problem.budget_s
    nodes_left = math.inf if problem.node_limit is None else problem.node_limit
    proven = True
    for count in range(len(problem.boxes), 1, -1):
        result = _solve(problem, count, nodes_left, deadline)
        nodes_left -= result.nodes
        if result.candidates is not None:
            return _select(problem, result, proven)
        proven = proven and result.proven
    return _singly(problem, proven)


def _solve(problem: Problem, count: int, node_limit: float, deadline: float) -> JointResult:
    """The joint optimum of the first ``count`` boxes, as far as the budget goes."""
    engine, boxes = problem.engine, problem.boxes[:count]
    known = best_incumbent(problem, boxes)
    last = deadline
    if known is None and count > 2:
        # perhaps there is no solution: a proof of that must leave time for fewer boxes
        node_limit, deadline = node_limit / 2, _halfway(deadline)
    if problem.backend != 'search':
        return solve_joint(
            engine, boxes, problem.bins, problem.forbidden, known, problem.backend,
            deadline - time.monotonic(), cep=problem.cep,
        )  # fmt: skip
    to_the_end = problem.node_limit is not None or not cp_sat_installed()
    search = JointSearch(
        engine, boxes, problem.bins, problem.forbidden, known, cep=problem.cep,
        most_entries=MOST_ENTRIES if to_the_end else int(_ENTRIES_PER_S * problem.budget_s),
    )  # fmt: skip
    if to_the_end:
        return search.run(int(min(node_limit, 1 << 40)), lambda: time.monotonic() > deadline)
    head_start = min(deadline, time.monotonic() + HEAD_START_S)
    ours = search.run(1 << 40, lambda: time.monotonic() > head_start)
    if not ours.proven:
        ours = _by_groups(problem, boxes, search, ours, (deadline, last))
    if not ours.proven and time.monotonic() < last:
        is_found = ours.candidates is not None
        until = last if is_found or deadline == last else _halfway(last)
        ours = _by_cp_sat(problem, boxes, search, ours, until)
        if not is_found and ours.candidates is not None and not ours.proven:
            ours = _by_groups(problem, boxes, search, ours, (last, last))
    return ours


def _halfway(deadline: float) -> float:
    return (time.monotonic() + deadline) / 2


def _by_groups(
    problem: Problem, boxes: Sequence[Box], search: JointSearch, ours: JointResult,
    deadlines: tuple[float, float],
) -> JointResult:  # fmt: skip
    """What the search bin by bin makes of ``ours``; ``deadlines`` without and with a solution."""
    grouped = GroupedSearch(
        problem.engine, boxes, problem.bins, problem.forbidden, ours.candidates, search.reach,
        ours.lower_bound, cep=problem.cep,
    )  # fmt: skip

    def seconds_left() -> float:
        return deadlines[grouped.found] - time.monotonic()

    found = grouped.run(lambda: seconds_left() <= 0, seconds_left)
    return replace(found, nodes=ours.nodes + found.nodes)


def _by_cp_sat(
    problem: Problem, boxes: Sequence[Box], search: JointSearch, ours: JointResult, deadline: float
) -> JointResult:
    theirs = solve_joint(
        problem.engine, boxes, problem.bins, problem.forbidden, ours.candidates, 'cp_sat',
        deadline - time.monotonic(), cep=problem.cep, reach=search.reach,
        at_least=ours.lower_bound,
    )  # fmt: skip
    lower = min(max(ours.lower_bound, theirs.lower_bound), theirs.objective)
    return replace(theirs, lower_bound=lower, nodes=ours.nodes)


def _select(problem: Problem, result: JointResult, fewest_left_out: bool) -> Choice:
    """``fewest_left_out``: it is proven that no more boxes can be placed together."""
    assert result.candidates is not None
    chosen = _least(problem, result.candidates)
    if problem.memory is not None:
        problem.memory.plan = tuple(
            (problem.bins[one.bin_index].source.id, one.placed)
            for one in result.candidates
            if one is not chosen
        )
    reason = (
        f'joint objective {result.objective:g} of {len(result.candidates)} boxes, '
        f'at least {result.lower_bound:g}'
    )
    gap = result.gap if fewest_left_out else math.inf
    return Choice(chosen, _status(fewest_left_out and result.proven), reason, gap)


def _singly(problem: Problem, proven: bool) -> Choice | None:
    engine = problem.engine
    found = [
        engine.best_placement(box, problem.bins, problem.forbidden, cep=problem.cep)
        for box in problem.boxes
    ]
    alone = [one for one in found if one is not None]
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
    alone = [one for one in candidates if engine.stands(one.placed, bins[one.bin_index])]
    touching = [
        one for one in alone if engine.stands(one.placed, bins[one.bin_index], cep=problem.cep)
    ]
    return min(touching or alone, key=lambda one: (*key(one), order[one.placed.box]))


def warm_up(engine: Engine) -> None:
    """Compile the searches, or load them, so that no decision has to."""
    boxes = [Box(f'warm-up {i}', (200.0, 160.0, 80.0 + 20 * i)) for i in range(3)]
    spec = BinSpec('warm-up', (400, 300, 300))
    bins = [engine.model(Bin(f'warm-up {i}', i, spec)) for i in range(2)]
    # a poor start, all in the last bin, so that each search has something to find
    alone = greedy(Problem(engine, tuple(boxes), (bins[-1],)), boxes)
    assert alone is not None
    last = len(bins) - 1
    start = [Candidate(one.placed, last, engine.objective(one.placed, last)) for one in alone]
    search = JointSearch(engine, boxes, bins, nothing_forbidden, start)
    search.run(50, lambda: False)
    for known in (start, None):
        grouped = GroupedSearch(engine, boxes, bins, nothing_forbidden, known, search.reach, 0.0)
        grouped.run(lambda: False)
    if cp_sat_installed():
        solve_joint(engine, boxes, bins, nothing_forbidden, None, 'cp_sat', 1.0, reach=search.reach)


algorithm('mpack', backends=True, alternatives='mpack_lite', prepare=warm_up)(mpack)
