"""Compiled support rules: corner cells, support polygon, supported share, loads.

These are the rules of :mod:`pack_msgs_py.rules` once more, written independently for speed; tests
hold the two together. Lengths are integer millimetres in the bin frame. A box is a row
``(x0, y0, x1, y1, top)``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pack_planner.engine.bearing import carrying_points, hull_margin

EDGE_TOLERANCE_MM = 1e-6
#: Half of what the rules forgive, since polygons are snapped to a micrometre.
STABILITY_TOLERANCE_MM = 0.005
SHARE_TOLERANCE = 1e-9
LOAD_TOLERANCE_N = 1e-6


@njit(cache=True, nogil=True)
def cell_rests(boxes, guess, x, y, step, z, tolerance):  # type: ignore[no-untyped-def]
    """Whether the resolution cell at (x, y) lies wholly on one top between z - tolerance and z.

    Parameters
    ----------
    boxes : int64 (n, 5), x0, y0, x1, y1, top of each placed box.
    guess : number of the topmost box there, or -1. On the grid it settles the question; a box that
        another profile placed off the grid may need a look at all of them.
    x, y, z : corner of the cell nearest the origin, millimetres.
    step, tolerance : width of a cell, and how far below z a top may lie, millimetres.
    """
    if guess < 0:
        return False
    low = z - tolerance
    box = boxes[guess]
    if box[4] < low:
        return False
    if box[0] <= x and box[1] <= y and x + step <= box[2] and y + step <= box[3]:
        return True
    for index in range(len(boxes)):
        box = boxes[index]
        if (
            low <= box[4] <= z
            and box[0] <= x
            and box[1] <= y
            and x + step <= box[2]
            and y + step <= box[3]
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def resting_vertices(  # type: ignore[no-untyped-def]
    boxes, owner, left, right, front, back, x, y, dx, dy, step, z, tolerance
):
    """How many of the four base vertices of a box rest, by their corner cells.

    Parameters
    ----------
    boxes, step, tolerance : as of :func:`cell_rests`.
    owner : numbers of the topmost boxes of the height map, -1 for the floor.
    left, right, front, back : strips of the height map that hold the cells.
    x, y, z : corner of the box, millimetres.
    dx, dy : its size.
    """
    far_x, far_y = x + dx - step, y + dy - step
    return (
        int(cell_rests(boxes, owner[left, front], x, y, step, z, tolerance))
        + int(cell_rests(boxes, owner[right, front], far_x, y, step, z, tolerance))
        + int(cell_rests(boxes, owner[left, back], x, far_y, step, z, tolerance))
        + int(cell_rests(boxes, owner[right, back], far_x, far_y, step, z, tolerance))
    )


@njit(cache=True, nogil=True)
def well_supported(  # type: ignore[no-untyped-def]
    boxes, bearing, area, size, z, rule, com, sure, force, slack, passed_on
):
    """Whether any base corner in ``area`` = (x0, y0, x1, y1) can obey the continuous rules.

    For a single position (x0 == x1, y0 == y1) this is exact: centre of mass within the support
    polygon by ``com_margin`` and within the bearing polygon by ``stability``, contact share at
    least ``min_share``, no top overloaded. ``rule`` is (step, tolerance, com_margin, min_share,
    stability), ``bearing`` the bearing polygons (corners, starts), ``com`` and ``sure`` the centre
    of mass offset and what the box surely covers, relative to its base corner. For a range
    it is optimistic, so False proves that no position in it will do: each contact rectangle is
    taken as large as it becomes anywhere in the range, and loads as light.

    The range must lie within one cell between candidate lines, where the supporters are the same
    everywhere and each contact edge is either fixed or moves with the box.

    Parameters
    ----------
    boxes, tolerance : as of :func:`cell_rests`.
    area : the range of the corner, millimetres.
    size, z : of the box, and the height of its base.
    com : offset of its centre of mass from the middle of the base, x and y.
    com_margin, min_share : least distance from the edge of the support polygon, -inf for any; least
        share of the base that rests.
    force, slack, passed_on : as of :func:`pack_planner.engine.search.search_bin`.
    """
    _, tolerance, com_margin, min_share, stability = rule
    x0, y0, x1, y1 = area
    dx, dy, _ = size
    count = 0
    contact = 0.0
    px = np.empty(4 * len(boxes))
    py = np.empty(4 * len(boxes))
    below = np.empty(len(boxes), np.int64)
    least = np.empty(len(boxes))
    most = np.empty(len(boxes))
    supporters = 0
    for index in range(len(boxes)):
        box = boxes[index]
        if not z - tolerance <= box[4] <= z:
            continue
        left, right = max(box[0] - x1, 0), min(box[2] - x0, dx)
        front, back = max(box[1] - y1, 0), min(box[3] - y0, dy)
        if left >= right or front >= back:
            continue
        wide_0 = min(box[2] - x0, dx) - max(box[0] - x0, 0)
        wide_1 = min(box[2] - x1, dx) - max(box[0] - x1, 0)
        deep_0 = min(box[3] - y0, dy) - max(box[1] - y0, 0)
        deep_1 = min(box[3] - y1, dy) - max(box[1] - y1, 0)
        below[supporters] = index
        least[supporters] = float(max(min(wide_0, wide_1), 0)) * max(min(deep_0, deep_1), 0)
        most[supporters] = float(max(wide_0, wide_1)) * max(deep_0, deep_1)
        contact += most[supporters]
        supporters += 1
        for corner in range(4):
            px[count] = left if corner % 2 == 0 else right
            py[count] = front if corner < 2 else back
            count += 1
    if contact / (float(dx) * dy) < min_share - SHARE_TOLERANCE:
        return False
    if com_margin > -math.inf:
        margin = hull_margin(px, py, count, dx / 2 + com[0], dy / 2 + com[1])
        if margin < com_margin - EDGE_TOLERANCE_MM:
            return False
    if stability > -math.inf:
        if sure[0] >= sure[2] or sure[1] >= sure[3]:
            return False
        bx, by, count = carrying_points(
            boxes, bearing[0], bearing[1], area, size, z, tolerance, sure
        )
        margin = hull_margin(bx, by, count, dx / 2 + com[0], dy / 2 + com[1])
        if margin < stability - STABILITY_TOLERANCE_MM:
            return False
    for limited in range(len(slack)):
        if slack[limited] == math.inf:
            continue
        arriving = 0.0
        for i in range(supporters):
            arriving += least[i] * passed_on[below[i], limited]
        if contact > 0 and force * arriving / contact > slack[limited] + LOAD_TOLERANCE_N:
            return False
    return True
