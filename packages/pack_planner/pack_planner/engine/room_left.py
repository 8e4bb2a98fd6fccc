"""Compiled: for which boxes a bin still has any place at all."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pack_planner.engine.placements import _with_far_ends
from pack_planner.engine.search import _spans, candidate_lines
from pack_planner.engine.support import resting_vertices, well_supported


@njit(cache=True, nogil=True)
def has_room(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, sizes, centres, sures, starts, forces,
):  # fmt: skip
    """Whether the bin has an allowed place for each box on its own, bool (len(starts) - 1,).

    All positions are looked at that :func:`pack_planner.engine.placements.all_spots` knows with
    ``far_ends``, until one is allowed.

    Parameters
    ----------
    bin_size to min_vertices : as of :func:`pack_planner.engine.search.search_bin`.
    sizes, centres, sures : of every orientation of all boxes, box after box.
    starts, forces : where the orientations of each box begin in these, and its weight, newtons.
    """
    step, tolerance, com_margin, min_share, stability = rule
    varies = max(com_margin, stability) > -math.inf or min_share > 0.0 or len(slack) > 0
    found = np.zeros(len(starts) - 1, np.bool_)
    highest = np.empty(len(rows), height.dtype)
    length, breadth, limit = bin_size
    lowest = height.min()
    for box in range(len(found)):
        for k in range(starts[box], starts[box + 1]):
            dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
            if dx > length or dy > breadth or lowest + dz > limit:
                continue
            limit_x, limit_y = (length - dx) // step * step, (breadth - dy) // step * step
            nothing = np.empty(0, np.int64)
            xs = candidate_lines(lines_x, dx, step, limit_x, nothing)
            ys = candidate_lines(lines_y, dy, step, limit_y, nothing)
            if varies:
                xs = _with_far_ends(xs, step, limit_x)
                ys = _with_far_ends(ys, step, limit_y)
            span_x, span_y = _spans(xs, dx, step, columns), _spans(ys, dy, step, rows)
            for i in range(len(xs)):
                left, right, end_x = span_x[i, 0], span_x[i, 1], span_x[i, 2]
                highest[:] = 0
                for column in range(left, end_x):
                    for row in range(len(rows) - 1):
                        highest[row] = max(highest[row], height[column, row])
                for j in range(len(ys)):
                    front, back, end_y = span_y[j, 0], span_y[j, 1], span_y[j, 2]
                    z = 0
                    for row in range(front, end_y):
                        z = max(z, highest[row])
                    if z + dz > limit:
                        continue
                    x, y = xs[i], ys[j]
                    if z > 0:
                        resting = resting_vertices(
                            boxes, owner, left, right, front, back, x, y, dx, dy, step, z,
                            tolerance,
                        )  # fmt: skip
                        if resting < min_vertices:
                            continue
                        if varies and not well_supported(
                            boxes, bearing, (x, y, x, y), (dx, dy, dz), z, rule, centres[k],
                            sures[k], forces[box], slack, passed_on,
                        ):  # fmt: skip
                            continue
                    found[box] = True
                    break
                if found[box]:
                    break
            if found[box]:
                break
    return found
