"""O-FF of Ojha et al., section III-B: OPack with the pack rule of first fit."""

from __future__ import annotations

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.first_fit import FIRST_FIT
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.registry import algorithm


@algorithm('o_first_fit')
def o_first_fit(problem: Problem) -> Choice | None:
    """Choose by OPack over first fit."""
    return opack(problem, FIRST_FIT)
