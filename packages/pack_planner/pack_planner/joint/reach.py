"""Where each box of a look-ahead can be in a joint solution better than a known one: the steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Box
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.joint.bounds import (
    NEVER,
    UNBOUNDED,
    CostWeights,
    SupportRule,
    carriers,
    cheapest,
    landings,
    paint,
    raise_bases,
)
from pack_planner.joint.budget import Budget

#: How often the caps are lowered by what was found.
_PASSES = 2

Heights = NDArray[np.int32]
Costs = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ground:
    """A bin as the bounds see it.

    Attributes
    ----------
    size : inner length, breadth, height, millimetres.
    height : highest top over each cell, (cells, cells), millimetres.
    owner : number of the placed box whose top that is, -1 for none, (cells, cells).
    shapes : rows (box, orientation number, dx, dy, dz) of what may go in, millimetres.
    weights : what a box costs there.
    """

    size: tuple[int, int, int]
    height: Heights
    owner: Heights
    shapes: NDArray[np.int64]
    weights: CostWeights


@dataclass(frozen=True, eq=False)
class Reach:
    """Where each box can be in a joint solution no worse than the known one.

    Attributes
    ----------
    grounds : the bins.
    low : for each bin the lowest base of each of its shapes at each cell, (shapes, cells, cells),
        ``NEVER`` where it cannot be.
    least : the least that each box costs in each bin, (bins, boxes), infinite where it cannot be.
    caps : the most that each box may cost, (boxes,). Costs are ten times those of eq. (1).
    """

    grounds: tuple[Ground, ...]
    low: tuple[Heights, ...]
    least: Costs
    caps: Costs

    @property
    def cheapest(self) -> Costs:
        """The least that each box costs in any bin, (boxes,)."""
        least: Costs = self.least.min(axis=0)
        return least


def find_reach(
    engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
    known: Sequence[Candidate] | None, budget: Budget,
) -> Reach | None:  # fmt: skip
    """Bounds for ``boxes`` in ``bins``, given a joint solution; ``None`` when the time is out."""
    profile = engine.profile
    grounds = [ground_of(engine, boxes, model, j, forbidden) for j, model in enumerate(bins)]
    upper = math.inf if known is None else 10.0 * sum(candidate.objective for candidate in known)
    rule = SupportRule(profile.resolution_mm, profile.support_tolerance_mm, profile.min_vertices)
    reach = bounds_of(grounds, len(boxes), rule, upper, budget)
    return None if budget.is_out() else reach


def ground_of(
    engine: Engine, boxes: Sequence[Box], model: BinModel, j: int, forbidden: Forbidden
) -> Ground:
    """The open bin at index ``j``, and what of ``boxes`` may go into it."""
    step, weights, size = engine.profile.resolution_mm, engine.weights, model.source.spec.size_mm
    height, owner = paint(model.boxes, size[0] // step, size[1] // step, step)
    shapes = [np.empty((0, 5), np.int64)]
    for i, box in enumerate(boxes):
        barred = forbidden(box, model.source) is None or model.blocked
        if not barred and admits(box, model, engine):
            shapes.append(shapes_of(box, i, engine))
    costs = CostWeights(
        float(weights.position), float(weights.height), 10.0 * weights.bin_index * (j + 1)
    )
    return Ground(size, height, owner, np.concatenate(shapes), costs)


def shapes_of(box: Box, number: int, engine: Engine) -> NDArray[np.int64]:
    """Rows (number, orientation number, dx, dy, dz) of the orientations that ``box`` may have."""
    profile = engine.profile
    rows = [
        (number, ORIENTATIONS.index(orientation), *planned_size(box, orientation, profile))
        for orientation in allowed_orientations(box, profile.orientations)
    ]
    return np.array(rows, np.int64).reshape(-1, 5)


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


def bounds_of(
    grounds: Sequence[Ground], count: int, rule: SupportRule, upper: float, budget: Budget
) -> Reach | None:
    """Bounds for ``count`` boxes; ``None`` when the time is out.

    Parameters
    ----------
    grounds : the bins.
    count : how many boxes.
    rule : when a box is held up.
    upper : what all boxes cost in the known solution, ten times eq. (1).
    budget : seconds that are left.
    """
    stop = budget.stop
    known = np.full(count, math.inf)
    land, low = [], []
    for ground in grounds:
        tops = landings(ground.size, ground.height, rule.step, ground.shapes, stop)
        if stop[0]:
            return None
        cheapest(tops, ground.shapes, rule.step, ground.weights, known, stop)
        land.append(tops)
        low.append(np.full_like(tops, NEVER))
    least = np.tile(known, (len(grounds), 1))
    caps = np.full(count, UNBOUNDED)
    for _ in range(_PASSES):
        if not np.isfinite(known).all() or budget.is_out():
            break
        caps = np.minimum(caps, upper - (known.sum() - known))
        least = np.full((len(grounds), count), math.inf)
        for j, ground in enumerate(grounds):
            if stop[0]:
                return None
            limits = caps, known
            _stack(ground, land[j], low[j], rule, limits, least[j], budget)
        better = np.maximum(known, least.min(axis=0))
        gained = better.sum() - known.sum()
        known = better
        if not gained > 0.1 * (caps.max() - known.min()):
            break
    if np.isfinite(known).all():
        caps = np.minimum(caps, upper - (known.sum() - known))
    return Reach(tuple(grounds), tuple(low), least, caps)


def _stack(
    ground: Ground, land: Heights, low: Heights, rule: SupportRule,
    limits: tuple[Costs, Costs], least: Costs, budget: Budget,
) -> None:  # fmt: skip
    """Fill ``low`` and ``least`` for one bin, stack by stack."""
    caps, known = limits
    count = len(least)
    tops = np.full((count, *ground.height.shape), NEVER, np.int32)
    costs = np.full(tops.shape, np.float32(UNBOUNDED), np.float32)
    before = -1
    for _ in range(count):
        least[:] = math.inf
        left = raise_bases(
            ground.height, ground.size[2], rule, ground.shapes, ground.weights, caps,
            known, tops, costs, land, low, least, budget.stop,
        )  # fmt: skip
        if left in (before, 0) or budget.is_out():
            return
        before = left
        carriers(low, ground.shapes, rule.step, ground.weights, caps, tops, costs, budget.stop)
