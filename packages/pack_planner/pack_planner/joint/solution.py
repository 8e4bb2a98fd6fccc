"""Joint solutions (Ojha et al., section III-A): which count, and what is known about the best.

Which solutions count. The paper's MILP asks that all boxes lie inside, do not overlap and are
supported; it knows no order of placing. Here there must be an order in which each box obeys every
rule of :mod:`pack_msgs_py.rules` at its moment. By increasing base height is always such an order
if there is any: a box that carries or stands under another has the lower base, so it is there
already and nothing that stands over it is; support, centre of mass and share depend on lower boxes
only; weight and loads only grow, so that the last box faces the hardest test. What remains, and
what the MILP as printed lacks, is access from above to boxes *placed before*: none of them may
stand over a box of the look-ahead. A box rests where it touches: its base is the highest top
under it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pack_msgs_py.rules import violations
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.contact import touches


@dataclass(frozen=True)
class JointResult:
    """What is known about the joint problem.

    Attributes
    ----------
    candidates : one placement per box, in an order in which they can be placed; ``None`` when no
        solution is known.
    objective : eq. (1) over all of them, centimetres; infinite without a solution.
    lower_bound : no solution is below it, centimetres; infinite when there is proven to be none.
    nodes : how many nodes the search took.
    """

    candidates: tuple[Candidate, ...] | None
    objective: float
    lower_bound: float
    nodes: int = 0

    @property
    def proven(self) -> bool:
        """Whether the answer, be it that there is no solution, is proven."""
        return self.lower_bound >= self.objective - 1e-4

    @property
    def gap(self) -> float:
        """How far the objective may lie above the optimum, relative to it; 0 when proven."""
        if self.proven:
            return 0.0
        if self.candidates is None or self.lower_bound <= 0.0:
            return math.inf
        return (self.objective - self.lower_bound) / self.lower_bound


def joint_violations(
    candidates: Sequence[Candidate], bins: Sequence[BinModel], engine: Engine
) -> list[str]:
    """Every rule broken when ``candidates`` are placed one after another."""
    boxes = [list(model.source.boxes) for model in bins]
    broken = []
    for candidate in candidates:
        index, placed = candidate.bin_index, candidate.placed
        if bins[index].blocked:
            broken.append(bins[index].blocked)
        spec = bins[index].source.spec
        destination = bins[index].source.destination
        broken += [
            str(violation)
            for violation in violations(placed, boxes[index], spec, engine.profile, destination)
        ]
        boxes[index].append(placed)
    return broken


def all_touch(candidates: Sequence[Candidate], bins: Sequence[BinModel], engine: Engine) -> bool:
    """Whether each of ``candidates`` touches something along x and along y, all of them in place.

    The constraints for efficient packing, see :mod:`pack_planner.engine.contact`.
    """
    step = engine.profile.resolution_mm
    for candidate in candidates:
        j = candidate.bin_index
        source = bins[j].source
        others = [c.placed for c in candidates if c is not candidate and c.bin_index == j]
        around = (*source.boxes, *others)
        if not all(touches(candidate.placed, around, source.spec.size_mm, step)):
            return False
    return True
