"""Compiled check of one given placement on the boxes of one bin."""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.engine.support import resting_vertices, well_supported


@njit(cache=True, nogil=True)
def _strip(edges, position):  # type: ignore[no-untyped-def]
    """Number of the strip between ``edges`` that holds the space right after ``position``."""
    return np.searchsorted(edges, position, 'right') - 1


@njit(cache=True, nogil=True)
def stands_at(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, corner, size, centre, sure, force,
):  # fmt: skip
    """Whether a box of ``size`` rests at ``corner`` under every rule.

    Parameters
    ----------
    bin_size to min_vertices, force : as of :func:`pack_planner.engine.search.search_bin`.
    corner, size : (x, y, z) and (dx, dy, dz), millimetres.
    centre : offset of the centre of mass from the middle of the base, x and y, millimetres.
    sure : what the box surely covers, relative to ``corner``.
    """
    step, tolerance = rule[0], rule[1]
    x, y, z = corner
    dx, dy, dz = size
    if x + dx > bin_size[0] or y + dy > bin_size[1] or z + dz > bin_size[2]:
        return False
    left, front = _strip(columns, x), _strip(rows, y)
    right, back = _strip(columns, x + dx - step), _strip(rows, y + dy - step)
    top = 0
    for i in range(left, len(columns) - 1):
        if columns[i] >= x + dx:
            break
        for j in range(front, len(rows) - 1):
            if rows[j] >= y + dy:
                break
            top = max(top, height[i, j])
    if top != z:
        return False
    if z == 0:
        return True
    resting = resting_vertices(
        boxes, owner, left, right, front, back, x, y, dx, dy, step, z, tolerance
    )
    return resting >= min_vertices and well_supported(
        boxes, bearing, (x, y, x, y), size, z, rule, centre, sure, force, slack, passed_on
    )
