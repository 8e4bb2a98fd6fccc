"""Floor building: layer by layer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots


def lowest_top(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by the height of the top, then by x + y, then by z, y, x."""
    x, y, z = spots.corners.T
    return (z + spots.sizes[:, 2], x + y, *lowest_first(spots, model))


FLOOR_BUILDING = ranked(all_spots, lowest_top)


@algorithm('floor_building')
def floor_building(problem: Problem) -> Choice | None:
    """Put the nearest box where its top is lowest: the floor fills first, then layer on layer.

    The second term of eq. (1) of Ojha et al. alone (section III-A); in the literature as in
    Verma et al., arXiv:2007.00463, 2020, section 5. Oldest bin first.
    """
    return nearest_box(problem, FLOOR_BUILDING)
