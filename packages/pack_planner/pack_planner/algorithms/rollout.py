"""Rollout: our own algorithm. It plays each promising first move out to the end of the look-ahead.

Every allowed placement of every box of the look-ahead in every open bin has a *waste*:

    3 lost / volume - 2 touched - 0.5 level + 0.5 (x + y) / (L + B) + 2 (bins older than its own)

``lost`` is the volume that is shut in below the box, ``touched`` the share of its four sides that
lies against walls or boxes, ``level`` the share of the border of its top that is level with what is
beside it. Columns therefore grow to the rim from the corner at the origin, without holes, and what
is left stays in one piece: a bin is closed when nothing fits, so that few large rooms are worth
more than a low top.

The look-ahead is packed virtually, one placement after another: always the one of least waste less
2 (volume / volume of the largest box on offer), so that large boxes go first where they fit as
well. That is done once for each of the best first moves; a box that finds no place any more costs
6. The first move of the plan of least total waste is made.

The three parts are old: touching perimeter (Lodi, Martello, Vigo 1999, in two dimensions), least
growth of the height map (Wang, Hauser 2019), rollouts (Tesauro, Galperin 1997; Bertsekas,
Tsitsiklis, Wu: Rollout algorithms for combinatorial optimization, J. of Heuristics 3, 1997). The
numbers were tuned on collections that no table shows; docs/decisions.md says how.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.mpack_lite import least_objective
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots
from pack_planner.engine.surroundings import lost_volume, sides

#: Weights of the terms of the waste, see the module.
LOST, TOUCHED, LEVEL, SPREAD, YOUNGER = 3.0, 2.0, 0.5, 0.5, 2.0
LARGE_FIRST = 2.0
NO_PLACE = 6.0

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


@algorithm('rollout')
def rollout(problem: Problem) -> Choice | None:
    """Choose by rollout, see the module; where it sees no move at all, as MPackLite does.

    Sorting, box selection and constraints for efficient packing have no part in it.
    """
    moves: _Moves = {
        (box, index): _best_moves(problem, box, index, model, FIRST_MOVES_ALIKE)
        for index, model in enumerate(problem.bins)
        for box in range(len(problem.boxes))
    }
    every = [move for best in moves.values() for move in best]
    firsts = sorted(every, key=lambda move: move.rank)[:FIRST_MOVES]
    if not firsts:
        return opack(problem, least_objective)
    totals = [_played_out(problem, moves, first) for first in firsts]
    best = int(np.argmin(totals))
    chosen = firsts[best]
    reason = f'least waste {totals[best]:.2f} of {len(firsts)} plans for {len(problem.boxes)} boxes'
    candidate = chosen.spots.candidate(chosen.row, chosen.bin_index, problem.engine)
    return Choice(candidate, reason=reason)


def _best_moves(problem: Problem, box: int, index: int, model: BinModel, count: int) -> list[_Move]:
    """The ``count`` placements of least waste of one box in one bin."""
    it = problem.boxes[box]
    spots = all_spots(problem.engine, it, model, problem.forbidden)
    if not len(spots):
        return []
    length, breadth, _ = model.source.spec.size_mm
    touched, level = sides(spots, model).T
    waste = (
        LOST * lost_volume(spots, model) / spots.sizes.prod(axis=1)
        - TOUCHED * touched
        - LEVEL * level
        + SPREAD * (spots.corners[:, 0] + spots.corners[:, 1]) / (length + breadth)
        + YOUNGER * index
    )
    rows = [int(np.argmin(waste))] if count == 1 else np.argsort(waste, kind='stable')[:count]
    size = LARGE_FIRST * it.volume_mm3 / _largest(problem.boxes)
    return [_Move(waste[row] - size, waste[row], box, index, spots, int(row)) for row in rows]


def _largest(boxes: Sequence[Box]) -> float:
    return max(box.volume_mm3 for box in boxes)


def _played_out(problem: Problem, moves: _Moves, first: _Move) -> float:
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
            known[box, index] = _best_moves(problem, box, index, models[index], 1)
        following = [known[key][0] for key in known if key[0] in left and known[key]]
        if not following:
            return total + NO_PLACE * len(left)
        move = min(following, key=lambda candidate: candidate.rank)
