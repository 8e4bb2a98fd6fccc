"""OnlineBPH: deepest-bottom-left space, best-matching orientation."""

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


def deepest_then_tightest(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by z, y, x; orientations at the same place by the least margin they leave."""
    beside = gaps(spots, model)
    above = model.source.spec.size_mm[2] - spots.corners[:, 2] - spots.sizes[:, 2]
    margin = np.minimum(np.minimum(beside[:, 1], beside[:, 3]), above)
    return (*lowest_first(spots, model), margin)


ONLINE_BPH = ranked(all_spots, deepest_then_tightest)


@algorithm('online_bph')
def online_bph(problem: Problem) -> Choice | None:
    """Put the nearest box into the deepest-bottom-left space, turned to leave least margin.

    Ha, Nguyen, Bui, Wang: An online packing heuristic for the three-dimensional container loading
    problem in dynamic environments and the Physical Internet, EvoApplications 2017. Its empty
    maximal spaces are, with access from above, the free space at each allowed position. Oldest
    bin first.
    """
    return nearest_box(problem, ONLINE_BPH)
