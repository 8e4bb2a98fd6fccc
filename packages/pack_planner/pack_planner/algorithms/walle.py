"""WallE: stability score of Verma et al."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.placements import Spots, all_spots
from pack_planner.engine.surroundings import border

VARIATION, POSITION = 0.75, 0.01


def flush_spots(engine: Engine, box: Box, model: BinModel, forbidden: Forbidden) -> Spots:
    """Every allowed placement, near and far ends."""
    return all_spots(engine, box, model, forbidden, far_ends=True)


def score(spots: Spots, model: BinModel) -> Sequence[NDArray[np.generic]]:
    """Rank by decreasing -0.75 G_var + G_high + G_flush - 0.01 (i + j) - h, then by z, y, x."""
    variation, higher, level = border(spots, model).T
    x, y, z = spots.corners.T / 10.0
    top = z + spots.sizes[:, 2] / 10.0
    value = -VARIATION * variation + higher + level - POSITION * (x + y) - top
    return (-np.round(value, 6), *lowest_first(spots, model))


WALLE = ranked(flush_spots, score)


@algorithm('walle')
def walle(problem: Problem) -> Choice | None:
    """Put the nearest box where it stands most like part of a wall.

    Verma, Singhal, Khadilkar, Basumatary, Nayak, Singh, Kumar, Sinha: A generalized reinforcement
    learning algorithm for online 3D bin-packing, arXiv:2007.00463, 2020, section 3. G_var sums the
    height differences of the bordering cells to the top of the box, G_high and G_flush count those
    that are higher and level, i + j is the position and h the height after loading, all in
    centimetres. Cells beyond a wall count for nothing. Oldest bin first.
    """
    return nearest_box(problem, WALLE)
