"""Compiled search: the exact argmin of eq. (1) of Ojha et al. for one box in one bin.

Why looking at few positions is exact. Slide a box of size (dx, dy) over the grid. Which boxes it
overlaps, and on which tops its four corner cells lie, changes along x only where an edge e of a
placed box passes the box's own left edge (x = e) or its right corner cell (x = e - dx + step), and
likewise along y. Between these lines the rest height and the number of supported vertices are
constant, so with non-negative weights the corner of such a cell nearest the origin is its best
position. The number of lines depends on the placed boxes alone, not on the resolution.

Centre of mass, supported share and load limits do vary inside a cell. Where its nearest corner
breaks one of them, the cell is searched by branch and bound with the optimistic test of
:func:`pack_planner.engine.support.well_supported`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.engine.support import resting_vertices, well_supported

#: Column numbers of a found position, as rows of floats.
OBJECTIVE, Z, Y, X, TURN = range(5)


@njit(cache=True, nogil=True)
def _better(objective, z, y, x, turn, best):  # type: ignore[no-untyped-def]
    """Whether this position comes before ``best``: objective, then z, y, x, orientation."""
    if objective != best[0]:
        return objective < best[0]
    if z != best[1]:
        return z < best[1]
    if y != best[2]:
        return y < best[2]
    if x != best[3]:
        return x < best[3]
    return turn < best[4]


@njit(cache=True, nogil=True)
def candidate_lines(lines, extent, step, limit, extra):  # type: ignore[no-untyped-def]
    """Sorted positions where something changes for a box of ``extent``, from 0 to ``limit``.

    ``lines`` are the edges of placed boxes on the grid, ``extra`` further lines (refused zones).
    """
    count = len(lines)
    positions = np.empty(2 * count + len(extra), np.int64)
    size, i, j = 0, 0, 0
    while i < count or j < count:
        if j >= count or (i < count and lines[i] <= lines[j] - extent + step):
            value = lines[i]
            i += 1
        else:
            value = lines[j] - extent + step
            j += 1
        if 0 <= value <= limit and (size == 0 or value != positions[size - 1]):
            positions[size] = value
            size += 1
    for value in extra:
        if 0 <= value <= limit:
            positions[size] = value
            size += 1
    if len(extra) > 0:
        return np.unique(positions[:size])
    return positions[:size]


@njit(cache=True, nogil=True)
def _spans(positions, extent, step, edges):  # type: ignore[no-untyped-def]
    """For each position: first strip, strip of the far corner cell, end strip."""
    spans = np.empty((len(positions), 3), np.int64)
    first, corner, end = 0, 0, 0
    for i in range(len(positions)):
        low = positions[i]
        while edges[first + 1] <= low:
            first += 1
        while edges[corner + 1] <= low + extent - step:
            corner += 1
        while edges[end] < low + extent:
            end += 1
        spans[i, 0] = first
        spans[i, 1] = corner
        spans[i, 2] = end
    return spans


@njit(cache=True, nogil=True)
def _zone_lines(zones, turn, axis, radius, step):  # type: ignore[no-untyped-def]
    """Grid lines where the refused zones of orientation ``turn`` begin and end along ``axis``."""
    lines = np.empty(2 * len(zones), np.int64)
    size = 0
    for zone in zones:
        if zone[0] == turn:
            lines[size] = (zone[1 + axis] - radius) // step * step + step
            lines[size + 1] = -(-(zone[1 + axis] + radius) // step) * step
            size += 2
    return lines[:size]


@njit(cache=True, nogil=True)
def in_zone(zones, radius, turn, x, y, z):  # type: ignore[no-untyped-def]
    """Whether (x, y, z) lies within ``radius`` of a refused position of this orientation.

    ``zones`` are int64 (n, 4), orientation number, x, y and z; ``turn`` is the orientation number.
    """
    for zone in zones:
        if (
            zone[0] == turn
            and zone[3] == z
            and abs(x - zone[1]) < radius
            and abs(y - zone[2]) < radius
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _search_cell(  # type: ignore[no-untyped-def]
    boxes, bearing, area, size, z, turn, rule, com, sure, force, slack, passed_on, weights, best
):
    """Best allowed position inside one cell by branch and bound; improves ``best`` in place."""
    step = rule[0]
    stack = [area]
    while len(stack) > 0:
        x0, y0, x1, y1 = stack.pop()
        objective = weights[0] * (x0 + y0) + weights[1] * (z + size[2]) + weights[2]
        if not _better(objective, z, y0, x0, turn, best):
            continue
        if well_supported(
            boxes, bearing, (x0, y0, x0, y0), size, z, rule, com, sure, force, slack, passed_on
        ):  # fmt: skip
            best[0], best[1], best[2], best[3], best[4] = objective, z, y0, x0, turn
            continue
        if x0 == x1 and y0 == y1:
            continue
        if not well_supported(
            boxes, bearing, (x0, y0, x1, y1), size, z, rule, com, sure, force, slack, passed_on
        ):  # fmt: skip
            continue
        if x1 - x0 >= y1 - y0:
            middle = x0 + (x1 - x0) // step // 2 * step
            stack.append((middle + step, y0, x1, y1))
            stack.append((x0, y0, middle, y1))
        else:
            middle = y0 + (y1 - y0) // step // 2 * step
            stack.append((x0, middle + step, x1, y1))
            stack.append((x0, y0, x1, middle))


@njit(cache=True, nogil=True)
def search_bin(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, sizes, turns, centres, sures, force, zones, radius, weights, bound,
):  # fmt: skip
    """Best position of a box in one bin: (objective, z, y, x, orientation), z < 0 if there is none.

    Parameters
    ----------
    bin_size : (L, B, H).
    boxes : int64 (n, 5), x0, y0, x1, y1, top of each placed box.
    columns, rows, height, owner : the height map, see :mod:`pack_planner.engine.height_map`.
    lines_x, lines_y : edges of placed boxes on the grid.
    slack, passed_on : load each top can still take, and which part of a force on one top reaches
        another, newtons; empty when no box has a limit.
    bearing : bearing polygons of the placed boxes, see :mod:`pack_planner.engine.bearing`.
    rule : (step, tolerance, com_margin or -inf, min_share, stability margin or -inf).
    min_vertices : base vertices that must rest.
    sizes, turns, centres, sures : planned size, orientation number, centre of mass offset, and what
        is surely covered relative to the base corner, of each allowed orientation.
    force : weight of the box, newtons.
    zones, radius : refused positions (orientation, x, y, z), and how far around each is refused.
    weights : (w1, w2, value of the bin's index), per millimetre.
    bound : only a strictly smaller objective counts.
    """
    step, tolerance, com_margin, min_share, stability = rule
    varies = max(com_margin, stability) > -np.inf or min_share > 0.0 or len(slack) > 0
    best = np.array([bound, -1.0, -1.0, -1.0, -1.0])
    kept = 0
    cells = np.empty((64, 7), np.int64)
    keys = np.empty(64)
    highest = np.empty(len(rows), height.dtype)
    for k in range(len(sizes)):
        dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
        if dx > bin_size[0] or dy > bin_size[1] or dz > bin_size[2]:
            continue
        if weights[1] * dz + weights[2] > best[0]:
            continue
        turn = turns[k]
        limit_x = (bin_size[0] - dx) // step * step
        limit_y = (bin_size[1] - dy) // step * step
        xs = candidate_lines(lines_x, dx, step, limit_x, _zone_lines(zones, turn, 0, radius, step))
        ys = candidate_lines(lines_y, dy, step, limit_y, _zone_lines(zones, turn, 1, radius, step))
        span_x = _spans(xs, dx, step, columns)
        span_y = _spans(ys, dy, step, rows)
        for i in range(len(xs)):
            x = xs[i]
            if weights[0] * x + weights[1] * dz + weights[2] > best[0]:
                break
            left, right, end_x = span_x[i, 0], span_x[i, 1], span_x[i, 2]
            filled = False
            for j in range(len(ys)):
                y = ys[j]
                if weights[0] * (x + y) + weights[1] * dz + weights[2] > best[0]:
                    break
                front, back, end_y = span_y[j, 0], span_y[j, 1], span_y[j, 2]
                h00, h10 = height[left, front], height[right, front]
                h01, h11 = height[left, back], height[right, back]
                z = max(max(h00, h10), max(h01, h11))
                if z + dz > bin_size[2]:
                    continue
                if weights[0] * (x + y) + weights[1] * (z + dz) + weights[2] > best[0]:
                    continue
                if z > 0:
                    low = max(z - tolerance, 1)
                    resting = int(h00 >= low) + int(h10 >= low) + int(h01 >= low) + int(h11 >= low)
                    if resting < min_vertices:
                        continue
                if not filled:
                    highest[:] = 0
                    for column in range(left, end_x):
                        for row in range(len(rows) - 1):
                            highest[row] = max(highest[row], height[column, row])
                    filled = True
                for row in range(front, end_y):
                    z = max(z, highest[row])
                if z + dz > bin_size[2]:
                    continue
                objective = weights[0] * (x + y) + weights[1] * (z + dz) + weights[2]
                if not _better(objective, z, y, x, turn, best):
                    continue
                if in_zone(zones, radius, turn, x, y, z):
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
                        if kept == len(keys):
                            cells = np.concatenate((cells, np.empty_like(cells)))
                            keys = np.concatenate((keys, np.empty_like(keys)))
                        keys[kept] = objective
                        cells[kept, 0], cells[kept, 1] = x, y
                        cells[kept, 2] = xs[i + 1] - step if i + 1 < len(xs) else limit_x
                        cells[kept, 3] = ys[j + 1] - step if j + 1 < len(ys) else limit_y
                        cells[kept, 4], cells[kept, 5], cells[kept, 6] = z, k, turn
                        kept += 1
                        continue
                best[0], best[1], best[2], best[3], best[4] = objective, z, y, x, turn
    if kept > 0:
        order = np.argsort(keys[:kept])
        for index in order:
            if keys[index] > best[0]:
                break
            cell = cells[index]
            z, k, turn = cell[4], cell[5], cell[6]
            _search_cell(
                boxes, bearing, (cell[0], cell[1], cell[2], cell[3]),
                (sizes[k, 0], sizes[k, 1], sizes[k, 2]), z, turn, rule,
                centres[k], sures[k], force, slack, passed_on, weights, best,
            )  # fmt: skip
    return best
