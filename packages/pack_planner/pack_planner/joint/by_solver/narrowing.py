"""What the bounds of :mod:`.bounds` tell a solver about each box: which bins, turns, places, costs.

Nothing here removes a solution better than the known one, but for the order of boxes that are
alike: of these, one cheaper than the next stands for all orders.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box
from pack_planner.engine import BinModel, Weights
from pack_planner.engine.engine import Forbidden
from pack_planner.joint.bounds import NEVER, UNBOUNDED, Reach
from pack_planner.joint.by_solver.contact_model import BoxVariables
from pack_planner.joint.by_solver.formulation import Formulation, Term

#: Floor plan that a box can cover in a bin: x0, y0, x1, y1, millimetres.
Area = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False)
class Narrowing:
    """Bounds of one joint problem, for a solver.

    Attributes
    ----------
    reach : where each box can be.
    step : resolution, millimetres.
    weights : of eq. (1).
    alike : pairs of boxes that can be exchanged, by their numbers; see :func:`alike`.
    """

    reach: Reach
    step: int
    weights: Weights
    alike: tuple[tuple[int, int], ...] = ()

    def may_enter(self, box: int, bin_index: int) -> bool:
        """Whether some place of box number ``box`` in the bin is cheap enough."""
        reach = self.reach
        return bool(reach.least[bin_index, box] <= reach.caps[box])

    def area(self, box: int, bin_index: int) -> Area:
        """What box number ``box`` can cover in the bin; nothing outside it matters to it."""
        x0, y0, x1, y1 = 1 << 30, 1 << 30, 0, 0
        low, shapes = self.reach.low[bin_index], self.reach.grounds[bin_index].shapes
        for positions, (which, _, dx, dy, _) in zip(low, shapes.tolist(), strict=True):
            possible = positions < NEVER
            if which != box or not possible.any():
                continue
            rows, columns = possible.any(axis=1).nonzero()[0], possible.any(axis=0).nonzero()[0]
            x0, y0 = min(x0, int(rows[0]) * self.step), min(y0, int(columns[0]) * self.step)
            x1 = max(x1, int(rows[-1]) * self.step + dx)
            y1 = max(y1, int(columns[-1]) * self.step + dy)
        return x0, y0, x1, y1

    def narrow(self, f: Formulation, box: int, one: BoxVariables) -> None:
        """Keep the variables ``one`` of box number ``box`` where it can be."""
        costs = self._costs()
        for j, inside in one.bins.items():
            low, shapes = self.reach.low[j], self.reach.grounds[j].shapes
            for positions, (which, turn, *_) in zip(low, shapes.tolist(), strict=True):
                if which != box:
                    continue
                turned = one.turns[ORIENTATIONS[turn]]
                possible = positions < NEVER
                if not possible.any():
                    f.at_most([(1, inside), (1, turned)], 1)
                    continue
                for axis in range(2):
                    cells = possible.any(axis=1 - axis).nonzero()[0]
                    f.at_least([(1, one.low[axis])], int(cells[0]), inside, turned)
                    f.at_most([(1, one.low[axis])], int(cells[-1]), inside, turned)
                f.at_least([(1, one.low[2])], int(positions[possible].min()), inside, turned)
            if costs is not None:
                here = costs[2] * (j + 1)
                least = math.ceil(self.reach.least[j, box] - here - 1e-6)
                f.at_least(self._place(one, costs), least, inside)
                if self.reach.caps[box] < UNBOUNDED:
                    most = math.floor(self.reach.caps[box] - here + 1e-6)
                    f.at_most(self._place(one, costs), most, inside)

    @property
    def grain(self) -> int:
        """What divides ten times eq. (1) of every solution; 0 where that is not a whole number.

        A base is a sum of heights and placed tops.
        """
        costs = self._costs()
        if costs is None:
            return 0
        heights = 0
        for one in self.reach.grounds:
            heights = math.gcd(heights, *one.shapes[:, 4].tolist(), *np.unique(one.height).tolist())
        return math.gcd(costs[0], costs[1] * heights, costs[2])

    def within(
        self, f: Formulation, variables: Sequence[BoxVariables], least: int, most: int
    ) -> Formulation:
        """The problem of finding any solution that costs ``least`` to ``most``, tenfold eq. (1)."""
        costs = self._costs()
        assert costs is not None
        total: list[Term] = []
        for one in variables:
            total += self._place(one, costs)
            total += [(costs[2] * (j + 1), v) for j, v in one.bins.items()]
        asked = replace(f, constraints=list(f.constraints), costs={}, hints={})
        asked.at_least(total, least)
        asked.at_most(total, most)
        return asked

    def order_alike(self, f: Formulation, variables: Sequence[BoxVariables]) -> None:
        """Of boxes that are alike, one in front costs no more than the next."""
        costs = self._costs()
        if costs is None:
            return
        for i, k in self.alike:
            a, b = variables[i], variables[k]
            terms = self._place(a, costs) + [(costs[2] * (j + 1), v) for j, v in a.bins.items()]
            less = self._place(b, costs) + [(costs[2] * (j + 1), v) for j, v in b.bins.items()]
            f.at_most(terms + [(-factor, v) for factor, v in less], 0)

    def _costs(self) -> tuple[int, int, int] | None:
        """Cost of a cell of x or y, of a millimetre of height, of a bin; None unless whole."""
        w = self.weights
        exact = (w.position * self.step, w.height, 10.0 * w.bin_index)
        whole = (round(exact[0]), round(exact[1]), round(exact[2]))
        return whole if exact == whole else None

    @staticmethod
    def _place(one: BoxVariables, costs: tuple[int, int, int]) -> list[Term]:
        return [(costs[0], one.low[0]), (costs[0], one.low[1]), (costs[1], one.high[2])]


def alike(
    boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden
) -> tuple[tuple[int, int], ...]:
    """Each box with the next that differs in nothing but its id, by their numbers."""
    zones = [[forbidden(box, model.source) for model in bins] for box in boxes]
    found = []
    for i, one in enumerate(boxes):
        for k in range(i + 1, len(boxes)):
            if replace(boxes[k], id=one.id) == one and zones[k] == zones[i]:
                found.append((i, k))
                break
    return tuple(found)
