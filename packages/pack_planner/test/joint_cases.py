"""Joint problems small enough to try out every order and position, and the oracle that does."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from pack_msgs_py.orientation import allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms import Problem
from pack_planner.engine import BinModel, Engine
from pack_planner.engine.contact import touches

TINY = BinSpec('30x25x25', (300, 250, 250))

_State = list[tuple[BinSpec, list[PlacedBox]]]


def tiny_box(rng: random.Random, name: str) -> Box:
    edges = [float(rng.choice((40, 46, 50, 80, 96, 100, 130, 146, 150))) for _ in range(3)]
    return Box(
        name,
        (edges[0], edges[1], edges[2]),
        weight_kg=rng.choice((0.5, 2.0, 8.0)),
        com_offset_mm=(rng.choice((0.0, 0.0, 12.5, -20.0)), 0.0, 0.0),
        allowed_up=rng.choice((63, 63, 48)),
        max_top_load_n=rng.choice((None, None, None, 0.0, 30.0)),
    )


def tiny_problem(engine: Engine, seed: int, count: int, **changes: object) -> Problem:
    rng = random.Random(seed)
    bins = []
    for number in range(rng.choice((1, 1, 2))):
        target = Bin(f'bin-{number}', number + 1, TINY)
        for index in range(rng.choice((0, 2, 5, 9))):
            candidate = engine.best_placement(
                tiny_box(rng, f'{number}-{index}'), [engine.model(target)]
            )
            if candidate is not None:
                target = replace(
                    target, boxes=(*target.boxes, candidate.placed), revision=target.revision + 1
                )
        bins.append(engine.model(target))
    boxes = tuple(tiny_box(rng, f'new-{index}') for index in range(count))
    return Problem(engine, boxes, tuple(bins), **changes)  # type: ignore[arg-type]


@dataclass
class EveryOrder:
    """The least joint objective by trying out orders of increasing height and every position."""

    engine: Engine
    cep: bool = False

    def least(self, boxes: Sequence[Box], bins: Sequence[BinModel], bound: float) -> float:
        """The least objective below ``bound``, or ``bound``."""
        self._best = bound
        state = [(model.source.spec, list(model.source.boxes)) for model in bins]
        self._new = {box.id for box in boxes}
        self._place(list(boxes), state, 0.0, 0)
        return self._best

    def _place(self, left: list[Box], state: _State, cost: float, lowest: int) -> None:
        if not left:
            if not self.cep or self._all_touch(state):
                self._best = min(self._best, cost)
            return
        needed = {box.id: self._needs(box) for box in left}
        for box in left:
            others = sum(needed.values()) - needed[box.id]

            def too_dear(objective: float, others: float = others) -> bool:
                return cost + objective + others >= self._best - 1e-9

            for objective, index, placed in self._spots(box, state, lowest, too_dear):
                after = list(state)
                after[index] = (state[index][0], [*state[index][1], placed])
                rest = [other for other in left if other is not box]
                self._place(rest, after, cost + objective, placed.corner_mm[2])

    def _all_touch(self, state: _State) -> bool:
        step = self.engine.profile.resolution_mm
        return all(
            all(
                touches(
                    placed, [other for other in inside if other is not placed], spec.size_mm, step
                )
            )
            for spec, inside in state
            for placed in inside
            if placed.box.id in self._new
        )

    def _needs(self, box: Box) -> float:
        """What ``box`` costs at the very least: at the origin of the first bin, lying flattest."""
        profile, w = self.engine.profile, self.engine.weights
        heights = (
            planned_size(box, turn, profile)[2]
            for turn in allowed_orientations(box, profile.orientations)
        )
        return w.height * min(heights, default=math.inf) / 10 + w.bin_index

    def _spots(
        self, box: Box, state: _State, lowest: int, too_dear: Callable[[float], bool]
    ) -> Iterator[tuple[float, int, PlacedBox]]:
        """Where ``box`` may stand at ``lowest`` or above, unless it is too dear there."""
        profile = self.engine.profile
        step = profile.resolution_mm
        for index, (spec, others) in enumerate(state):
            below = [(other.corner_mm, other.far_mm, other.top_mm) for other in others]
            for turn in allowed_orientations(box, profile.orientations):
                dx, dy, dz = planned_size(box, turn, profile)
                for x in range(0, spec.size_mm[0] - dx + 1, step):
                    for y in range(0, spec.size_mm[1] - dy + 1, step):
                        on_the_floor = PlacedBox(box, (x, y, 0), (dx, dy, dz), turn)
                        if too_dear(self.engine.objective(on_the_floor, index)):
                            continue
                        z = max(
                            (
                                top
                                for corner, far, top in below
                                if corner[0] < x + dx
                                and x < far[0]
                                and corner[1] < y + dy
                                and y < far[1]
                            ),
                            default=0,
                        )
                        placed = PlacedBox(box, (x, y, z), (dx, dy, dz), turn)
                        objective = self.engine.objective(placed, index)
                        if z < lowest or too_dear(objective):
                            continue
                        if next(violations(placed, others, spec, profile), None) is None:
                            yield objective, index, placed
