"""Rollout: our own algorithm. It plays each promising first move out to the end of the look-ahead.

The waste of a placement (:mod:`pack_planner.algorithms.play_out`) is here

    3 lost / volume - 2 touched - 0.5 level + 0.5 (x + y) / (L + B) + 2 (bins older than its own)

Columns therefore grow to the rim from the corner at the origin, without holes, and what is left
stays in one piece: a bin is closed when nothing fits, so that few large rooms are worth more than a
low top. The numbers were tuned on collections that no table shows; docs/decisions.md says how.
"""

from __future__ import annotations

from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.play_out import best_plan
from pack_planner.algorithms.registry import algorithm
from pack_planner.algorithms.virtual_bins import SEARCH_S
from pack_planner.algorithms.waste_weights import WasteWeights

WEIGHTS = WasteWeights(
    lost=3.0, touched=2.0, level=0.5, spread=0.5, younger=2.0, large_first=2.0, no_place=6.0
)


@algorithm('rollout', node_s=SEARCH_S)
def rollout(problem: Problem) -> Choice | None:
    """Choose by rollout, see the module; where it sees no move at all, as MPackLite does."""
    return best_plan(problem, WEIGHTS)
