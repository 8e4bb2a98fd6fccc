"""LSAH: least surface area heuristic."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel
from pack_planner.engine.placements import Spots, all_spots


def surface(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by the surface of the box around all that is in the bin, then by z, y, x."""
    packed = np.array([placed.far_mm for placed in model.source.boxes], np.int64).reshape(-1, 3)
    ends = np.maximum(spots.corners + spots.sizes, packed.max(axis=0, initial=0))
    x, y, z = ends.T
    return (x * y + y * z + z * x, *lowest_first(spots, model))


LSAH = ranked(all_spots, surface)


@algorithm('lsah')
def lsah(problem: Problem) -> Choice | None:
    """Put the nearest box where the surface of the packing's bounding box grows least.

    Hu, Zhang, Yan, Wang, Xu: Solving a new 3D bin packing problem with deep reinforcement learning
    method, arXiv:1708.05930, 2017. Oldest bin first.
    """
    return nearest_box(problem, LSAH)
