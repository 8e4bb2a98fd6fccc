"""First fit on extreme points, one box after another."""

from __future__ import annotations

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.ranking import lowest_first, nearest_box, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.placements import Spots, spots_at
from pack_planner.engine.points import extreme_points


def at_extreme_points(engine: Engine, box: Box, model: BinModel, forbidden: Forbidden) -> Spots:
    """Allowed placements of ``box`` at the extreme points of a bin, sunk to where it rests."""
    return spots_at(engine, box, model, extreme_points(model), forbidden)


#: The first extreme point by z, y, x that takes the box, in the oldest bin that has one.
FIRST_FIT = ranked(at_extreme_points, lowest_first)


@algorithm('first_fit')
def first_fit(problem: Problem) -> Choice | None:
    """FF of Ojha et al., section IV: extreme points after Crainic, Perboli and Tadei (2008).

    Boxes are packed as they arrive, without look-ahead, into the oldest bin that takes them.
    """
    return nearest_box(problem, FIRST_FIT)
