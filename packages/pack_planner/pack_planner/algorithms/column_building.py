"""Column building: stack on stack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots


def least_spread(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by x + y, then by the height of the top, then by z, y, x."""
    x, y, z = spots.corners.T
    return (x + y, z + spots.sizes[:, 2], *lowest_first(spots, model))


COLUMN_BUILDING = ranked(all_spots, least_spread)


@algorithm('column_building')
def column_building(problem: Problem) -> Choice | None:
    """Put the nearest box as near the origin's corner as it goes, however high.

    The first term of eq. (1) of Ojha et al. alone (section III-A); in the literature as in
    Verma et al., arXiv:2007.00463, 2020, section 5. Oldest bin first.
    """
    return nearest_box(problem, COLUMN_BUILDING)
