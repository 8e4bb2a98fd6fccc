"""All placements of one box that the rules allow at given positions, for rules that rank them.

The positions are either points of the caller's (extreme points, corner points) or the candidate
lines of :mod:`pack_planner.engine.search`: between two of these lines the rest height and the
supported vertices are constant, so every kind of placement occurs at one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine.engine import (
    REFUSED_RADIUS_MM,
    Candidate,
    Engine,
    Forbidden,
    nothing_forbidden,
)
from pack_planner.engine.height_map import GRAVITY, BinModel
from pack_planner.engine.search import _spans, _zone_lines, candidate_lines, in_zone
from pack_planner.engine.stands import stands_at
from pack_planner.engine.support import resting_vertices, well_supported
from pack_planner.engine.turns import support_rule, turns_of

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Spots:
    """Allowed placements of one box in one bin, one a row.

    Attributes
    ----------
    box : the box.
    corners : int64 (n, 3), corner nearest the bin's origin, millimetres.
    sizes : int64 (n, 3), planned size along the bin's axes, millimetres.
    turns : int64 (n,), indices into :data:`pack_msgs_py.orientation.ORIENTATIONS`.
    """

    box: Box
    corners: Ints
    sizes: Ints
    turns: Ints

    def __len__(self) -> int:
        return len(self.turns)

    def placed(self, row: int) -> PlacedBox:
        """Row ``row`` as a placed box."""
        x, y, z = self.corners[row].tolist()
        dx, dy, dz = self.sizes[row].tolist()
        return PlacedBox(self.box, (x, y, z), (dx, dy, dz), ORIENTATIONS[int(self.turns[row])])

    def candidate(self, row: int, bin_index: int, engine: Engine) -> Candidate:
        """Row ``row`` as a placement in the open bin ``bin_index``, from 0, oldest first."""
        placed = self.placed(row)
        return Candidate(placed, bin_index, engine.objective(placed, bin_index))


def all_spots(
    engine: Engine,
    box: Box,
    model: BinModel,
    forbidden: Forbidden = nothing_forbidden,
    *,
    far_ends: bool = False,
) -> Spots:
    """Every allowed placement on the candidate lines, in the order of orientation, x, y.

    On the candidate lines a box lies as near the origin as its surroundings stay the same; with
    ``far_ends`` the farthest such positions are there too, flush with what lies beyond.
    """
    return _spots(engine, box, model, forbidden, None, far_ends=far_ends)


def spots_at(
    engine: Engine,
    box: Box,
    model: BinModel,
    points: Ints,
    forbidden: Forbidden = nothing_forbidden,
) -> Spots:
    """Every allowed placement with its corner at one of ``points``, shape (n, 2), millimetres.

    A point off the grid is moved to the next grid position; the box lies where it comes to rest.
    """
    step = engine.profile.resolution_mm
    return _spots(engine, box, model, forbidden, -(-points // step) * step, far_ends=False)


def _spots(
    engine: Engine, box: Box, model: BinModel, forbidden: Forbidden, points: Ints | None,
    *, far_ends: bool,
) -> Spots:  # fmt: skip
    profile = engine.profile
    turns = turns_of(box, profile)
    zones = forbidden(box, model.source)
    limit = profile.max_bin_weight_kg
    full = limit is not None and box.weight_kg + model.source.weight_kg > limit
    barred = full or not may_enter(box, model.source.destination)
    if zones is None or model.blocked or barred or engine.overweight(box):
        none = np.empty((0, 3), np.int64)
        return Spots(box, none, none, np.empty(0, np.int64))
    refused = np.array(
        [(ORIENTATIONS.index(zone.orientation), *zone.corner_mm) for zone in zones], np.int64
    ).reshape(-1, 4)
    shared: tuple[Any, ...] = (
        model.source.spec.size_mm, *model.arrays(), support_rule(profile), profile.min_vertices,
        turns.sizes, turns.numbers, turns.centres, turns.sures, box.weight_kg * GRAVITY, refused,
        REFUSED_RADIUS_MM,
    )  # fmt: skip
    rows = _on_lines(*shared, far_ends) if points is None else _at_points(*shared, points)
    which = rows[:, 3]
    # one memory layout whatever the number of rows, so that compiled code serves for all
    corners = np.ascontiguousarray(rows[:, :3])
    return Spots(box, corners, turns.sizes[which], turns.numbers[which])


@njit(cache=True, nogil=True)
def _with_far_ends(positions, step, limit):  # type: ignore[no-untyped-def]
    """``positions`` and the last grid position before each, and the limit."""
    ends = np.empty(2 * len(positions) + 1, np.int64)
    for i in range(len(positions)):
        ends[2 * i] = positions[i]
        ends[2 * i + 1] = max(positions[i] - step, 0)
    ends[2 * len(positions)] = limit
    return np.unique(ends)


@njit(cache=True, nogil=True)
def _on_lines(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, sizes, turns, centres, sures, force, zones, radius, far_ends,
):  # fmt: skip
    """Allowed (x, y, z, number of the orientation) on the candidate lines."""
    step, tolerance, com_margin, min_share, stability = rule
    varies = max(com_margin, stability) > -np.inf or min_share > 0.0 or len(slack) > 0
    spots = np.empty((256, 4), np.int64)
    count = 0
    highest = np.empty(len(rows), height.dtype)
    for k in range(len(sizes)):
        dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
        if dx > bin_size[0] or dy > bin_size[1] or dz > bin_size[2]:
            continue
        turn = turns[k]
        limit_x = (bin_size[0] - dx) // step * step
        limit_y = (bin_size[1] - dy) // step * step
        xs = candidate_lines(lines_x, dx, step, limit_x, _zone_lines(zones, turn, 0, radius, step))
        ys = candidate_lines(lines_y, dy, step, limit_y, _zone_lines(zones, turn, 1, radius, step))
        if far_ends:
            xs = _with_far_ends(xs, step, limit_x)
            ys = _with_far_ends(ys, step, limit_y)
        span_x = _spans(xs, dx, step, columns)
        span_y = _spans(ys, dy, step, rows)
        for i in range(len(xs)):
            x = xs[i]
            left, right, end_x = span_x[i, 0], span_x[i, 1], span_x[i, 2]
            highest[:] = 0
            for column in range(left, end_x):
                for row in range(len(rows) - 1):
                    highest[row] = max(highest[row], height[column, row])
            for j in range(len(ys)):
                y = ys[j]
                front, back, end_y = span_y[j, 0], span_y[j, 1], span_y[j, 2]
                z = 0
                for row in range(front, end_y):
                    z = max(z, highest[row])
                if z + dz > bin_size[2]:
                    continue
                if z > 0:
                    resting = resting_vertices(
                        boxes, owner, left, right, front, back, x, y, dx, dy, step, z, tolerance
                    )
                    if resting < min_vertices:
                        continue
                    if varies and not well_supported(
                        boxes, bearing, (x, y, x, y), (dx, dy, dz), z, rule, centres[k], sures[k],
                        force, slack, passed_on,
                    ):  # fmt: skip
                        continue
                if in_zone(zones, radius, turn, x, y, z):
                    continue
                if count == len(spots):
                    spots = np.concatenate((spots, np.empty_like(spots)))
                spots[count, 0], spots[count, 1], spots[count, 2], spots[count, 3] = x, y, z, k
                count += 1
    return spots[:count]


@njit(cache=True, nogil=True)
def _at_points(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, sizes, turns, centres, sures, force, zones, radius, points,
):  # fmt: skip
    """Allowed (x, y, z, number of the orientation) at ``points``."""
    spots = np.empty((len(points) * len(sizes), 4), np.int64)
    count = 0
    for k in range(len(sizes)):
        dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
        for point in points:
            x, y = point
            if x + dx > bin_size[0] or y + dy > bin_size[1]:
                continue
            z = 0
            for i in range(np.searchsorted(columns, x, 'right') - 1, len(columns) - 1):
                if columns[i] >= x + dx:
                    break
                for j in range(np.searchsorted(rows, y, 'right') - 1, len(rows) - 1):
                    if rows[j] >= y + dy:
                        break
                    z = max(z, height[i, j])
            if in_zone(zones, radius, turns[k], x, y, z):
                continue
            if stands_at(
                bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack,
                passed_on, bearing, rule, min_vertices, (x, y, z), (dx, dy, dz), centres[k],
                sures[k], force,
            ):  # fmt: skip
                spots[count, 0], spots[count, 1], spots[count, 2], spots[count, 3] = x, y, z, k
                count += 1
    return spots[:count]
