"""Constraints for efficient packing: a box touches something along x, and something along y.

Ojha et al., section III-A.1 (CEP): "whenever a new box is placed, two of its surfaces should either
be touching the already placed boxes (along the X-Y plane) or the walls of the bin"; their eq. (4)
and (5) count one contact along x and one along y. As these equations have it, a contact is where
the face of a box and the opposite face of another in the same bin lie in one plane, whether or not
they share area; on the grid, less than one step apart, since no box can come nearer.

Why looking at few positions is exact: contact along x with a given face holds at one grid position
only, so every placement that touches both ways has its x beside a wall or a face, and its y too.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_msgs_py.values import Int3, PlacedBox
from pack_planner.engine.height_map import BinModel
from pack_planner.engine.search import _better, _spans, in_zone
from pack_planner.engine.support import resting_vertices, well_supported

Ints = NDArray[np.int64]


def touches(
    placed: PlacedBox, others: Iterable[PlacedBox], bin_size: Int3, step: int
) -> tuple[bool, bool]:
    """Whether ``placed`` touches a wall or a box along x, and along y; plain and slow.

    Lengths are millimetres in the bin frame; ``step`` is the grid of x and y.
    """
    contacts = [False, False]
    for axis in (0, 1):
        low, high = placed.corner_mm[axis], placed.far_mm[axis]
        if low < step or bin_size[axis] - high < step:
            contacts[axis] = True
        for other in others:
            after, before = low - other.far_mm[axis], other.corner_mm[axis] - high
            if 0 <= after < step or 0 <= before < step:
                contacts[axis] = True
    return contacts[0], contacts[1]


@lru_cache(maxsize=64)
def solids(model: BinModel) -> Ints:
    """Boxes of a bin as rows (x0, y0, z0, x1, y1, z1), int64 (n, 6), millimetres."""
    rows = [(*placed.corner_mm, *placed.far_mm) for placed in model.source.boxes]
    return np.array(rows, np.int64).reshape(-1, 6)


@njit(cache=True, nogil=True)
def touching(bodies, bin_size, corner, size, step):  # type: ignore[no-untyped-def]
    """:func:`touches`, both ways at once, on the rows of :func:`solids`."""
    x0, y0 = corner[0], corner[1]
    x1, y1 = x0 + size[0], y0 + size[1]
    along_x = x0 < step or bin_size[0] - x1 < step
    along_y = y0 < step or bin_size[1] - y1 < step
    for index in range(len(bodies)):
        if along_x and along_y:
            return True
        body = bodies[index]
        if 0 <= x0 - body[3] < step or 0 <= body[0] - x1 < step:
            along_x = True
        if 0 <= y0 - body[4] < step or 0 <= body[1] - y1 < step:
            along_y = True
    return along_x and along_y


@njit(cache=True, nogil=True)
def _beside(bodies, axis, extent, step, limit):  # type: ignore[no-untyped-def]
    """Grid positions along ``axis`` where a box of ``extent`` may touch a wall or a face."""
    positions = np.empty(2 * len(bodies) + 2, np.int64)
    positions[0], positions[1] = 0, limit
    size = 2
    for index in range(len(bodies)):
        after = -(-bodies[index, axis + 3] // step) * step
        before = bodies[index, axis] // step * step - extent
        for position in (after, before):
            if 0 < position < limit:
                positions[size] = position
                size += 1
    return np.unique(positions[:size])


@njit(cache=True, nogil=True)
def search_touching(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, sizes, turns, centres, sures, force, zones, radius, weights, bound, bodies,
):  # fmt: skip
    """As :func:`pack_planner.engine.search.search_bin`, among placements that touch both ways.

    Parameters
    ----------
    bin_size to bound : as there.
    bodies : the rows of :func:`solids`.
    """
    step, tolerance = rule[0], rule[1]
    best = np.array([bound, -1.0, -1.0, -1.0, -1.0])
    highest = np.empty(len(rows), height.dtype)
    for k in range(len(sizes)):
        dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
        if dx > bin_size[0] or dy > bin_size[1] or dz > bin_size[2]:
            continue
        turn = turns[k]
        xs = _beside(bodies, 0, dx, step, (bin_size[0] - dx) // step * step)
        ys = _beside(bodies, 1, dy, step, (bin_size[1] - dy) // step * step)
        span_x = _spans(xs, dx, step, columns)
        span_y = _spans(ys, dy, step, rows)
        for i in range(len(xs)):
            x = xs[i]
            if weights[0] * x + weights[1] * dz + weights[2] > best[0]:
                break
            left, right, end_x = span_x[i, 0], span_x[i, 1], span_x[i, 2]
            highest[:] = 0
            for column in range(left, end_x):
                for row in range(len(rows) - 1):
                    highest[row] = max(highest[row], height[column, row])
            for j in range(len(ys)):
                y = ys[j]
                if weights[0] * (x + y) + weights[1] * dz + weights[2] > best[0]:
                    break
                front, back, end_y = span_y[j, 0], span_y[j, 1], span_y[j, 2]
                z = 0
                for row in range(front, end_y):
                    z = max(z, highest[row])
                if z + dz > bin_size[2]:
                    continue
                objective = weights[0] * (x + y) + weights[1] * (z + dz) + weights[2]
                if not _better(objective, z, y, x, turn, best):
                    continue
                if in_zone(zones, radius, turn, x, y, z):
                    continue
                if not touching(bodies, bin_size, (x, y, z), (dx, dy, dz), step):
                    continue
                if z > 0:
                    resting = resting_vertices(
                        boxes, owner, left, right, front, back, x, y, dx, dy, step, z, tolerance
                    )
                    if resting < min_vertices or not well_supported(
                        boxes, bearing, (x, y, x, y), (dx, dy, dz), z, rule, centres[k], sures[k],
                        force, slack, passed_on,
                    ):  # fmt: skip
                        continue
                best[0], best[1], best[2], best[3], best[4] = objective, z, y, x, turn
    return best
