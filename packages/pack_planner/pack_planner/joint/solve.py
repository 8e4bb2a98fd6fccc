"""The joint optimum of eq. (1) over a look-ahead (Ojha et al., section III-A), by our own search.

Which solutions count is said in :mod:`.solution`; how they are searched in :mod:`.tree`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.joint.bounds import Ground, Reach, reach
from pack_planner.joint.domains import Entries, alone_entries, leaning_entries, paint
from pack_planner.joint.nodes import empty_tree, push
from pack_planner.joint.solution import JointResult, all_touch, joint_violations
from pack_planner.joint.tree import FULL, PROVEN, SOLUTION, grow

_FIRST_ROOM = 1 << 13
_MOST_ROOM = 1 << 19
_CHUNK = 200
#: In one bin; with all of them listed many a proof takes few nodes, but the listing a second.
MOST_ENTRIES = 1_000_000
#: How often entries are listed again for less, each time for half as much above the least.
_RELISTS = 3
_EPS = 1e-6


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


def admits(box: Box, model: BinModel, engine: Engine) -> bool:
    """Whether ``box`` is bound for this bin, and arm and bin carry it."""
    profile = engine.profile
    return (
        may_enter(box, model.source.destination)
        and (profile.max_payload_kg is None or box.weight_kg <= profile.max_payload_kg)
        and (
            profile.max_bin_weight_kg is None
            or model.source.weight_kg + box.weight_kg <= profile.max_bin_weight_kg
        )
    )


class JointSearch:
    """Search for one joint problem; goes on where it stopped."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        incumbent: Sequence[Candidate] | None = None, *, cep: bool = False,
        most_entries: int = MOST_ENTRIES,
    ) -> None:  # fmt: skip
        """``incumbent`` places every box of ``boxes``, in an order that the rules allow.

        With ``cep`` each box touches something along x and along y, in the incumbent too. At most
        about ``most_entries`` places are listed for each bin. Where these are not all that a
        solution better than the incumbent could use, only less is searched and less is proven.
        """
        self._most_entries = most_entries
        self._cep = cep
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

    @property
    def reach(self) -> Reach:
        """Where each box can be in a solution better than the first incumbent."""
        return self._reach

    def result(self) -> JointResult:
        """What is known so far."""
        lower = self._upper if self._finished else min(self._lower, self._upper)
        return JointResult(self._best, self.objective, lower / 10.0, int(self._counters[2]))

    def run(self, node_limit: int, out_of_time: Callable[[], bool]) -> JointResult:
        """Search until it is proven, ``node_limit`` more nodes were taken, or time is out."""
        last = int(self._counters[2]) + node_limit
        while not self._finished:
            left = last - int(self._counters[2])
            if self._counters[0] > 0 and (left <= 0 or out_of_time()):
                break
            why, node = grow(
                self._tree, self._problem, (self._heap, self._counters), self._upper,
                max(0, min(left, _CHUNK)), self._rejected,
            )  # fmt: skip
            if why == FULL:
                if len(self._heap) >= _MOST_ROOM:
                    break
                self._enlarge()
                continue
            self._rejected = -1
            if self._counters[0] > 0 and why != SOLUTION:
                self._raise_lower(float(self._tree[0][self._heap[0]]))
            if why == PROVEN:
                self._finished = self._limit >= self._upper
                self._raise_lower(self._limit)
                break
            if why == SOLUTION:
                self._raise_lower(float(self._tree[0][node]))
                self._take(int(node))
        return self.result()

    def _raise_lower(self, bound: float) -> None:
        """``bound`` holds of listed entries; all solutions below the limit are made of these."""
        self._lower = max(self._lower, min(bound, self._limit))

    def _take(self, node: int) -> None:
        """Hold a joint solution of the tree against the rules and keep it if it is better."""
        solution = self._solution(node)
        if joint_violations(solution, self._bins, self._engine) or (
            self._cep and not all_touch(solution, self._bins, self._engine)
        ):
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
            corner = (entry[1], entry[2], entry[3])
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
        self._reach = reach(
            [
                Ground(model.source.spec.size_mm, self._maps[index][0],
                       self._shapes(index, forbidden)[0], self._bin_weights(index))
                for index, model in enumerate(self._bins)
            ],
            count, (step, profile.support_tolerance_mm), profile.min_vertices, self._upper,
        )  # fmt: skip
        self._least = self._reach.cheapest
        self._limit = self._upper
        rows, costs = self._domains(forbidden)
        self._entries = np.concatenate(rows)
        starts = np.cumsum([0, *map(len, rows)])
        centres = np.zeros((count, 6, 2))
        for i, turns in enumerate(self._turns):
            centres[i, turns.numbers] = turns.centres
        self._problem = (
            self._entries, np.concatenate(costs), starts, centres,
            np.concatenate([model.boxes for model in self._bins]),
            np.cumsum([0, *(len(model.boxes) for model in self._bins)]), heights,
            self._rule, profile.min_vertices,
        )  # fmt: skip
        self._heap = np.empty(_FIRST_ROOM, np.int64)
        self._counters = np.zeros(3, np.int64)
        self._tree = empty_tree(_FIRST_ROOM, count)
        self._raise_lower(float(self._least.sum()))
        self._plant()

    def _plant(self) -> None:
        """The root: every box at its cheapest entry."""
        starts, costs = self._problem[2], self._problem[1]
        if (np.diff(starts) == 0).any():
            return  # an empty tree: nothing is better than what is known
        lb, pick, cost = self._tree[0], self._tree[3], self._tree[4]
        pick[0], cost[0] = starts[:-1], costs[starts[:-1]]
        lb[0] = cost[0].sum()
        self._raise_lower(float(lb[0]))
        self._counters[:2] = push(self._heap, 0, lb, 0), 1

    def _domains(self, forbidden: Forbidden) -> tuple[list[Entries], list[NDArray[np.float64]]]:
        """Entries of each box and their costs, cheapest first.

        Every solution below ``_limit`` is made of these: none of its boxes costs more than the
        limit less what the others cost at least, and all that costs no more is listed. When that
        is too much the limit is lowered.
        """
        count = len(self._boxes)
        rows = [np.empty((0, 10), np.int64)] * count
        costs = [np.empty(0)] * count
        if not np.isfinite(self._least).all():
            return rows, costs
        lists_left = _RELISTS
        for _ in range(3 + _RELISTS):
            caps = self._caps()
            lowest = float(self._least.sum())
            found = [self._in_bin(index, caps, forbidden) for index in range(len(self._bins))]
            complete = all(one[2] for one in found)
            if not complete and lists_left and math.isfinite(self._limit):
                lists_left -= 1
                self._limit = lowest + (self._limit - lowest) / 2
                continue
            entries = np.concatenate([one[0] for one in found])
            cost = np.concatenate([one[1] for one in found])
            for i in range(count):
                own = np.flatnonzero(entries[:, 9] == i)
                own = own[np.argsort(cost[own], kind='stable')]
                rows[i], costs[i] = entries[own], cost[own]
            if not complete:
                self._limit = lowest
                return rows, costs
            if any(len(one) == 0 for one in rows):
                return rows, costs
            self._least = np.maximum(self._least, [float(one[0]) for one in costs])
            if self._caps().sum() > caps.sum() - 100.0 * count:
                break
        for i, cap in enumerate(self._caps()):
            keep = int(np.searchsorted(costs[i], cap))
            rows[i], costs[i] = rows[i][:keep], costs[i][:keep]
        return rows, costs

    def _caps(self) -> NDArray[np.float64]:
        """The most each box may cost in a solution below the limit."""
        caps: NDArray[np.float64] = self._limit - (self._least.sum() - self._least) - _EPS
        return caps

    def _shapes(
        self, index: int, forbidden: Forbidden
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Rows (box, orientation, dx, dy, dz) and centres of mass of what may go into a bin."""
        shapes, centres = [np.empty((0, 5), np.int64)], [np.empty((0, 2))]
        model = self._bins[index]
        for i, (box, turns) in enumerate(zip(self._boxes, self._turns, strict=True)):
            if (
                forbidden(box, model.source) is None
                or model.blocked
                or not admits(box, model, self._engine)
            ):
                continue
            which = np.full((len(turns.numbers), 1), i)
            shapes.append(np.hstack((which, turns.numbers[:, None], turns.sizes)))
            centres.append(turns.centres)
        return np.concatenate(shapes), np.concatenate(centres)

    def _bin_weights(self, index: int) -> tuple[float, float, float]:
        return (self._weights[0], self._weights[1], self._weights[2] * (index + 1))

    def _in_bin(
        self, index: int, caps: NDArray[np.float64], forbidden: Forbidden
    ) -> tuple[Entries, NDArray[np.float64], bool]:
        model = self._bins[index]
        shapes, centres = self._shapes(index, forbidden)
        height, owner = self._maps[index]
        size, vertices = model.source.spec.size_mm, self._engine.profile.min_vertices
        forces = np.array([box.weight_kg * GRAVITY for box in self._boxes])
        zones, weights = self._zones(index, forbidden), self._bin_weights(index)
        alone = alone_entries(
            index, size, model.boxes, height, owner, model.slack, model.passed_on, self._rule,
            vertices, shapes, centres, forces, zones, REFUSED_RADIUS_MM, weights, caps,
        )  # fmt: skip
        found: tuple[Entries, NDArray[np.float64], bool] = leaning_entries(
            index, size, height, self._rule, vertices, shapes, zones, REFUSED_RADIUS_MM, weights,
            caps, self._reach.low[index], *alone, len(self._boxes), self._most_entries,
        )  # fmt: skip
        return found

    def _zones(self, index: int, forbidden: Forbidden) -> NDArray[np.int64]:
        """Refused positions in one bin as rows (box, orientation, x, y, z)."""
        rows = [
            (i, ORIENTATIONS.index(zone.orientation), *zone.corner_mm)
            for i, box in enumerate(self._boxes)
            for zone in forbidden(box, self._bins[index].source) or ()
        ]
        return np.array(rows, np.int64).reshape(-1, 5)

    def _enlarge(self) -> None:
        self._heap = np.concatenate((self._heap, np.empty_like(self._heap)))
        self._tree = tuple(np.concatenate((one, np.empty_like(one))) for one in self._tree)
