"""The joint optimum of eq. (1) over a look-ahead (Ojha et al., section III-A), by our own search.

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
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.joint.domains import Entries, find_entries, paint
from pack_planner.joint.tree import FULL, OPEN, PAUSED, PROVEN, SOLUTION, evaluate, grow, push

_FIRST_ROOM = 1 << 13
_MOST_ROOM = 1 << 19
_CHUNK = 200
_EPS = 1e-6


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
        if self.candidates is None:
            return math.inf
        return (self.objective - self.lower_bound) / max(self.lower_bound, 1e-9)


@dataclass(frozen=True, eq=False)
class Turns:
    """Allowed orientations of one box: planned sizes, orientation numbers, centres of mass."""

    sizes: NDArray[np.int64]
    numbers: NDArray[np.int64]
    centres: NDArray[np.float64]


def turns_of(box: Box, engine: Engine) -> Turns:
    """The orientations that the engine's profile and the box itself allow."""
    profile = engine.profile
    allowed = allowed_orientations(box, profile.orientations)
    axes = [['xyz'.index(axis) for axis in orientation] for orientation in allowed]
    sizes = [planned_size(box, orientation, profile) for orientation in allowed]
    offsets = [[box.com_offset_mm[a], box.com_offset_mm[b]] for a, b, _ in axes]
    return Turns(
        np.array(sizes, np.int64).reshape(-1, 3),
        np.array([ORIENTATIONS.index(orientation) for orientation in allowed], np.int64),
        np.array(offsets, np.float64).reshape(-1, 2),
    )


def takes_weight(box: Box, model: BinModel, engine: Engine) -> bool:
    """Whether arm and bin carry ``box``."""
    profile = engine.profile
    return (profile.max_payload_kg is None or box.weight_kg <= profile.max_payload_kg) and (
        profile.max_bin_weight_kg is None
        or model.source.weight_kg + box.weight_kg <= profile.max_bin_weight_kg
    )


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
        broken += [str(one) for one in violations(placed, boxes[index], spec, engine.profile)]
        boxes[index].append(placed)
    return broken


class JointSearch:
    """Search for one joint problem; goes on where it stopped."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        incumbent: Sequence[Candidate] | None = None,
    ) -> None:  # fmt: skip
        """``incumbent`` places every box of ``boxes``, in an order that the rules allow."""
        self._engine = engine
        self._boxes = tuple(boxes)
        self._bins = tuple(bins)
        self._best = None if incumbent is None else tuple(incumbent)
        self._upper = 10.0 * self.objective
        self._turns = [turns_of(box, engine) for box in boxes]
        self._rejected = -1
        self._finished = False
        self._lower = 0.0
        self._prepare(forbidden)

    @property
    def objective(self) -> float:
        """Eq. (1) of the best known solution, centimetres."""
        return math.inf if self._best is None else sum(one.objective for one in self._best)

    def result(self) -> JointResult:
        """What is known so far."""
        lower = self._upper if self._finished else min(self._lower, self._upper)
        return JointResult(self._best, self.objective, lower / 10.0, int(self._counters[2]))

    def run(self, node_limit: int, out_of_time: Callable[[], bool]) -> JointResult:
        """Search until it is proven, ``node_limit`` more nodes were taken, or time is out."""
        last = int(self._counters[2]) + node_limit
        while not self._finished:
            left = last - int(self._counters[2])
            if left <= 0 or out_of_time():
                break
            why, node = grow(
                self._tree, self._problem, (self._heap, self._counters), self._upper,
                min(left, _CHUNK), self._rejected,
            )  # fmt: skip
            if why == FULL:
                if len(self._heap) >= _MOST_ROOM:
                    break
                self._enlarge()
                continue
            self._rejected = -1
            if self._counters[0] > 0 and why != SOLUTION:
                self._lower = max(self._lower, float(self._tree[0][self._heap[0]]))
            if why == PROVEN:
                self._finished = True
            elif why == SOLUTION:
                self._lower = max(self._lower, float(self._tree[0][node]))
                self._take(int(node))
            else:
                assert why == PAUSED
        return self.result()

    def _take(self, node: int) -> None:
        """Hold a joint solution of the tree against the rules and keep it if it is better."""
        solution = self._solution(node)
        if joint_violations(solution, self._bins, self._engine):
            self._rejected = node
            return
        objective = 10.0 * sum(one.objective for one in solution)
        if objective < self._upper - _EPS:
            self._upper = objective
            self._best = solution

    def _solution(self, node: int) -> tuple[Candidate, ...]:
        found = []
        for index, box in enumerate(self._boxes):
            entry = [int(value) for value in self._entries[self._tree[3][node, index]]]
            corner = (entry[1], entry[2], int(self._tree[4][node, index]))
            size = (entry[4], entry[5], entry[6])
            placed = PlacedBox(box, corner, size, ORIENTATIONS[entry[8]])
            found.append(Candidate(placed, entry[0], self._engine.objective(placed, entry[0])))
        return tuple(sorted(found, key=lambda one: one.placed.corner_mm[2]))

    def _prepare(self, forbidden: Forbidden) -> None:
        engine, profile = self._engine, self._engine.profile
        step = profile.resolution_mm
        margin = profile.com_margin_mm
        self._rule = (
            step, profile.support_tolerance_mm,
            -math.inf if margin is None else float(margin), float(profile.min_support_share),
        )  # fmt: skip
        w = engine.weights
        self._weights = (float(w.position), float(w.height), 10.0 * w.bin_index)
        cells = [
            (model.source.spec.size_mm[0] // step, model.source.spec.size_mm[1] // step)
            for model in self._bins
        ]
        shape = (len(cells), max(a for a, _ in cells), max(b for _, b in cells))
        heights = np.zeros(shape, np.int32)
        self._maps = []
        for index, model in enumerate(self._bins):
            painted = paint(model.boxes, *cells[index], step)
            heights[index, : cells[index][0], : cells[index][1]] = painted[0]
            self._maps.append(painted)
        count = len(self._boxes)
        least = np.array([self._least(i, forbidden) for i in range(count)])
        rows: list[Entries] = []
        costs: list[NDArray[np.float64]] = []
        for i in range(count):
            cap = math.inf
            if math.isfinite(self._upper):
                cap = self._upper - (least.sum() - least[i]) - _EPS
            found = (
                self._find(i, forbidden, cap, False) if np.isfinite(least).all() else []
            )
            entries = np.concatenate([np.empty((0, 9), np.int64), *(one for one, _ in found)])
            cost = np.concatenate([np.empty(0), *(one for _, one in found)])
            order = np.argsort(cost, kind='stable')
            rows.append(entries[order])
            costs.append(cost[order])
        self._entries = np.concatenate(rows)
        starts = np.cumsum([0, *map(len, rows)])
        centres = np.zeros((count, 6, 2))
        for i, turns in enumerate(self._turns):
            centres[i, turns.numbers] = turns.centres
        zones = [self._zones(i, forbidden) for i in range(count)]
        self._problem = (
            self._entries, np.concatenate(costs), starts, centres,
            np.concatenate([model.boxes for model in self._bins]),
            np.cumsum([0, *(len(model.boxes) for model in self._bins)]), heights,
            np.array([model.source.spec.size_mm for model in self._bins], np.int64),
            self._rule, profile.min_vertices, np.concatenate(zones),
            np.cumsum([0, *map(len, zones)]), REFUSED_RADIUS_MM, self._weights,
        )  # fmt: skip
        self._heap = np.empty(_FIRST_ROOM, np.int64)
        self._counters = np.zeros(3, np.int64)
        self._tree = _empty_tree(_FIRST_ROOM, count)
        self._lower = float(least.sum())
        self._plant(least)

    def _plant(self, least: NDArray[np.float64]) -> None:
        """The root: every box at its cheapest entry."""
        count = len(self._boxes)
        avoid, fixed = np.empty((256, 7), np.int64), np.empty((count + 1, 7), np.int64)
        self._finished = not np.isfinite(least).all() or not all(
            evaluate(0, i, self._tree, self._problem, avoid, fixed, math.inf) for i in range(count)
        )
        if self._finished:
            return
        self._tree[0][0] = self._tree[5][0].sum()
        self._tree[12][0] = OPEN
        self._counters[:2] = push(self._heap, 0, self._tree[0], 0), 1

    def _least(self, box: int, forbidden: Forbidden) -> float:
        """The cheapest entry of ``box``: no joint solution has it cheaper."""
        found = self._find(box, forbidden, math.inf, True)
        return min((float(cost[0]) for _, cost in found if len(cost)), default=math.inf)

    def _find(
        self, box: int, forbidden: Forbidden, cap: float, least_only: bool
    ) -> list[tuple[Entries, NDArray[np.float64]]]:
        one, turns = self._boxes[box], self._turns[box]
        others = [t.sizes[:, 2].min() for i, t in enumerate(self._turns) if i != box and len(t.sizes)]
        filler = int(min(others, default=-1))
        zones = self._zones(box, forbidden)
        found = []
        for index, model in enumerate(self._bins):
            refused = forbidden(one, model.source)
            if refused is None or model.blocked or not takes_weight(one, model, self._engine):
                continue
            height, owner = self._maps[index]
            lines = [np.ones((len(turns.sizes), cells), np.bool_) for cells in height.shape]
            entries, costs = find_entries(
                index, model.source.spec.size_mm, model.boxes, height, owner, model.slack,
                model.passed_on, self._rule, self._engine.profile.min_vertices, turns.sizes,
                turns.numbers, turns.centres, one.weight_kg * GRAVITY,
                zones[zones[:, 0] == index][:, 1:], REFUSED_RADIUS_MM,
                (*self._weights[:2], self._weights[2] * (index + 1)), filler, cap, least_only,
                *lines,
            )  # fmt: skip
            if len(costs):
                found.append((entries, costs))
                if least_only:
                    cap = min(cap, float(costs[0]))
        return found

    def _zones(self, box: int, forbidden: Forbidden) -> NDArray[np.int64]:
        """Refused positions of ``box`` as rows (bin, orientation, x, y, z)."""
        rows = [
            (index, ORIENTATIONS.index(zone.orientation), *zone.corner_mm)
            for index, model in enumerate(self._bins)
            for zone in forbidden(self._boxes[box], model.source) or ()
        ]
        return np.array(rows, np.int64).reshape(-1, 5)

    def _enlarge(self) -> None:
        self._heap = np.concatenate((self._heap, np.empty_like(self._heap)))
        self._tree = tuple(np.concatenate((one, np.empty_like(one))) for one in self._tree)


def _empty_tree(room: int, count: int) -> tuple[NDArray[np.generic], ...]:
    """Arrays of the nodes.

    Bound, parent, restriction, and per box the entry, its height, its cost, how many fixed boxes it
    may stand on (-1: it may lean), the box it must rest on; the fixed boxes in order, their number;
    which boxes must lean; whether an ancestor has a RAISE or fixed a box that is no carrier; kind.
    """
    return (
        np.zeros(room), np.full(room, -1, np.int64), np.zeros((room, 9), np.int64),
        np.zeros((room, count), np.int64), np.zeros((room, count), np.int64),
        np.zeros((room, count)), np.full((room, count), -1, np.int8),
        np.full((room, count), -1, np.int8), np.full((room, count), -1, np.int8),
        np.zeros(room, np.int8), np.zeros((room, count), np.int8), np.zeros(room, np.int8),
        np.zeros(room, np.int8),
    )  # fmt: skip
