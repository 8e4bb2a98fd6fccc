"""MPackLite (Ojha et al., section III-C): OPack with the exact argmin of eq. (1) for each box."""

from __future__ import annotations

from collections.abc import Sequence

from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.opack import opack
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden


def least_objective(
    engine: Engine, box: Box, bins: Sequence[BinModel], forbidden: Forbidden
) -> Candidate | None:
    """PACKRULE of MPackLite: the placement that minimises eq. (1)."""
    return engine.best_placement(box, bins, forbidden)


def mpack_lite(problem: Problem) -> Choice | None:
    """Choose by MPackLite; every virtual step is a proven optimum."""
    return opack(problem, least_objective)
