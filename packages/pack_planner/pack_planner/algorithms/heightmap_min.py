"""Heightmap minimisation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots
from pack_planner.engine.surroundings import lost_volume


def growth(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by the volume added under the height map, then by x + y, then by z, y, x."""
    volume = spots.sizes.prod(axis=1) + lost_volume(spots, model)
    x, y, _ = spots.corners.T
    return (np.rint(volume), x + y, *lowest_first(spots, model))


HEIGHTMAP_MIN = ranked(partial(all_spots, far_ends=True), growth)


@algorithm('heightmap_min')
def heightmap_min(problem: Problem) -> Choice | None:
    """Put the nearest box where the sum of the height map grows least.

    Wang, Hauser: Stable bin packing of non-convex 3D objects with a robot manipulator, ICRA 2019,
    section IV: minimise c (x + y) plus the sum of the height map, here with c towards zero. The
    sum is bilinear between candidate lines, so with their far ends the minimum is exact under
    rules that do not vary there (profile ``paper``). Oldest bin first.
    """
    return nearest_box(problem, HEIGHTMAP_MIN)
