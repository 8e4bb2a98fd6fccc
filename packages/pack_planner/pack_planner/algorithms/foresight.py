"""Foresight: `rollout` that sees which room the boxes to come will not use.

Where a box may stand without three corners on tops, there are many more places, and the best are
often flush with what lies beyond: so the far ends count too. The waste of a placement
(:mod:`pack_planner.algorithms.play_out`) is here

    0.6 lost / volume - 2.1 touched - 0.5 level - 0.3 snug + 0.6 above + 0.3 beside
    + 3 shut off + 0.5 (bins older than its own)

where ``level`` are tops that differ by no more than 2 mm, ``snug`` is the share of the sides that
have a gap below 60 mm, and ``above`` and ``beside`` are room that the boxes in sight would leave
empty, over the volume of the box. What is ``shut off`` is room behind it in a cage, which an arm
that comes through the open front would reach no more.

Where one bin with walls all around is open, the waste of a plan as a whole has 0.4 of the share of
the sizes to come that find no place there any more, times the number of such boxes that fill a bin
(:mod:`pack_planner.algorithms.sizes_to_come`): a bin into which nothing fits is closed. With more
bins what does not fit into one fits into another, and the term costs a point or two.

A box that is to be tipped next costs 0.03 for each that is nearer to the tilt tray: the farther it
has to come, the less of the tip is hidden behind the motion before.

docs/benchmarks/foresight.md has what each of these is worth. Where corners must rest on tops,
columns are finished first: the waste has ``- 0.8 top / height of the bin`` and 0.5 of the share of
the base that nothing carries, more of ``beside``, and a box that finds no place any more costs as
much as several bad places. Profile `paper` knows no arm, so nothing is shut off from one there.
"""

from __future__ import annotations

from dataclasses import replace

from pack_msgs_py.profiles import Profile
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.play_out import FIRST_MOVES, FIRST_MOVES_ALIKE, best_plan
from pack_planner.algorithms.registry import algorithm
from pack_planner.algorithms.rollout import WEIGHTS as OF_ROLLOUT
from pack_planner.algorithms.virtual_bins import SEARCH_S
from pack_planner.algorithms.waste_weights import WasteWeights

WEIGHTS = WasteWeights(
    lost=0.6, touched=2.1, level=0.5, spread=0.0, younger=0.5, large_first=1.35, no_place=1.15,
    snug=0.3, near_mm=60.0, far_ends=True, level_mm=2.0, above=0.6, beside=0.3, shut_off=3.0,
    room=0.4, late=0.03,
)  # fmt: skip

WEIGHTS_BY_VERTICES = replace(
    OF_ROLLOUT, lost=1.5, level=0.3, younger=3.0, no_place=9.0, far_ends=True, level_mm=2.0,
    hollow=0.5, above=0.6, beside=0.6, tall=-0.8, shut_off=1.0,
)  # fmt: skip

WEIGHTS_OF_PAPER = replace(
    WEIGHTS_BY_VERTICES, lost=3.0, level=0.5, younger=1.0, no_place=10.0, snug=0.3, near_mm=60.0,
    above=1.2, beside=0.7, shut_off=0.0,
)  # fmt: skip


def weights_by(profile: Profile, open_bins: int) -> WasteWeights:
    """The weights under ``profile``, where none are tuned."""
    if profile.min_vertices == 0:
        weights = WEIGHTS
    elif profile.stability_margin_mm is None:
        weights = WEIGHTS_OF_PAPER
    else:
        weights = WEIGHTS_BY_VERTICES
    return weights if open_bins == 1 else replace(weights, room=0.0)


@algorithm('foresight', weights=WEIGHTS, weights_by=weights_by, node_s=SEARCH_S)
def foresight(problem: Problem) -> Choice | None:
    """Choose as the module says; where it sees no move at all, as MPackLite does."""
    own = weights_by(problem.engine.profile, len(problem.bins))
    choices = len(problem.boxes) * len(problem.bins)
    alike = max(FIRST_MOVES_ALIKE, -(-FIRST_MOVES // choices))
    return best_plan(problem, problem.weights_or(own), alike)
