"""The open bins as they would be after some moves, and the best moves in each of them."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import PlacedBox, Walls
from pack_planner.algorithms.base import Problem
from pack_planner.algorithms.sizes_to_come import SizesToCome, known_boxes
from pack_planner.algorithms.waste_weights import WasteWeights
from pack_planner.engine import BinModel, Candidate
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.engine.height_map import GRAVITY
from pack_planner.engine.least_waste import least_waste
from pack_planner.engine.room import unusable
from pack_planner.engine.turns import support_rule, turns_of

#: About what one search of a bin costs, seconds: medians are 0.2 (EQ) to 1.4 ms (PAL).
SEARCH_S = 0.0007
#: Rooms are looked at in steps of this, millimetres.
ROOM_STEP_MM = 5


@dataclass(frozen=True)
class Move:
    """One box into one bin.

    Attributes
    ----------
    rank : what moves of several boxes are compared by: the waste less a bonus for the size.
    waste : see :class:`WasteWeights`.
    box, bin_index : numbers of the box and of the bin.
    place : (x, y, z) of its corner, and its row in the sizes of all turns.
    """

    rank: float
    waste: float
    box: int
    bin_index: int
    place: tuple[int, int, int, int]


class Outlook:
    """All that the moves of one decision have in common.

    Attributes
    ----------
    problem, weights : what is to be decided, and by what.
    alike : how many moves of one box are known in a bin as it is; in a virtual one it is one.
    bins : the open bins as they are.
    searches : how often a bin was searched for some of the boxes.
    """

    def __init__(self, problem: Problem, weights: WasteWeights, alike: int) -> None:
        self.problem, self.weights, self.alike = problem, weights, alike
        self._due = time.monotonic() + problem.budget_s
        self.searches = 0
        profile = problem.engine.profile
        turns = [turns_of(box, profile) for box in problem.boxes]
        self._arrays = tuple(
            np.concatenate([getattr(each, name) for each in turns])
            for name in ('sizes', 'numbers', 'centres', 'sures')
        )
        starts = np.cumsum([0, *(len(each.sizes) for each in turns)])
        forces = np.array([box.weight_kg * GRAVITY for box in problem.boxes])
        self._rules = (support_rule(profile), profile.min_vertices)
        self._boxes = (*self._arrays, starts, forces)
        self._terms = weights.array(), replace(weights, shut_off=0.0).array()
        self._bonus = [
            weights.large_first * box.volume_mm3 / max(box.volume_mm3 for box in problem.boxes)
            for box in problem.boxes
        ]
        self._rooms: dict[tuple[int, int, int], tuple[NDArray[np.float64], ...]] = {}
        self._to_come = SizesToCome(problem, weights.mixed) if weights.room else None
        self._known: dict[tuple[int, frozenset[tuple[int, ...]]], VirtualBin] = {}
        self.bins = tuple(
            VirtualBin(self, index, model, frozenset())
            for index, model in enumerate(problem.bins)
        )  # fmt: skip

    def is_over(self) -> bool:
        """Whether the answer is due: by the clock, or since every node is used up.

        A node is a search of one bin for some of the boxes.
        """
        limit = self.problem.node_limit
        used_up = limit is not None and self.searches >= limit
        return used_up or time.monotonic() >= self._due

    def after(self, target: VirtualBin, move: Move) -> VirtualBin:
        """``target`` with one more box; the same object whatever the order of the moves."""
        moves = target.done | {(move.box, *move.place)}
        key = (target.index, moves)
        if key not in self._known:
            model = self.problem.engine.with_box(target.model, self.placed(move))
            self._known[key] = VirtualBin(self, target.index, model, moves)
        return self._known[key]

    def placed(self, move: Move) -> PlacedBox:
        """The box of ``move`` where that puts it."""
        x, y, z, row = move.place
        sizes, numbers, _, _ = self._arrays
        dx, dy, dz = sizes[row].tolist()
        orientation = ORIENTATIONS[int(numbers[row])]
        return PlacedBox(self.problem.boxes[move.box], (x, y, z), (dx, dy, dz), orientation)

    def waits(self, move: Move) -> float:
        """What ``move``, made next, costs by the tip of its box that no motion hides.

        Nothing in a cage: the way into one takes so long that it hides the tip.
        """
        tipped = not ORIENTATIONS[int(self._arrays[1][move.place[3]])].endswith('z')
        walls = self.bins[move.bin_index].model.source.spec.walls
        hidden = not tipped or walls is Walls.OPEN_FRONT
        return 0.0 if hidden else self.weights.late * move.box

    def candidate(self, move: Move) -> Candidate:
        """``move`` as the answer of an algorithm."""
        placed = self.placed(move)
        objective = self.problem.engine.objective(placed, move.bin_index)
        return Candidate(placed, move.bin_index, objective)

    def best_moves(
        self, index: int, model: BinModel, boxes: Sequence[int], count: int
    ) -> list[list[Move]]:
        """The ``count`` moves of least waste of each of ``boxes`` in the bin ``model``."""
        problem, source = self.problem, model.source
        limit = problem.engine.profile.max_bin_weight_kg
        load = source.weight_kg if limit is not None else 0.0
        which, zones = [], []
        for number in boxes:
            box = problem.boxes[number]
            refused = problem.forbidden(box, source)
            full = limit is not None and box.weight_kg + load > limit
            barred = (
                full or problem.engine.overweight(box) or not may_enter(box, source.destination)
            )
            if refused is not None and not model.blocked and not barred:
                which.append(number)
                zones.append(refused)
        self.searches += 1
        if not which:
            return [[] for _ in boxes]
        refused_rows = [
            (ORIENTATIONS.index(zone.orientation), *zone.corner_mm)
            for own in zones
            for zone in own
        ]  # fmt: skip
        terms = self._terms[source.spec.walls is not Walls.OPEN_FRONT]
        found, wastes = least_waste(
            source.spec.size_mm, *model.arrays(), *self._rules, np.array(which), *self._boxes,
            np.array(refused_rows, np.int64).reshape(-1, 4),
            np.cumsum([0, *(len(own) for own in zones)]), REFUSED_RADIUS_MM,
            self.weights.far_ends, terms, *self.rooms(source.spec.size_mm), count,
        )  # fmt: skip
        moves: dict[int, list[Move]] = {number: [] for number in boxes}
        age = self.weights.younger * index
        for number, places, values in zip(which, found.tolist(), wastes.tolist(), strict=True):
            moves[number] = [
                Move(waste + age - self._bonus[number], waste + age, number, index, tuple(place))
                for place, waste in zip(places, values, strict=True)
                if place[3] >= 0
            ]
        return list(moves.values())

    def closed_to(self, model: BinModel) -> float:
        """For which share of the sizes to come it has no place, times such boxes that fill it.

        0 where that has no weight, and where there are not walls all around.
        """
        if self._to_come is None or model.source.spec.walls is not Walls.CLOSED:
            return 0.0
        self.searches += 1
        return self._to_come.without_room(model) * self._to_come.boxes_to_fill(model)

    def rooms(self, bin_size: tuple[int, int, int]) -> tuple[NDArray[np.float64], ...]:
        """What stays empty on average of room above and beside in a bin of ``bin_size``."""
        if bin_size not in self._rooms:
            length, breadth, height = bin_size
            above = self._unusable(height, self.weights.above, (2,))
            beside = self._unusable(max(length, breadth), self.weights.beside, (0, 1))
            self._rooms[bin_size] = (above, beside)
        return self._rooms[bin_size]

    def _unusable(
        self, limit: int, weight: float, axes: tuple[int, ...]
    ) -> NDArray[np.float64]:  # fmt: skip
        if not weight:
            return np.zeros(limit + 1)
        profile = self.problem.engine.profile
        extents = [
            size[:, axis]
            for box in known_boxes(self.problem)
            for size in (turns_of(box, profile).sizes,)
            for axis in axes
        ]
        each, counts = np.unique(np.concatenate(extents), return_counts=True)
        shares = counts / counts.sum()
        room: NDArray[np.float64] = unusable(
            each, shares, limit, ROOM_STEP_MM, self.weights.choices
        )
        return room


class VirtualBin:
    """One open bin after some moves.

    Attributes
    ----------
    index : its number.
    model : what is in it.
    done : the moves into it so far.
    """

    def __init__(
        self, outlook: Outlook, index: int, model: BinModel, done: frozenset[tuple[int, ...]]
    ) -> None:
        self._outlook, self._moves = outlook, dict[int, list[Move]]()
        self._closed_to: float | None = None
        self.index, self.model, self.done = index, model, done

    def after(self, move: Move) -> VirtualBin:
        """This bin with one more box."""
        return self._outlook.after(self, move)

    def room_taken(self) -> float:
        """How much the moves so far close the bin to boxes to come; see :class:`WasteWeights`."""
        if not self.done:
            return 0.0
        return self.closed_to() - self._outlook.bins[self.index].closed_to()

    def closed_to(self) -> float:
        """See :meth:`Outlook.closed_to`."""
        if self._closed_to is None:
            self._closed_to = self._outlook.closed_to(self.model)
        return self._closed_to

    def moves(self, boxes: Collection[int]) -> Mapping[int, list[Move]]:
        """The best moves of at least ``boxes``, by the number of the box, best first."""
        new = [box for box in boxes if box not in self._moves]
        if new:
            count = 1 if self.done else self._outlook.alike
            found = self._outlook.best_moves(self.index, self.model, new, count)
            self._moves.update(zip(new, found, strict=True))
        return self._moves
