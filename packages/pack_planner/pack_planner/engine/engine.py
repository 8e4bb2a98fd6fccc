"""The packing engine: where one box goes best, exactly, under every rule of a profile."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.geometry.taken_up import taken_up
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.profiles import Profile, planned_size
from pack_msgs_py.rules import may_enter, violations
from pack_msgs_py.values import Bin, BinSpec, Box, Int3, PlacedBox
from pack_planner.engine.contact import search_touching, solids, touching
from pack_planner.engine.height_map import GRAVITY, BinModel, build_model, with_box
from pack_planner.engine.search import OBJECTIVE, TURN, X, Y, Z, search_bin
from pack_planner.engine.stands import stands_at
from pack_planner.engine.turns import Turns, support_rule, turns_of

#: How far around a refused position the same box is not offered again, millimetres.
REFUSED_RADIUS_MM = 40

#: Far above what makes one term of eq. (1) count alone.
MOST_WEIGHT = 1e6

_MODELS_KEPT = 16


class EngineMismatch(RuntimeError):
    """What was chosen breaks a packing rule: a defect of the algorithm, never the input's."""


@dataclass(frozen=True)
class Weights:
    """Weights of eq. (1) of Ojha et al.; lengths count in centimetres.

    ``position`` is w1, ``height`` w2, ``bin_index`` w3.
    """

    position: float = 1.0
    height: float = 1.0
    bin_index: float = 100.0

    def __post_init__(self) -> None:
        for name, value in (
            ('w1', self.position), ('w2', self.height), ('w3', self.bin_index),
        ):  # fmt: skip
            if not math.isfinite(value) or not 0 <= value <= MOST_WEIGHT:
                msg = f'weight {name} is {value}; it must be 0 to {MOST_WEIGHT:g}'
                raise ValueError(msg)


@dataclass(frozen=True)
class Zone:
    """A refused position of one box: not again within 4 cm at the same height and turn."""

    orientation: str
    corner_mm: Int3


#: Refused zones of one box in one bin; ``None`` when the box may not go into that bin at all.
Forbidden = Callable[[Box, Bin], 'tuple[Zone, ...] | None']


def nothing_forbidden(box: Box, target: Bin) -> tuple[Zone, ...]:
    """No refusals."""
    return ()


@dataclass(frozen=True)
class Candidate:
    """A placement the rules allow.

    Attributes
    ----------
    placed : box, planned corner, planned size and orientation.
    bin_index : position of the bin among the open ones, from 0, oldest first.
    objective : eq. (1) of Ojha et al. for this box, centimetres.
    """

    placed: PlacedBox
    bin_index: int
    objective: float


class Engine:
    """Exact search under one profile with one set of weights.

    Construction compiles the search (or loads it from numba's cache), so that no decision does.
    """

    def __init__(self, profile: Profile, weights: Weights | None = None) -> None:
        self.profile = profile
        self.weights = weights or Weights()
        self._models: dict[tuple[str, int], BinModel] = {}
        self._warm_up()

    def model(self, source: Bin) -> BinModel:
        """The model of ``source``, built once per content, with boxes where they were measured."""
        source = self._as_measured(source)
        key = (source.id, source.revision)
        model = self._models.pop(key, None)
        if model is None or _content(model.source) != _content(source):
            model = self._build(source)
        self._models[key] = model
        while len(self._models) > _MODELS_KEPT:
            del self._models[next(iter(self._models))]
        return model

    def _as_measured(self, source: Bin) -> Bin:
        boxes = taken_up(source.boxes, source.spec, self.profile.resolution_mm)
        same = all(new is old for new, old in zip(boxes, source.boxes, strict=True))
        return source if same else replace(source, boxes=boxes)

    def _build(self, source: Bin) -> BinModel:
        old = self._models.get((source.id, source.revision - 1))
        grown_by_one = (
            old is not None
            and len(source.boxes) == len(old.source.boxes) + 1
            and _content(old.source) == _content(replace(source, boxes=source.boxes[:-1]))
        )
        if old is not None and grown_by_one:
            return with_box(old, source.boxes[-1], self.profile)
        return build_model(source, self.profile)

    def with_box(self, model: BinModel, placed: PlacedBox) -> BinModel:
        """``model`` with one more box; the rules are not checked."""
        return with_box(model, placed, self.profile)

    def best_placement(
        self,
        box: Box,
        bins: Sequence[BinModel],
        forbidden: Forbidden = nothing_forbidden,
        *,
        cep: bool = False,
    ) -> Candidate | None:
        """The placement of least objective over all positions, orientations and bins.

        Equal objectives go by bin, z, y, x and orientation. ``bins`` are the open bins, oldest
        first; ``cep`` asks for contact along x and y, see :mod:`pack_planner.engine.contact`.
        ``None`` when the rules allow no placement.
        """
        turns = turns_of(box, self.profile)
        if not self._liftable(box) or len(turns.sizes) == 0:
            return None
        best: NDArray[np.float64] | None = None
        best_index = 0
        for index, model in enumerate(bins):
            zones = forbidden(box, model.source)
            if zones is None or model.blocked or not self._admitted(box, model.source):
                continue
            bound = math.inf if best is None else float(best[OBJECTIVE])
            position = self._search(box, turns, model, index, zones, bound, cep=cep)
            if position[Z] >= 0:
                best, best_index = position, index
        if best is None:
            return None
        orientation = ORIENTATIONS[int(best[TURN])]
        corner = (int(best[X]), int(best[Y]), int(best[Z]))
        size = planned_size(box, orientation, self.profile)
        placed = PlacedBox(box, corner, size, orientation)
        return Candidate(placed, best_index, self.objective(placed, best_index))

    def objective(self, placed: PlacedBox, bin_index: int) -> float:
        """Eq. (1) of Ojha et al. for one box in the bin at ``bin_index`` (from 0), centimetres."""
        return self.increase(placed) + self.weights.bin_index * (bin_index + 1)

    def increase(self, placed: PlacedBox) -> float:
        """The same without the bin's index: what box selection compares (section III-A.3)."""
        x, y, _ = placed.corner_mm
        w = self.weights
        return (w.position * (x + y) + w.height * placed.top_mm) / 10.0

    def stands(self, placed: PlacedBox, model: BinModel, *, cep: bool = False) -> bool:
        """Whether ``placed`` would be allowed on the boxes of ``model`` alone."""
        if model.blocked or not self._admitted(placed.box, model.source):
            return False
        step = self.profile.resolution_mm
        if cep and not touching(
            solids(model), model.source.spec.size_mm, placed.corner_mm, placed.size_mm, step
        ):
            return False
        turns = turns_of(placed.box, self.profile)
        number = ORIENTATIONS.index(placed.orientation)
        which = int(np.flatnonzero(turns.numbers == number)[0])
        return bool(
            stands_at(
                model.source.spec.size_mm, *model.arrays(), support_rule(self.profile),
                self.profile.min_vertices, placed.corner_mm, placed.size_mm, turns.centres[which],
                turns.sures[which], placed.box.weight_kg * GRAVITY,
            )
        )  # fmt: skip

    def fits_empty_bin(self, box: Box, spec: BinSpec) -> bool:
        """Whether an empty bin of this kind would take ``box`` in any allowed orientation."""
        return any(
            all(edge <= limit for edge, limit in zip(size, spec.size_mm, strict=True))
            for size in turns_of(box, self.profile).sizes.tolist()
        )

    def overweight(self, box: Box) -> str:
        """Why ``box`` is too heavy for the arm or for any bin; empty when it is not."""
        for what, limit in (
            ('the arm lifts', self.profile.max_payload_kg),
            ('a bin carries', self.profile.max_bin_weight_kg),
        ):
            if limit is not None and box.weight_kg > limit:
                return f'weighs {box.weight_kg:g} kg, {what} {limit:g} kg'
        return ''

    def broken_rules(self, candidate: Candidate, target: Bin) -> str:
        """What :mod:`pack_msgs_py.rules` says against a placement; empty when nothing."""
        placed = candidate.placed
        others = self._as_measured(target).boxes
        broken = violations(placed, others, target.spec, self.profile, target.destination)
        return '; '.join(str(violation) for violation in broken)

    def _search(
        self, box: Box, turns: Turns, model: BinModel, index: int,
        zones: tuple[Zone, ...], bound: float, *, cep: bool,
    ) -> NDArray[np.float64]:  # fmt: skip
        refused = np.array(
            [(ORIENTATIONS.index(zone.orientation), *zone.corner_mm) for zone in zones], np.int64
        ).reshape(-1, 4)
        weights = (
            float(self.weights.position), float(self.weights.height),
            10.0 * self.weights.bin_index * (index + 1),
        )  # fmt: skip
        about = (
            model.source.spec.size_mm, *model.arrays(), support_rule(self.profile),
            self.profile.min_vertices, turns.sizes, turns.numbers, turns.centres, turns.sures,
            box.weight_kg * GRAVITY, refused, REFUSED_RADIUS_MM, weights, bound,
        )  # fmt: skip
        position: NDArray[np.float64] = (
            search_touching(*about, solids(model)) if cep else search_bin(*about)
        )
        return position

    def _liftable(self, box: Box) -> bool:
        limit = self.profile.max_payload_kg
        return limit is None or box.weight_kg <= limit

    def _admitted(self, box: Box, target: Bin) -> bool:
        limit = self.profile.max_bin_weight_kg
        return may_enter(box, target.destination) and (
            limit is None or box.weight_kg + target.weight_kg <= limit
        )

    def _warm_up(self) -> None:
        """Run every compiled function once."""
        bin_spec = BinSpec('warm-up', (400, 300, 300))
        boxes = [Box(f'warm-up {i}', (120.0, 100.0, 80.0), max_top_load_n=1e4) for i in range(6)]
        model = self.model(Bin('warm-up', 1, bin_spec))
        refused = (Zone('xyz', (0, 0, 0)),)
        for box in boxes:
            self.best_placement(box, [model], lambda _box, _bin: refused, cep=True)
            candidate = self.best_placement(box, [model], lambda _box, _bin: refused)
            if candidate is None:
                break
            self.stands(candidate.placed, model, cep=True)
            model = self.with_box(model, candidate.placed)
        self._models.clear()


def _content(target: Bin) -> tuple[object, ...]:
    """What a model depends on."""
    return target.boxes, target.spec, target.destination
