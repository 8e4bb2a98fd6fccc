"""OPack (Ojha et al., section III-B, algorithm 2): virtual packing for any single-box rule."""

from __future__ import annotations

from collections.abc import Iterable

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, PackRule, Problem


def by_volume(boxes: Iterable[Box]) -> list[Box]:
    """SORT: decreasing volume, ties by decreasing height, then in the order of the belt."""
    return sorted(boxes, key=lambda box: (-box.volume_mm3, -box.size_mm[2]))


def opack(problem: Problem, pack_rule: PackRule) -> Choice | None:
    """One step of OPack.

    The boxes of the look-ahead are placed virtually one after another, largest first; a box that
    fits nowhere is passed over. BOXPACK then picks, among those that stand without the virtual
    ones, the one of least w1 (x + y) + w2 (z + dz); equal ones in the order of SORT.

    The first box that fits is placed on the real boxes alone and so stands alone: when nothing is
    found here, no box of the look-ahead fits singly either.
    """
    engine = problem.engine
    virtual = list(problem.bins)
    chosen = None
    least = float('inf')
    placed_virtually = 0
    for box in by_volume(problem.boxes):
        candidate = pack_rule(engine, box, virtual, problem.forbidden)
        if candidate is None:
            continue
        placed_virtually += 1
        index, placed = candidate.bin_index, candidate.placed
        increase = engine.increase(placed)
        real = problem.bins[index]
        if increase < least and (virtual[index] is real or engine.stands(placed, real)):
            chosen, least = candidate, increase
        virtual[index] = engine.with_box(virtual[index], placed)
    if chosen is None:
        return None
    reason = f'least increase {least:g} of {placed_virtually} boxes that fit'
    return Choice(chosen, reason=reason)
