"""Best fit on extreme points, one box after another."""

from __future__ import annotations

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.first_fit import at_extreme_points
from pack_planner.algorithms.ranking import fullest_first, lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm

#: As first fit, but the bin with the highest fill rate comes first.
BEST_FIT = ranked(at_extreme_points, lowest_first, fullest_first)


@algorithm('best_fit')
def best_fit(problem: Problem) -> Choice | None:
    """BF of Ojha et al., section IV: extreme points after Crainic, Perboli and Tadei (2008).

    Boxes are packed as they arrive, without look-ahead, into the fullest bin that takes them.
    """
    return nearest_box(problem, BEST_FIT)
