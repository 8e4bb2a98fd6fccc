"""Plans for the whole look-ahead, each played out from a first move, and their waste.

Every allowed placement of every box of the look-ahead in every open bin has a *waste*, a weighted
sum of what :class:`~pack_planner.algorithms.waste_weights.WasteWeights` lists. The look-ahead is
packed virtually, one placement after another, always the one of least waste less a bonus for its
size, so that large boxes go first where they fit as well. That is done once for each of the best
first moves, the best of them first; the first move of the plan of least total waste is made. To
that waste belongs what the plan as a whole leaves no room for, where that has a weight. When the
time is out, or as many bins were looked at as there are nodes, the plans made so far decide.

The parts are old: touching perimeter (Lodi, Martello, Vigo 1999, in two dimensions), least growth
of the height map (Wang, Hauser 2019), rollouts (Tesauro, Galperin 1997; Bertsekas, Tsitsiklis, Wu:
Rollout algorithms for combinatorial optimization, J. of Heuristics 3, 1997).
"""

from __future__ import annotations

import numpy as np

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.wording import how_many
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.mpack_lite import least_objective
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.virtual_bins import Move, Outlook, VirtualBin
from pack_planner.algorithms.waste_weights import WasteWeights

#: First moves that are played out, and how many of them may be of one box in one bin.
FIRST_MOVES, FIRST_MOVES_ALIKE = 12, 3


def best_plan(
    problem: Problem, weights: WasteWeights, alike: int = FIRST_MOVES_ALIKE
) -> Choice | None:
    """The first move of the plan of least waste; where there is no move, as MPackLite does.

    Sorting, box selection and constraints for efficient packing have no part in it. ``alike`` is
    how many of the first moves may be of one box in one bin.
    """
    outlook = Outlook(problem, weights, alike)
    every = range(len(problem.boxes))
    moves = [move for target in outlook.bins for box in every for move in target.moves(every)[box]]
    waits = {move: outlook.waits(move) for move in moves}
    firsts = sorted(moves, key=lambda move: move.rank + waits[move])[:FIRST_MOVES]
    if not firsts:
        return opack(problem, least_objective)
    totals = []
    for first in firsts:
        played_out = _played_out(outlook.bins, first, weights, len(problem.boxes))
        totals.append(played_out + waits[first])
        if outlook.is_over():
            break
    order = np.argsort(totals, kind='stable')
    least = totals[order[0]]
    plans, boxes = how_many(len(totals), 'plan'), how_many(len(every), 'box')
    reason = f'least waste {least:.2f} of {plans} for {boxes}'
    made_all = len(totals) == len(firsts)
    status = PlacementStatus.OPTIMAL if made_all else PlacementStatus.BUDGET
    chosen, *others = (outlook.candidate(firsts[number]) for number in order)
    return Choice(chosen, status, reason, others=tuple(others), nodes=outlook.searches)


def _played_out(
    bins: tuple[VirtualBin, ...], first: Move, weights: WasteWeights, boxes: int
) -> float:
    """Waste of the whole look-ahead when ``first`` is the first move."""
    targets, left = list(bins), [box for box in range(boxes) if box != first.box]
    total, move = first.waste, first
    while left or weights.room:
        targets[move.bin_index] = targets[move.bin_index].after(move)
        if not left:
            break
        known = [target.moves(left) for target in targets]
        following = [moves[box][0] for moves in known for box in left if moves[box]]
        if not following:
            total += weights.no_place * len(left)
            break
        move = min(following, key=lambda next_move: next_move.rank)
        left.remove(move.box)
        total += move.waste
    return total + weights.room * sum(target.room_taken() for target in targets)
