"""Pack rules that rank the allowed placements of one box and take the best."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.values import Box
from pack_msgs_py.wording import how_many
from pack_planner.algorithms.base import Choice, PackRule, Problem
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.placements import Spots

#: Allowed placements of a box in a bin.
Finder = Callable[[Engine, Box, BinModel, Forbidden], Spots]

#: What to minimise: arrays of shape (n,), the first decides, ties go to the next.
Ranking = Callable[[Spots, BinModel], Sequence[NDArray[np.generic]]]

#: In which order the open bins are tried: indices into them.
Order = Callable[[Sequence[BinModel]], Iterable[int]]


def oldest_first(bins: Sequence[BinModel]) -> Iterable[int]:
    """First fit: bins in the order they were opened."""
    return range(len(bins))


def fullest_first(bins: Sequence[BinModel]) -> Iterable[int]:
    """Best fit: bins by decreasing fill rate, equal ones oldest first."""
    fills = [model.source.fill_rate for model in bins]
    return sorted(range(len(bins)), key=lambda index: -fills[index])


def ranked(finder: Finder, ranking: Ranking, order: Order = oldest_first) -> PackRule:
    """The rule that takes the best placement in the first bin that has one.

    In an empty bin where the finder sees nothing, which takes refusals of the arm, the engine's
    best placement stands in: a box that some empty bin takes never stops the cell.
    """

    def rule(
        engine: Engine, box: Box, bins: Sequence[BinModel], forbidden: Forbidden
    ) -> Candidate | None:
        for index in order(bins):
            spots = finder(engine, box, bins[index], forbidden)
            if len(spots):
                keys = (*ranking(spots, bins[index]), spots.turns)
                return spots.candidate(int(np.lexsort(keys[::-1])[0]), index, engine)
        empty = [(index, model) for index, model in enumerate(bins) if not model.source.boxes]
        for index, model in empty:
            best = engine.best_placement(box, [model], forbidden)
            if best is not None:
                return Candidate(best.placed, index, engine.objective(best.placed, index))
        return None

    return rule


def nearest_box(problem: Problem, rule: PackRule) -> Choice | None:
    """Pack the boxes in the order they arrive: only the nearest one counts."""
    candidate = rule(problem.engine, problem.boxes[0], problem.bins, problem.forbidden)
    if candidate is None:
        return None
    return Choice(candidate, reason=f'nearest of {how_many(len(problem.boxes), "box")}')


def lowest_first(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by z, then y, then x, as Crainic, Perboli and Tadei sort extreme points."""
    return spots.corners[:, 2], spots.corners[:, 1], spots.corners[:, 0]
