"""O-BF of Ojha et al., section III-B: OPack with the pack rule of best fit."""

from __future__ import annotations

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.best_fit import BEST_FIT
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.registry import algorithm


@algorithm('o_best_fit')
def o_best_fit(problem: Problem) -> Choice | None:
    """Choose by OPack over best fit."""
    return opack(problem, BEST_FIT)
