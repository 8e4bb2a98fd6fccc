"""Compiled bearing polygons: where each box may be loaded without tipping anything below it.

The rule of :mod:`pack_msgs_py.statics` once more, written independently for speed; tests hold the
two together. The polygons of a bin stand one after another in ``corners`` (m, 2), float64
millimetres in the bin frame, counter-clockwise; those of box ``i`` are rows ``starts[i]`` to
``starts[i + 1]``, none where nothing carries it surely.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Polygons lie on a grid of a micrometre, so that no edge is so short that its direction is noise.
SNAPS_PER_MM = 1000.0
#: What is shared is no contact when it has less than this, square millimetres.
LEAST_AREA_MM2 = 1e-3


@njit(cache=True, nogil=True)
def convex_hull(px, py, count):  # type: ignore[no-untyped-def]
    """Corners (x, y) of the hull of ``count`` points, counter-clockwise, and their number.

    Sorts the points in place; fewer than three when the hull has no area.
    """
    for i in range(1, count):
        x, y = px[i], py[i]
        j = i - 1
        while j >= 0 and (px[j] > x or (px[j] == x and py[j] > y)):
            px[j + 1] = px[j]
            py[j + 1] = py[j]
            j -= 1
        px[j + 1] = x
        py[j + 1] = y
    hull_x = np.empty(2 * count + 2)
    hull_y = np.empty(2 * count + 2)
    size = 0
    for sweep in range(2):
        start = size
        for step in range(count):
            i = step if sweep == 0 else count - 1 - step
            x, y = px[i], py[i]
            while (
                size >= start + 2
                and (hull_x[size - 1] - hull_x[size - 2]) * (y - hull_y[size - 2])
                - (hull_y[size - 1] - hull_y[size - 2]) * (x - hull_x[size - 2])
                <= 0
            ):
                size -= 1
            hull_x[size] = x
            hull_y[size] = y
            size += 1
        size -= 1
    return hull_x, hull_y, size


@njit(cache=True, nogil=True)
def hull_margin(px, py, count, cx, cy):  # type: ignore[no-untyped-def]
    """Distance of (cx, cy) from the boundary of the hull of ``count`` points, positive inside."""
    hull_x, hull_y, size = convex_hull(px, py, count)
    if size < 3:
        return -math.inf
    margin = math.inf
    for i in range(size):
        j = (i + 1) % size
        ex, ey = hull_x[j] - hull_x[i], hull_y[j] - hull_y[i]
        cross = ex * (cy - hull_y[i]) - ey * (cx - hull_x[i])
        margin = min(margin, cross / math.hypot(ex, ey))
    return margin


@njit(cache=True, nogil=True)
def _cut(px, py, count, along_x, limit, sign, qx, qy):  # type: ignore[no-untyped-def]
    """The part of a convex polygon on one side of a line (Sutherland, Hodgman 1974), into q."""
    size = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        a = sign * ((px[i] if along_x else py[i]) - limit)
        b = sign * ((px[j] if along_x else py[j]) - limit)
        if a >= 0:
            qx[size], qy[size] = px[i], py[i]
            size += 1
        if (a > 0 and b < 0) or (a < 0 and b > 0):
            share = a / (a - b)
            qx[size] = px[i] + share * (px[j] - px[i])
            qy[size] = py[i] + share * (py[j] - py[i])
            size += 1
    return size


@njit(cache=True, nogil=True)
def _clipped(px, py, count, rect):  # type: ignore[no-untyped-def]
    """The part of a convex polygon inside ``rect``, snapped; no corner where it is no contact."""
    ax, ay = np.empty(count + 8), np.empty(count + 8)
    bx, by = np.empty(count + 8), np.empty(count + 8)
    size = _cut(px, py, count, True, rect[0], 1.0, ax, ay)
    size = _cut(ax, ay, size, True, rect[2], -1.0, bx, by)
    size = _cut(bx, by, size, False, rect[1], 1.0, ax, ay)
    size = _cut(ax, ay, size, False, rect[3], -1.0, bx, by)
    area = 0.0
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        area += bx[i] * by[j] - bx[j] * by[i]
    if area / 2 < LEAST_AREA_MM2:
        return bx, by, 0
    for i in range(size):
        bx[i] = math.floor(bx[i] * SNAPS_PER_MM + 0.5) / SNAPS_PER_MM
        by[i] = math.floor(by[i] * SNAPS_PER_MM + 0.5) / SNAPS_PER_MM
    return bx, by, size


@njit(cache=True, nogil=True)
def carrying_points(boxes, corners, starts, area, size, z, tolerance, sure):  # type: ignore[no-untyped-def]
    """Corners of what carries a box with its base corner in ``area``, relative to that corner.

    For a single position that is exact. For a range (x0, y0, x1, y1) it is what any position in it
    can share with each bearing polygon, so that their hull holds that of every position.

    Parameters
    ----------
    boxes : int64 (n, 5), x0, y0, x1, y1, top of each placed box.
    corners, starts : bearing polygons of the placed boxes, see the module.
    area : where the base corner may lie.
    size : planned size of the box.
    z, tolerance : its base, and how far below that a top may lie.
    sure : what it surely covers, (x0, y0, x1, y1) relative to its base corner.
    """
    x0, y0, x1, y1 = area
    found_x = np.empty(len(corners) + 12 * len(boxes))
    found_y = np.empty(len(corners) + 12 * len(boxes))
    count = 0
    for index in range(len(boxes)):
        box = boxes[index]
        first, last = starts[index], starts[index + 1]
        if first == last or not z - tolerance <= box[4] <= z:
            continue
        if box[0] >= x1 + size[0] or box[2] <= x0 or box[1] >= y1 + size[1] or box[3] <= y0:
            continue
        number = last - first
        if x0 == x1 and y0 == y1:
            px, py = corners[first:last, 0] - x0, corners[first:last, 1] - y0
        else:
            spread_x, spread_y = np.empty(4 * number), np.empty(4 * number)
            for i in range(number):
                for shift in range(4):
                    spread_x[4 * i + shift] = corners[first + i, 0] - (x0 if shift % 2 else x1)
                    spread_y[4 * i + shift] = corners[first + i, 1] - (y0 if shift < 2 else y1)
            px, py, number = convex_hull(spread_x, spread_y, 4 * number)
        part_x, part_y, number = _clipped(px, py, number, sure)
        for i in range(number):
            found_x[count], found_y[count] = part_x[i], part_y[i]
            count += 1
    return found_x, found_y, count


@njit(cache=True, nogil=True)
def with_bearing(corners, starts, boxes, corner, size, tolerance, sure):  # type: ignore[no-untyped-def]
    """``corners`` and ``starts`` with the bearing polygon of one more box on ``boxes``.

    ``corner`` and ``size`` are its planned ones, ``sure`` what it surely covers relative to
    ``corner``.
    """
    x, y, z = corner
    px, py = np.empty(4), np.empty(4)
    count = 0
    if sure[0] < sure[2] and sure[1] < sure[3]:
        if z == 0:
            count = 4
            for i in range(4):
                px[i] = sure[0] if i % 2 == 0 else sure[2]
                py[i] = sure[1] if i < 2 else sure[3]
        else:
            px, py, count = carrying_points(
                boxes, corners, starts, (x, y, x, y), size, z, tolerance, sure
            )
    hull_x, hull_y, number = convex_hull(px, py, count)
    if number < 3:
        number = 0
    grown = np.empty((len(corners) + number, 2))
    grown[: len(corners)] = corners
    for i in range(number):
        grown[len(corners) + i, 0] = hull_x[i] + x
        grown[len(corners) + i, 1] = hull_y[i] + y
    ends = np.empty(len(starts) + 1, np.int64)
    ends[: len(starts)] = starts
    ends[len(starts)] = len(grown)
    return grown, ends
