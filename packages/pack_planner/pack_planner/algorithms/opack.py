"""OPack (Ojha et al., section III-B, algorithm 2): virtual packing for any single-box rule."""

from __future__ import annotations

from collections.abc import Iterable

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, PackRule, Problem
from pack_planner.algorithms.selection import selection_key, selection_rule
from pack_planner.engine import Candidate


def by_volume(boxes: Iterable[Box]) -> list[Box]:
    """SORT: decreasing volume, ties by decreasing height, then in the order of the belt."""
    return sorted(boxes, key=lambda box: (-box.volume_mm3, -box.size_mm[2]))


def sorted_boxes(boxes: Iterable[Box], sort: str) -> list[Box]:
    """SORT by the rule ``sort``; heights and areas are those of the box as it lies on the belt.

    ``volume`` : decreasing volume, ties by decreasing height (the paper's for MPackLite).
    ``area`` : decreasing base area, ties by decreasing height (Crainic, Perboli, Tadei 2008).
    ``height`` : decreasing height, ties by decreasing base area.
    ``arrival`` : in the order of the belt.
    """
    if sort == 'volume':
        return by_volume(boxes)
    if sort == 'area':
        return sorted(boxes, key=lambda box: (-_area(box), -box.size_mm[2]))
    if sort == 'height':
        return sorted(boxes, key=lambda box: (-box.size_mm[2], -_area(box)))
    return list(boxes)


def _area(box: Box) -> float:
    return box.size_mm[0] * box.size_mm[1]


def opack(problem: Problem, pack_rule: PackRule) -> Choice | None:
    """One step of OPack.

    The boxes of the look-ahead are placed virtually one after another in the order of SORT; a box
    that fits nowhere is passed over. BOXPACK then picks, among those that stand without the
    virtual ones, by box selection; equal ones in the order of SORT. With constraints for efficient
    packing, a box must have its contacts without the virtual ones as well.

    The first box that fits is placed on the real boxes alone and so stands alone: when nothing is
    found here, no box of the look-ahead fits singly either.
    """
    engine = problem.engine
    virtual = list(problem.bins)
    fitting: list[Candidate] = []
    first_in_its_bin: set[int] = set()
    for box in sorted_boxes(problem.boxes, problem.sort):
        candidate = pack_rule(engine, box, virtual, problem.forbidden)
        if candidate is None:
            continue
        index = candidate.bin_index
        if virtual[index] is problem.bins[index]:
            first_in_its_bin.add(len(fitting))
        fitting.append(candidate)
        virtual[index] = engine.with_box(virtual[index], candidate.placed)
    rule = selection_rule(problem, own='least_increase')
    key = selection_key(problem, rule)
    for number in sorted(range(len(fitting)), key=lambda number: key(fitting[number])):
        candidate = fitting[number]
        real = problem.bins[candidate.bin_index]
        if number in first_in_its_bin or engine.stands(candidate.placed, real, cep=problem.cep):
            increase = engine.increase(candidate.placed)
            reason = (
                f'{rule.replace("_", " ")} of {len(fitting)} boxes that fit, increase {increase:g}'
            )
            return Choice(candidate, reason=reason)
    return None
