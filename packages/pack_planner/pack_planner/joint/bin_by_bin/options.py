"""What a joint solution chooses from: for each box a bin, a face up and a base.

With that chosen for all boxes, heights are no matter any more: who may lie on whom is known, and so
is who must stand clear of whom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Zone
from pack_planner.joint.bin_by_bin.places import list_rows
from pack_planner.joint.bounds import NEVER, Ground, landings

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Corners = NDArray[np.int8]
#: Refused positions of a box in a bin.
Zones = Sequence[Zone] | None


@dataclass(frozen=True, eq=False)
class Options:
    """Options of all boxes in one bin, in any order.

    Attributes
    ----------
    box, base, top, leans : of each option; millimetres.
    size : smaller and larger edge of the base, and height, of each, (options, 3).
    cost : the least that it costs.
    flat : what it costs besides w1 (x + y).
    rows : its one or two turns, numbers of rows, the same one twice for one, (options, 2).
    row : of each turn (face, base, leans, shape).
    by_x, by_y : least y at each x and least x at each y of the places of each row.
    """

    box: Ints
    base: Ints
    top: Ints
    leans: Flags
    size: Ints
    cost: NDArray[np.float64]
    flat: NDArray[np.float64]
    rows: Ints
    row: Ints
    by_x: NDArray[np.int16]
    by_y: NDArray[np.int16]


@dataclass(frozen=True, eq=False)
class BinPlaces:
    """A bin as :mod:`.places` wants it.

    Attributes
    ----------
    shapes : rows (box, orientation, wide, deep, height), cells and millimetres.
    land, low, weak : see :func:`.places.list_rows`.
    zones : refused positions as rows (shape, x, y, z), millimetres.
    ground : (height map, (tolerance, corners needed)).
    refusal : (radius of refusal, resolution), millimetres.
    weights : w1 per cell, w2 per millimetre, value of the bin's index.
    barred : of each box, whether positions of it were refused here.
    """

    shapes: Ints
    land: NDArray[np.int32]
    low: NDArray[np.int32]
    weak: NDArray[np.int32]
    zones: Ints
    ground: tuple[NDArray[np.int32], tuple[int, int]]
    refusal: tuple[float, int]
    weights: tuple[float, float, float]
    barred: tuple[bool, ...]


def bin_places(
    ground: Ground, low: NDArray[np.int32], weak: NDArray[np.int32], zones: Sequence[Zones],
    rule: tuple[int, int, int],
) -> BinPlaces:  # fmt: skip
    """``zones``: of each box; ``rule``: resolution, support tolerance, corners needed."""
    step = rule[0]
    refused = [
        (s, *zone.corner_mm)
        for s, (box, number) in enumerate(ground.shapes[:, :2].tolist())
        for zone in zones[box] or ()
        if ORIENTATIONS.index(zone.orientation) == number
    ]
    w1, w2, w3 = ground.weights
    return BinPlaces(
        ground.shapes // np.array([1, 1, step, step, 1]),
        landings(ground.size, ground.height, step, ground.shapes), low, weak,
        np.array(refused, np.int64).reshape(-1, 4),
        (ground.height, rule[1:]), (float(REFUSED_RADIUS_MM), step), (w1 * step, w2, w3),
        tuple(bool(one) for one in zones),
    )  # fmt: skip


def list_options(
    places: BinPlaces, limit: int, boxes: Sequence[Box], caps: NDArray[np.float64]
) -> Options:
    """All options in one bin of height ``limit`` that may cost less than the caps of the boxes.

    What leans on nothing that is an option itself is left out.
    """
    plain = [
        not any(box.com_offset_mm) and not barred
        for box, barred in zip(boxes, places.barred, strict=True)
    ]
    faces = _faces(places.shapes, plain)
    tops = np.unique(places.ground[0])
    heights = [
        {int(dz) for which, _, _, _, dz in places.shapes.tolist() if which == i}
        for i in range(len(boxes))
    ]
    bases = np.stack([
        _sums(tops, [one for k, one in enumerate(heights) if k != i], limit)
        for i in range(len(boxes))
    ])  # fmt: skip
    levels = np.flatnonzero(bases.any(axis=0))
    row, by_x, by_y = list_rows(
        faces, places.shapes, places.land, places.low, places.weak, places.ground, places.weights,
        caps, levels, limit, np.ascontiguousarray(bases[:, levels]),
    )  # fmt: skip
    first = np.ones(len(row), np.bool_)
    first[1:] = (row[1:, :3] != row[:-1, :3]).any(axis=1)
    starts = np.flatnonzero(first)
    rows = np.stack([starts, np.append(starts, len(row))[1:] - 1], axis=1)
    shape = places.shapes[row[starts, 3]]
    flat = places.weights[1] * (row[starts, 1] + shape[:, 4]) + places.weights[2]
    nearest = (by_x + np.arange(by_x.shape[1])).min(axis=1, initial=NEVER)
    size = np.stack([shape[:, 2:4].min(axis=1), shape[:, 2:4].max(axis=1), shape[:, 4]], axis=1)
    found = Options(
        shape[:, 0], row[starts, 1], row[starts, 1] + shape[:, 4], row[starts, 2] == 1, size,
        flat + places.weights[0] * nearest[rows].min(axis=1), flat, rows, row, by_x, by_y,
    )  # fmt: skip
    return _with_holders(found, places.ground)


def _faces(shapes: Ints, plain: Sequence[bool]) -> Ints:
    """Shapes that differ in the turn about the vertical alone, (faces, 2); -1 without another.

    Of a ``plain`` box any orientation that takes the same space will do.
    """
    found: dict[tuple[int, ...], list[int]] = {}
    for s, (box, number, wide, deep, dz) in enumerate(shapes.tolist()):
        key = (box, min(wide, deep), max(wide, deep), dz, -1 if plain[box] else number)
        same = found.setdefault(key, [])
        if all(shapes[o, 2] != wide for o in same):
            same.append(s)
    faces = [(*same, -1)[:2] for _, same in sorted(found.items())]
    return np.array(faces, np.int64).reshape(-1, 2)


def _sums(tops: NDArray[np.int32], heights: Sequence[set[int]], limit: int) -> Flags:
    """Which bases one box, or several in a stack, on a placed top or the floor can give."""
    found = np.zeros(limit + 1, np.bool_)
    found[tops[tops <= limit]] = found[0] = True
    for own in heights:
        before = found.copy()
        for dz in own:
            if dz <= limit:
                found[dz:] |= before[: limit + 1 - dz]
    return found


def level_with_placed(base: Ints, ground: tuple[NDArray[np.int32], tuple[int, int]]) -> Flags:
    """Whether a placed top is level with each base, within the tolerance."""
    height, (tolerance, _) = ground
    gap = base[:, None] - np.unique(height[height > 0])[None, :]
    return np.asarray(((gap >= 0) & (gap <= tolerance)).any(axis=1))


def corners_needed(ground: tuple[NDArray[np.int32], tuple[int, int]]) -> int:
    """How many corners of a box that leans must be held; one where the rules ask for none."""
    return max(ground[1][1], 1)


def holding(options: Options, ground: tuple[NDArray[np.int32], tuple[int, int]]) -> Corners:
    """How many corners of one option another one under it may hold at most, [upper, lower].

    All that are needed where a placed top is level with the base, since that may hold the others.
    """
    found: Corners = _corners(
        options.box, options.base, options.top, options.leans,
        level_with_placed(options.base, ground), options.size, ground[1][0], corners_needed(ground),
    )  # fmt: skip
    return found


@njit(cache=True, nogil=True)
def _corners(box, base, top, leans, level, size, tolerance, needed):  # type: ignore[no-untyped-def]
    """See :func:`holding`; a base with two corners on a box has an edge that is no longer."""
    count = len(box)
    found = np.zeros((count, count), np.int8)
    for o in range(count):
        if not leans[o]:
            continue
        for h in range(count):
            if box[h] == box[o] or not 0 <= base[o] - top[h] <= tolerance:
                continue
            most = 1
            if size[o, 0] <= size[h, 0] and size[o, 1] <= size[h, 1]:
                most = 4
            elif size[o, 0] <= size[h, 1]:
                most = 2
            found[o, h] = max(most, needed) if level[o] else most
    return found


def _with_holders(options: Options, ground: tuple[NDArray[np.int32], tuple[int, int]]) -> Options:
    """Without options that lean on too little."""
    needed = corners_needed(ground)
    keep = np.arange(len(options.box))
    while True:
        some = chosen(options, keep)
        corners = holding(some, ground)
        most = np.zeros(len(keep), np.int64)
        for b in np.unique(some.box):
            most += corners[:, some.box == b].max(axis=1)
        held = (most >= needed) | ~some.leans
        if held.all():
            return some
        keep = keep[held]


def chosen(options: Options, keep: Ints) -> Options:
    """Some of the options; the rows stay as they are."""
    one = options
    return Options(
        one.box[keep], one.base[keep], one.top[keep], one.leans[keep], one.size[keep],
        one.cost[keep], one.flat[keep], one.rows[keep], one.row, one.by_x, one.by_y,
    )  # fmt: skip
