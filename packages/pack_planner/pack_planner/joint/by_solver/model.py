"""The joint problem of MPack as linear constraints (Ojha et al., section III-A.1).

Written from the rules, apart from our own search and its entries, so that each is a test of the
other. x and y count in grid cells, z in millimetres. What linear constraints say badly (support
polygon, share of the base, loads down the stack) is checked on each solution and, when broken,
that one arrangement is ruled out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from pack_msgs_py.orientation import allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Forbidden
from pack_planner.joint.by_solver.contact_model import BoxVariables, demand_contact
from pack_planner.joint.by_solver.formulation import Formulation, Term

#: Where a face lies: terms and a constant.
_Side = tuple[list[Term], int]


@dataclass
class JointModel:
    """The formulation and how to read its solutions.

    ``cep`` asks each box to touch something along x and along y, see
    :mod:`pack_planner.engine.contact`. ``possible`` is False when some box may go nowhere whatever
    the others do.
    """

    engine: Engine
    boxes: Sequence[Box]
    bins: Sequence[BinModel]
    forbidden: Forbidden
    cep: bool = False
    formulation: Formulation = field(default_factory=Formulation)
    possible: bool = True
    _vars: list[BoxVariables] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._step = self.engine.profile.resolution_mm
        for box in self.boxes:
            self._add_box(box)
        if not self.possible:
            return
        self._limit_weight()
        for i, own in enumerate(self._vars):
            for other in self._vars[i + 1 :]:
                self._keep_apart(own, other)
            for j in own.bins:
                self._keep_above(own, j)
                self._keep_out(own, j)
            self._support(own)
            if self.cep:
                demand_contact(self.formulation, own, self._vars, self.bins, self._step)

    def _add_box(self, box: Box) -> None:
        f, engine = self.formulation, self.engine
        profile, w = engine.profile, engine.weights
        bins = {
            j: f.boolean()
            for j, model in enumerate(self.bins)
            if not model.blocked
            and self.forbidden(box, model.source) is not None
            and may_enter(box, model.source.destination)
            and (profile.max_payload_kg is None or box.weight_kg <= profile.max_payload_kg)
        }
        turns = {name: f.boolean() for name in allowed_orientations(box, profile.orientations)}
        if not bins or not turns:
            self.possible = False
            return
        sizes = {name: planned_size(box, name, profile) for name in turns}
        tops = [max(self.bins[j].source.spec.size_mm[a] for j in bins) for a in range(3)]
        ends = (tops[0] // self._step, tops[1] // self._step, tops[2])
        low = (f.integer(0, ends[0]), f.integer(0, ends[1]), f.integer(0, ends[2]))
        high = (f.integer(0, ends[0]), f.integer(0, ends[1]), f.integer(0, ends[2]))
        own = BoxVariables(box, low, high, turns, bins, sizes)
        f.equal([(1, v) for v in turns.values()], 1)
        f.equal([(1, v) for v in bins.values()], 1)
        for axis in range(3):
            unit = self._step if axis < 2 else 1
            extent = [(-(sizes[name][axis] // unit), v) for name, v in turns.items()]
            f.equal([(1, high[axis]), (-1, low[axis]), *extent], 0)
            for j, v in bins.items():
                limit = self.bins[j].source.spec.size_mm[axis] // unit
                f.at_most([(1, high[axis])], limit, v)
        f.costs[low[0]] = f.costs[low[1]] = w.position * self._step / 10.0
        f.costs[high[2]] = w.height / 10.0
        for j, v in bins.items():
            f.costs[v] = w.bin_index * (j + 1)
        self._vars.append(own)

    def _limit_weight(self) -> None:
        limit = self.engine.profile.max_bin_weight_kg
        if limit is None:
            return
        for j, model in enumerate(self.bins):
            terms = [
                (round(own.box.weight_kg * 1e6), own.bins[j]) for own in self._vars if j in own.bins
            ]
            self.formulation.at_most(terms, round((limit - model.source.weight_kg) * 1e6))

    def _keep_apart(self, own: BoxVariables, other: BoxVariables) -> None:
        """Two boxes in one bin lie side by side along some axis."""
        f = self.formulation
        sides = []
        for a, b in ((own, other), (other, own)):
            for axis in range(3):
                side = f.boolean()
                f.at_most([(1, a.high[axis]), (-1, b.low[axis])], 0, side)
                sides.append(side)
        for j in own.bins:
            if j in other.bins:
                f.one_of(sides, own.bins[j], other.bins[j])

    def _keep_above(self, own: BoxVariables, j: int) -> None:
        """Beside or above each placed box: not in it, and not under it (access from above)."""
        f, step = self.formulation, self._step
        for x0, y0, x1, y1, top in self._visible(j):
            sides = [f.boolean() for _ in range(5)]
            f.at_most([(1, own.high[0])], x0 // step, sides[0])
            f.at_least([(1, own.low[0])], -(-x1 // step), sides[1])
            f.at_most([(1, own.high[1])], y0 // step, sides[2])
            f.at_least([(1, own.low[1])], -(-y1 // step), sides[3])
            f.at_least([(1, own.low[2])], top, sides[4])
            f.one_of(sides, own.bins[j])

    def _visible(self, j: int) -> list[tuple[int, int, int, int, int]]:
        """Placed boxes that one can stand on or has to stay clear of."""
        model = self.bins[j]
        tolerance = self.engine.profile.support_tolerance_mm
        visible = []
        for row in model.boxes.tolist():
            x0, y0, x1, y1, top = row
            inside_x = (model.columns[:-1] < x1) & (model.columns[1:] > x0)
            inside_y = (model.rows[:-1] < y1) & (model.rows[1:] > y0)
            if (model.height[inside_x][:, inside_y] <= top + tolerance).any():
                visible.append((x0, y0, x1, y1, top))
        return visible

    def _keep_out(self, own: BoxVariables, j: int) -> None:
        """Not near a refused position at the same height and turn."""
        f, step = self.formulation, self._step
        for zone in self.forbidden(own.box, self.bins[j].source) or ():
            if zone.orientation not in own.turns:
                continue
            x, y, z = zone.corner_mm
            sides = [f.boolean() for _ in range(6)]
            for axis, centre in ((0, x), (1, y)):
                f.at_most(
                    [(1, own.low[axis])], (centre - REFUSED_RADIUS_MM) // step, sides[2 * axis]
                )
                f.at_least(
                    [(1, own.low[axis])],
                    -(-(centre + REFUSED_RADIUS_MM) // step),
                    sides[2 * axis + 1],
                )
            f.at_most([(1, own.low[2])], z - 1, sides[4])
            f.at_least([(1, own.low[2])], z + 1, sides[5])
            f.one_of(sides, own.bins[j], own.turns[zone.orientation])

    def _support(self, own: BoxVariables) -> None:
        """On the floor, or enough corner cells of the base on tops at its height."""
        f, profile = self.formulation, self.engine.profile
        floor = f.boolean()
        f.at_most([(1, own.low[2])], 0, floor)
        corners: list[list[int]] = [[], [], [], []]
        touching: list[int] = []
        for j, inside in own.bins.items():
            for x0, y0, x1, y1, top in self._visible(j):
                low: list[_Side] = [([], -(-x0 // self._step)), ([], -(-y0 // self._step))]
                high: list[_Side] = [([], x1 // self._step), ([], y1 // self._step)]
                under = ((x0 // self._step, -(-x1 // self._step)),
                         (y0 // self._step, -(-y1 // self._step)))  # fmt: skip
                self._carry(own, low, high, ([], top), [inside], corners)
                if profile.support_tolerance_mm:
                    touch = f.boolean()
                    f.at_most([(1, touch), (-1, inside)], 0)
                    f.equal([(1, own.low[2])], top, touch)
                    for axis in range(2):
                        f.at_least([(1, own.high[axis])], under[axis][0] + 1, touch)
                        f.at_most([(1, own.low[axis])], under[axis][1] - 1, touch)
                    touching.append(touch)
        for other in self._vars:
            if other is not own:
                self._carry_by(own, other, corners, touching)
        rests = [f.boolean() for _ in corners]
        for rest, carriers in zip(rests, corners, strict=True):
            f.at_most([(1, rest), *((-1, carrier) for carrier in carriers)], 0)
        f.at_least(
            [(profile.min_vertices, floor), *((1, rest) for rest in rests)], profile.min_vertices
        )
        if profile.support_tolerance_mm:
            f.one_of([floor, *touching])

    def _carry_by(
        self, own: BoxVariables, other: BoxVariables, corners: list[list[int]], touching: list[int]
    ) -> None:
        """``other`` as a carrier of ``own``, when both are in the same bin."""
        f = self.formulation
        together = f.boolean()
        for j, v in own.bins.items():
            if j in other.bins:
                f.at_most([(1, v), (-1, other.bins[j])], 0, together)
            else:
                f.at_most([(1, v)], 0, together)
        low: list[_Side] = [([(1, other.low[axis])], 0) for axis in range(2)]
        high: list[_Side] = [([(1, other.high[axis])], 0) for axis in range(2)]
        self._carry(own, low, high, ([(1, other.high[2])], 0), [together], corners)
        if self.engine.profile.support_tolerance_mm:
            touch = f.boolean()
            f.at_most([(1, touch), (-1, together)], 0)
            f.equal([(1, own.low[2]), (-1, other.high[2])], 0, touch)
            for axis in range(2):
                f.at_least([(1, own.high[axis]), (-1, other.low[axis])], 1, touch)
                f.at_most([(1, own.low[axis]), (-1, other.high[axis])], -1, touch)
            touching.append(touch)

    def _carry(
        self, own: BoxVariables, low: list[_Side], high: list[_Side], top: _Side,
        together: list[int], corners: list[list[int]],
    ) -> None:  # fmt: skip
        """A carrier whose rectangle runs from ``low`` to ``high`` (terms and constant) at ``top``.

        Adds to each of ``corners`` a variable that implies that its cell lies on the carrier.
        """
        f, tolerance = self.formulation, self.engine.profile.support_tolerance_mm
        level = f.boolean()
        base = [(1, own.low[2])]
        f.at_least([*base, *_minus(top[0])], top[1], level)
        f.at_most([*base, *_minus(top[0])], top[1] + tolerance, level)
        sides: list[list[int]] = []
        for axis in range(2):
            near, far = f.boolean(), f.boolean()
            start, end = [(1, own.low[axis])], [(1, own.high[axis])]
            f.at_least([*start, *_minus(low[axis][0])], low[axis][1], near)
            f.at_most([*start, *_minus(high[axis][0])], high[axis][1] - 1, near)
            f.at_least([*end, *_minus(low[axis][0])], low[axis][1] + 1, far)
            f.at_most([*end, *_minus(high[axis][0])], high[axis][1], far)
            sides.append([near, far])
        for corner in range(4):
            carries = f.boolean()
            for need in (level, sides[0][corner % 2], sides[1][corner // 2], *together):
                f.at_most([(1, carries), (-1, need)], 0)
            corners[corner].append(carries)

    def hint(self, candidates: Sequence[Candidate]) -> None:
        """Start from a known solution, and ask for nothing worse."""
        f = self.formulation
        known = {candidate.placed.box.id: candidate for candidate in candidates}
        for own in self._vars:
            candidate = known[own.box.id]
            for var, value in self._values(own, candidate):
                f.hints[var] = value

    def _values(self, own: BoxVariables, candidate: Candidate) -> list[tuple[int, int]]:
        placed = candidate.placed
        units = (self._step, self._step, 1)
        values = [(v, int(name == placed.orientation)) for name, v in own.turns.items()]
        values += [(v, int(j == candidate.bin_index)) for j, v in own.bins.items()]
        for axis in range(3):
            values.append((own.low[axis], placed.corner_mm[axis] // units[axis]))
            values.append((own.high[axis], placed.far_mm[axis] // units[axis]))
        return values

    def read(self, values: Sequence[int]) -> tuple[Candidate, ...]:
        """The placements of a solution, in an order in which they can be made."""
        candidates = []
        for own in self._vars:
            turn = next(name for name, v in own.turns.items() if values[v])
            index = next(j for j, v in own.bins.items() if values[v])
            corner = (
                values[own.low[0]] * self._step, values[own.low[1]] * self._step,
                values[own.low[2]],
            )  # fmt: skip
            placed = PlacedBox(own.box, corner, own.sizes[turn], turn)
            candidates.append(Candidate(placed, index, self.engine.objective(placed, index)))
        return tuple(sorted(candidates, key=lambda c: c.placed.corner_mm[2]))

    def rule_out(self, candidates: Sequence[Candidate]) -> None:
        """Never this arrangement of these boxes again."""
        f = self.formulation
        known = {candidate.placed.box.id: candidate for candidate in candidates}
        others: list[int] = []
        for own in self._vars:
            candidate = known.get(own.box.id)
            if candidate is None:
                continue
            placed = candidate.placed
            units = (self._step, self._step, 1)
            for axis in range(3):
                below, above = f.boolean(), f.boolean()
                value = placed.corner_mm[axis] // units[axis]
                f.at_most([(1, own.low[axis])], value - 1, below)
                f.at_least([(1, own.low[axis])], value + 1, above)
                others += [below, above]
            same = (own.turns[placed.orientation], own.bins[candidate.bin_index])
            for var in same:
                changed = f.boolean()
                f.at_most([(1, changed), (1, var)], 1)
                others.append(changed)
        f.one_of(others)


def _minus(terms: list[Term]) -> list[Term]:
    return [(-factor, number) for factor, number in terms]
