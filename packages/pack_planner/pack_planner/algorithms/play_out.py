"""Plans for the whole look-ahead, each played out from a first move, and their waste.

Every allowed placement of every box of the look-ahead in every open bin has a *waste*, a weighted
sum of what :class:`~pack_planner.algorithms.waste_weights.WasteWeights` lists. The look-ahead is
packed virtually, one placement after another, always the one of least waste less a bonus for its
size, so that large boxes go first where they fit as well. That is done once for each of the best
first moves; the first move of the plan of least total waste is made.

The parts are old: touching perimeter (Lodi, Martello, Vigo 1999, in two dimensions), least growth
of the height map (Wang, Hauser 2019), rollouts (Tesauro, Galperin 1997; Bertsekas, Tsitsiklis, Wu:
Rollout algorithms for combinatorial optimization, J. of Heuristics 3, 1997).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.mpack_lite import least_objective
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.waste_weights import WasteWeights
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots
from pack_planner.engine.surroundings import gaps, lost_volume, sides

#: First moves that are played out, and how many of them may be of one box in one bin.
FIRST_MOVES, FIRST_MOVES_ALIKE = 12, 3


@dataclass(frozen=True, eq=False)
class _Move:
    """Row ``row`` of ``spots``, placements of box number ``box`` in bin number ``bin_index``."""

    rank: float
    waste: float
    box: int
    bin_index: int
    spots: Spots
    row: int


#: The best moves of each box in each bin, best first.
_Moves = dict[tuple[int, int], list[_Move]]


def best_plan(problem: Problem, weights: WasteWeights) -> Choice | None:
    """The first move of the plan of least waste; where there is no move, as MPackLite does.

    Sorting, box selection and constraints for efficient packing have no part in it.
    """
    moves: _Moves = {
        (box, index): _best_moves(problem, weights, box, index, model, FIRST_MOVES_ALIKE)
        for index, model in enumerate(problem.bins)
        for box in range(len(problem.boxes))
    }
    every = [move for alike in moves.values() for move in alike]
    firsts = sorted(every, key=lambda move: move.rank)[:FIRST_MOVES]
    if not firsts:
        return opack(problem, least_objective)
    totals = [_played_out(problem, weights, moves, first) for first in firsts]
    best = int(np.argmin(totals))
    chosen = firsts[best]
    reason = f'least waste {totals[best]:.2f} of {len(firsts)} plans for {len(problem.boxes)} boxes'
    candidate = chosen.spots.candidate(chosen.row, chosen.bin_index, problem.engine)
    return Choice(candidate, reason=reason)


def _best_moves(
    problem: Problem, weights: WasteWeights, box: int, index: int, model: BinModel, count: int
) -> list[_Move]:
    """The ``count`` placements of least waste of box number ``box`` in bin number ``index``.

    Parameters
    ----------
    problem : what is to be decided.
    weights : of the waste.
    box, index : numbers of the box and of the bin.
    model : the bin as it is at that point of the plan.
    count : how many are wanted.
    """
    it = problem.boxes[box]
    spots = all_spots(problem.engine, it, model, problem.forbidden, far_ends=weights.far_ends)
    if not len(spots):
        return []
    waste = _waste(spots, model, weights) + weights.younger * index
    rows = [int(np.argmin(waste))] if count == 1 else np.argsort(waste, kind='stable')[:count]
    size = weights.large_first * it.volume_mm3 / _largest(problem.boxes)
    return [_Move(waste[row] - size, waste[row], box, index, spots, int(row)) for row in rows]


def _waste(spots: Spots, model: BinModel, weights: WasteWeights) -> NDArray[np.float64]:
    """Waste of each of ``spots``, (n,), but for the age of the bin."""
    length, breadth, _ = model.source.spec.size_mm
    touched, level = sides(spots, model).T
    waste: NDArray[np.float64] = (
        weights.lost * lost_volume(spots, model) / spots.sizes.prod(axis=1)
        - weights.touched * touched
        - weights.level * level
        + weights.spread * (spots.corners[:, 0] + spots.corners[:, 1]) / (length + breadth)
    )
    if weights.snug:
        beside = gaps(spots, model)
        waste -= weights.snug * ((beside > 0) & (beside < weights.near_mm)).mean(axis=1)
    return waste


def _largest(boxes: Sequence[Box]) -> float:
    return max(box.volume_mm3 for box in boxes)


def _played_out(problem: Problem, weights: WasteWeights, moves: _Moves, first: _Move) -> float:
    """Waste of the whole look-ahead when ``first`` is the first move."""
    models, known = list(problem.bins), dict(moves)
    left = set(range(len(problem.boxes)))
    total, move = 0.0, first
    while True:
        total += move.waste
        left.remove(move.box)
        if not left:
            return total
        index = move.bin_index
        models[index] = problem.engine.with_box(models[index], move.spots.placed(move.row))
        for box in left:
            known[box, index] = _best_moves(problem, weights, box, index, models[index], 1)
        following = [known[key][0] for key in known if key[0] in left and known[key]]
        if not following:
            return total + weights.no_place * len(left)
        move = min(following, key=lambda next_move: next_move.rank)
