"""Best short side fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots
from pack_planner.engine.surroundings import gaps


def least_leftover(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by the shorter leftover side of the free rectangle, then by the longer, then z, y, x."""
    beside = gaps(spots, model)
    along_x, along_y = beside[:, 0] + beside[:, 1], beside[:, 2] + beside[:, 3]
    shorter, longer = np.minimum(along_x, along_y), np.maximum(along_x, along_y)
    return (shorter, longer, *lowest_first(spots, model))


BEST_SHORT_SIDE_FIT = ranked(all_spots, least_leftover)


@algorithm('best_short_side_fit')
def best_short_side_fit(problem: Problem) -> Choice | None:
    """Put the nearest box where one of its sides fits the free space best.

    Jylänki: A thousand ways to pack the bin, a practical approach to two-dimensional rectangle bin
    packing, 2010, section 2.2 (MAXRECTS-BSSF), on each level at which the box can rest. Oldest bin
    first.
    """
    return nearest_box(problem, BEST_SHORT_SIDE_FIT)
