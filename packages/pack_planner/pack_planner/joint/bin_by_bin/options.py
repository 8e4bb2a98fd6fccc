"""What a joint solution chooses from: for each box a bin, a face up and a base.

With that chosen for all boxes, heights are no matter any more: who may lie on whom is known, and so
is who must stand clear of whom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Zone
from pack_planner.joint.bin_by_bin.group_problem import Flags, Ints, PlacedTops
from pack_planner.joint.bin_by_bin.places import FAR, RefusalRange, list_rows
from pack_planner.joint.bounds import CostWeights, SupportRule, landings
from pack_planner.joint.compiled import compiled, entry
from pack_planner.joint.reach import Ground

Corners = NDArray[np.int8]
#: Refused positions of a box in a bin.
Zones = Sequence[Zone] | None


@dataclass(frozen=True, eq=False)
class BoxOptions:
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
    tops : what boxes may stand on.
    refusal : how far around refused positions, and the resolution, millimetres.
    weights : per cell of x and y, per millimetre of height, value of the bin's index.
    barred : of each box, whether positions of it were refused here.
    """

    shapes: Ints
    land: NDArray[np.int32]
    low: NDArray[np.int32]
    weak: NDArray[np.int32]
    zones: Ints
    tops: PlacedTops
    refusal: RefusalRange
    weights: CostWeights
    barred: tuple[bool, ...]


def bin_places(
    ground: Ground, low: NDArray[np.int32], weak: NDArray[np.int32], zones: Sequence[Zones],
    rule: SupportRule, stop: Flags,
) -> BinPlaces:  # fmt: skip
    """``zones``: of each box; ``rule``: of the profile."""
    step, weights = rule.step, ground.weights
    refused = [
        (s, *zone.corner_mm)
        for s, (box, number) in enumerate(ground.shapes[:, :2].tolist())
        for zone in zones[box] or ()
        if ORIENTATIONS.index(zone.orientation) == number
    ]
    return BinPlaces(
        ground.shapes // np.array([1, 1, step, step, 1]),
        landings(ground.size, ground.height, step, ground.shapes, stop), low, weak,
        np.array(refused, np.int64).reshape(-1, 4),
        PlacedTops(ground.height, rule.tolerance, rule.needed),
        RefusalRange(float(REFUSED_RADIUS_MM), step),
        weights._replace(position=weights.position * step),
        tuple(bool(refused_ones) for refused_ones in zones),
    )  # fmt: skip


def list_options(
    places: BinPlaces, limit: int, boxes: Sequence[Box], caps: NDArray[np.float64], stop: Flags
) -> BoxOptions:
    """All options in one bin of height ``limit`` that may cost less than the caps of the boxes.

    What leans on nothing that is an option itself is left out. Not complete when ``stop`` is
    raised.
    """
    plain = [
        not any(box.com_offset_mm) and not barred
        for box, barred in zip(boxes, places.barred, strict=True)
    ]
    faces = _faces(places.shapes, plain)
    tops = np.unique(places.tops.height)
    heights = [
        {int(dz) for which, _, _, _, dz in places.shapes.tolist() if which == i}
        for i in range(len(boxes))
    ]
    bases = np.stack([
        _sums(tops, [own for k, own in enumerate(heights) if k != i], limit)
        for i in range(len(boxes))
    ])  # fmt: skip
    levels = np.flatnonzero(bases.any(axis=0))
    row, by_x, by_y = list_rows(
        faces, places.shapes, places.land, places.low, places.weak, places.tops, places.weights,
        caps, levels, limit, np.ascontiguousarray(bases[:, levels]), stop,
    )  # fmt: skip
    if stop[0]:  # what follows takes its time too
        row, by_x, by_y = row[:0], by_x[:0], by_y[:0]
    first = np.ones(len(row), np.bool_)
    first[1:] = (row[1:, :3] != row[:-1, :3]).any(axis=1)
    starts = np.flatnonzero(first)
    rows = np.stack([starts, np.append(starts, len(row))[1:] - 1], axis=1)
    shape = places.shapes[row[starts, 3]]
    flat = places.weights.height * (row[starts, 1] + shape[:, 4]) + places.weights.bin_index
    nearest = (by_x + np.arange(by_x.shape[1], dtype=np.int16)).min(axis=1, initial=2 * FAR - 1)
    size = np.stack([shape[:, 2:4].min(axis=1), shape[:, 2:4].max(axis=1), shape[:, 4]], axis=1)
    options = BoxOptions(
        np.ascontiguousarray(shape[:, 0]), row[starts, 1], row[starts, 1] + shape[:, 4],
        row[starts, 2] == 1, size,
        flat + places.weights.position * nearest[rows].min(axis=1), flat, rows, row, by_x, by_y,
    )  # fmt: skip
    return _with_holders(options, places.tops, stop)


def _faces(shapes: Ints, plain: Sequence[bool]) -> Ints:
    """Shapes that differ in the turn about the vertical alone, (faces, 2); -1 without another.

    Of a ``plain`` box any orientation that takes the same space will do.
    """
    alike: dict[tuple[int, ...], list[int]] = {}
    for s, (box, number, wide, deep, dz) in enumerate(shapes.tolist()):
        key = (box, min(wide, deep), max(wide, deep), dz, -1 if plain[box] else number)
        turns = alike.setdefault(key, [])
        if all(shapes[o, 2] != wide for o in turns):
            turns.append(s)
    faces = [(*turns, -1)[:2] for _, turns in sorted(alike.items())]
    return np.array(faces, np.int64).reshape(-1, 2)


def _sums(tops: NDArray[np.int32], heights: Sequence[set[int]], limit: int) -> Flags:
    """Which bases one box, or several in a stack, on a placed top or the floor can give."""
    possible = np.zeros(limit + 1, np.bool_)
    possible[tops[tops <= limit]] = possible[0] = True
    for own in heights:
        before = possible.copy()
        for dz in own:
            if dz <= limit:
                possible[dz:] |= before[: limit + 1 - dz]
    return possible


def level_with_placed(base: Ints, tops: PlacedTops) -> Flags:
    """Whether a placed top is level with each base, within the tolerance."""
    bases, number = np.unique(base, return_inverse=True)
    gap = bases[:, None] - np.unique(tops.height[tops.height > 0])[None, :]
    level = np.asarray(((gap >= 0) & (gap <= tops.tolerance)).any(axis=1))
    return level[number.ravel()]


def corners_needed(tops: PlacedTops) -> int:
    """How many corners of a box that leans must be held; one where the rules ask for none."""
    return max(tops.needed, 1)


def holding(options: BoxOptions, tops: PlacedTops, stop: Flags) -> Corners:
    """How many corners of one option another one under it may hold at most, [upper, lower].

    All that are needed where a placed top is level with the base, since that may hold the others.
    """
    corners: Corners = _corners(
        options.box, options.base, options.top, options.leans,
        level_with_placed(options.base, tops), options.size, tops.tolerance,
        corners_needed(tops), stop,
    )  # fmt: skip
    return corners


@compiled
def _corners_on(o, h, size):  # type: ignore[no-untyped-def]
    """How many corners of a base one box can hold; two need an edge that is no longer than its."""
    if size[o, 0] <= size[h, 0] and size[o, 1] <= size[h, 1]:
        return 4
    return 2 if size[o, 0] <= size[h, 1] else 1


@entry
def _corners(box, base, top, leans, level, size, tolerance, needed, stop):  # type: ignore[no-untyped-def]
    """See :func:`holding`."""
    count = len(box)
    corners = np.zeros((count, count), np.int8)
    for o in range(count):
        if stop[0]:
            break
        if not leans[o]:
            continue
        for h in range(count):
            if box[h] != box[o] and 0 <= base[o] - top[h] <= tolerance:
                most = _corners_on(o, h, size)
                corners[o, h] = max(most, needed) if level[o] else most
    return corners


@entry
def _held_up(  # type: ignore[no-untyped-def]
    box, base, leans, level, size, by_top, tops, tolerance, needed, left, stop
):
    """Strike off, in ``left``, options that lean on too little of what is left; whether any was.

    As :func:`holding` counts, without its table of all pairs: of long lists few options last.
    ``by_top`` are the options in the order of their ``tops``.
    """
    most = np.zeros(box.max() + 1, np.int64)
    struck = False
    for o in range(len(box)):
        if stop[0]:
            break
        if not left[o] or not leans[o]:
            continue
        most[:] = 0
        first = np.searchsorted(tops, base[o] - tolerance)
        total = 0
        for at in range(first, len(tops)):
            h = by_top[at]
            if tops[at] > base[o] or total >= needed:
                break
            if left[h] and box[h] != box[o]:
                corners = _corners_on(o, h, size)
                if level[o]:
                    corners = max(corners, needed)
                total += max(corners - most[box[h]], 0)
                most[box[h]] = max(corners, most[box[h]])
        if total < needed:
            left[o] = False
            struck = True
    return struck


def _with_holders(options: BoxOptions, tops: PlacedTops, stop: Flags) -> BoxOptions:
    """Without options that lean on too little."""
    if len(options.box) == 0:
        return options
    level, needed = level_with_placed(options.base, tops), corners_needed(tops)
    left, by_top = np.ones(len(options.box), np.bool_), np.argsort(options.top, kind='stable')
    while not stop[0] and _held_up(
        options.box, options.base, options.leans, level, options.size, by_top,
        options.top[by_top], tops.tolerance, needed, left, stop,
    ):  # fmt: skip
        pass
    return chosen(options, np.flatnonzero(left))


def chosen(options: BoxOptions, keep: Ints) -> BoxOptions:
    """Some of the options; the rows stay as they are."""
    return BoxOptions(
        options.box[keep], options.base[keep], options.top[keep], options.leans[keep],
        options.size[keep], options.cost[keep], options.flat[keep], options.rows[keep],
        options.row, options.by_x, options.by_y,
    )  # fmt: skip
