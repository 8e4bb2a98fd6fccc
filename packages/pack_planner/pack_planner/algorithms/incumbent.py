"""First joint solutions: MPackLite's, and what is left of the previous decision's."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pack_msgs_py.values import Box, PlacedBox
from pack_planner.algorithms.base import Problem
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine import BinModel, Candidate
from pack_planner.joint.budget import Budget
from pack_planner.joint.solution import all_touch

Solution = tuple[Candidate, ...]

#: How many single placements the search for a good start may take.
_TRIES = 1000


def best_incumbent(problem: Problem, boxes: Sequence[Box], budget: Budget) -> Solution | None:
    """The best joint solution for ``boxes`` that is cheap to have; MPackLite's is one of them.

    That one and the remembered one also when the budget is out.
    """
    starts = (greedy(problem, by_volume(boxes)), remembered(problem, boxes))
    best = min((start for start in starts if start), key=_total, default=None)
    return _other_orders(problem, boxes, best, budget)


def _total(solution: Solution) -> float:
    return sum(candidate.objective for candidate in solution)


def _other_orders(
    problem: Problem, boxes: Sequence[Box], best: Solution | None, budget: Budget
) -> Solution | None:
    """Place the boxes in every order, as long as that seems to lead to less than ``best``.

    A box is taken to need at least what it needs now: not quite a bound, since others may carry it
    to a better place, but a start need not be the best one.
    """
    engine, total = problem.engine, math.inf if best is None else _total(best)
    seen: set[frozenset[PlacedBox]] = set()
    tries = _TRIES

    def extend(done: Solution, cost: float, virtual: list[BinModel], left: list[Box]) -> None:
        nonlocal best, total, tries
        if not left:
            if cost < total - 1e-9:
                best, total = done, cost
            return
        tries -= len(left)
        known: list[Candidate] = []
        for box in left:
            if tries < 0 or budget.seconds_left <= 0.0:
                return
            option = engine.best_placement(box, virtual, problem.forbidden, cep=problem.cep)
            if option is None:
                return
            known.append(option)
        if cost + _total(tuple(known)) >= total - 1e-9:
            return
        for candidate in sorted(known, key=lambda c: -c.placed.box.volume_mm3):
            placements = frozenset(c.placed for c in (*done, candidate))
            if placements in seen:
                continue
            seen.add(placements)
            index = candidate.bin_index
            after = [*virtual]
            after[index] = engine.with_box(after[index], candidate.placed)
            rest = [box for box in left if box is not candidate.placed.box]
            extend((*done, candidate), cost + candidate.objective, after, rest)

    extend((), 0.0, list(problem.bins), list(boxes))
    return best


def greedy(problem: Problem, boxes: Sequence[Box], start: Solution = ()) -> Solution | None:
    """Place ``boxes`` one after another, each at its best, on top of ``start``."""
    engine = problem.engine
    virtual = list(problem.bins)
    for candidate in start:
        j = candidate.bin_index
        virtual[j] = engine.with_box(virtual[j], candidate.placed)
    solution = list(start)
    for box in boxes:
        best = engine.best_placement(box, virtual, problem.forbidden, cep=problem.cep)
        if best is None:
            return None
        solution.append(best)
        virtual[best.bin_index] = engine.with_box(virtual[best.bin_index], best.placed)
    return tuple(solution)


def remembered(problem: Problem, boxes: Sequence[Box]) -> Solution | None:
    """What the last joint solution meant for these boxes, the new ones placed on top of it."""
    if problem.memory is None or not problem.memory.plan:
        return None
    engine = problem.engine
    numbers = {model.source.id: index for index, model in enumerate(problem.bins)}
    virtual = list(problem.bins)
    wanted = {box.id: box for box in boxes}
    kept: list[Candidate] = []
    for bin_id, placed in problem.memory.plan:
        index = numbers.get(bin_id)
        if index is None or wanted.get(placed.box.id) != placed.box:
            continue
        refused = problem.forbidden(placed.box, problem.bins[index].source)
        if refused is None or refused or not engine.stands(placed, virtual[index]):
            continue
        del wanted[placed.box.id]
        kept.append(Candidate(placed, index, engine.objective(placed, index)))
        virtual[index] = engine.with_box(virtual[index], placed)
    solution = greedy(problem, by_volume(wanted.values()), tuple(kept))
    # what a box touched may have gone elsewhere
    if problem.cep and solution is not None and not all_touch(solution, problem.bins, engine):
        return None
    return solution
