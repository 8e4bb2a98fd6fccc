"""DBL: deepest, bottom, left."""

from __future__ import annotations

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine.placements import all_spots

DBL = ranked(all_spots, lowest_first)


@algorithm('dbl')
def dbl(problem: Problem) -> Choice | None:
    """Put the nearest box as deep as it goes, then to the bottom, then to the left.

    Karabulut, Inceoglu: A hybrid genetic algorithm for packing in 3D with deepest bottom left with
    fill method, ADVIS 2004. Boxes come from above, so depth is along z. Unlike first fit it looks
    at every position, not at extreme points alone. Oldest bin first.
    """
    return nearest_box(problem, DBL)
