"""O-JP of Ojha et al., section III-B: OPack with corner points, in the spirit of Jampack."""

from __future__ import annotations

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.ranking import lowest_first, ranked
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.placements import Spots, spots_at
from pack_planner.engine.points import corner_points


def at_corner_points(engine: Engine, box: Box, model: BinModel, forbidden: Forbidden) -> Spots:
    """Allowed placements of ``box`` at the corner points of a bin."""
    return spots_at(engine, box, model, corner_points(model), forbidden)


#: The first corner point by z, y, x that takes the box, in the oldest bin that has one.
JAMPACK = ranked(at_corner_points, lowest_first)


@algorithm('o_jampack')
def o_jampack(problem: Problem) -> Choice | None:
    """Choose by OPack over an approximation of Jampack.

    Jampack (Agarwal, Biswas, Sarkar, Paul, Paul: Jampacker: An efficient and reliable robotic bin
    packing system for cuboid objects, IEEE Robotics and Automation Letters 6(2), 2021) packs at
    corner points. Its full text is not public, so this takes what Ojha et al. say of it, "using
    corner points", as three corners of each box (see
    :func:`pack_planner.engine.points.corner_points`), tried by z, y, x, bins oldest first. Fills
    therefore need not be those of the paper; docs/benchmarks/paper.md has both.
    """
    return opack(problem, JAMPACK)
