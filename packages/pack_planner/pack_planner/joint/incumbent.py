"""First joint solutions: MPackLite's, and what is left of the previous decision's."""

from __future__ import annotations

from collections.abc import Sequence

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Problem
from pack_planner.algorithms.opack import by_volume
from pack_planner.engine import Candidate

Solution = tuple[Candidate, ...]


def best_incumbent(problem: Problem, boxes: Sequence[Box]) -> Solution | None:
    """The best joint solution for ``boxes`` that is cheap to have; MPackLite's is one of them."""
    found = [
        one for one in (greedy(problem, by_volume(boxes)), remembered(problem, boxes)) if one
    ]
    return min(found, key=lambda one: sum(c.objective for c in one), default=None)


def greedy(problem: Problem, boxes: Sequence[Box], start: Solution = ()) -> Solution | None:
    """Place ``boxes`` one after another, each at its best, on top of ``start``."""
    engine = problem.engine
    virtual = list(problem.bins)
    for one in start:
        virtual[one.bin_index] = engine.with_box(virtual[one.bin_index], one.placed)
    found = list(start)
    for box in boxes:
        candidate = engine.best_placement(box, virtual, problem.forbidden)
        if candidate is None:
            return None
        found.append(candidate)
        index = candidate.bin_index
        virtual[index] = engine.with_box(virtual[index], candidate.placed)
    return tuple(found)


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
    return greedy(problem, by_volume(wanted.values()), tuple(kept))
