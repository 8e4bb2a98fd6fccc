"""Compiled: whether a node of the joint search allows an entry."""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.engine.support import well_supported


@njit(cache=True, nogil=True)
def rests_on(  # type: ignore[no-untyped-def]
    entry, centre, others, count, boxes, first, last, heights, rule, min_vertices
):
    """Whether a box at ``entry`` is supported by placed boxes and the first ``count`` ``others``.

    ``others`` are rows (bin, x0, y0, z0, x1, y1, z1); ``boxes[first:last]`` the placed ones of the
    bin. Loads are left to the caller.
    """
    step, tolerance, com_margin, min_share = rule
    number, x0, y0, z = entry[0], entry[1], entry[2], entry[3]
    if z == 0:
        return True
    x1, y1 = x0 + entry[4], y0 + entry[5]
    low = z - tolerance
    resting = 0
    for corner in range(4):
        cx = x0 if corner % 2 == 0 else x1 - step
        cy = y0 if corner < 2 else y1 - step
        good = low <= heights[number, cx // step, cy // step] <= z
        for k in range(count):
            if good:
                break
            other = others[k]
            good = (
                other[0] == number
                and low <= other[6] <= z
                and other[1] <= cx
                and other[2] <= cy
                and cx + step <= other[4]
                and cy + step <= other[5]
            )
        resting += int(good)
    if resting < min_vertices:
        return False
    if tolerance == 0 and com_margin == -np.inf and min_share <= 0.0:
        return True
    under = np.empty((last - first + count, 5), np.int64)
    size = 0
    highest = -1
    for index in range(first, last + count):
        if index < last:
            box = boxes[index]
            a, b, c, d, top = box[0], box[1], box[2], box[3], box[4]
        else:
            other = others[index - last]
            if other[0] != number:
                continue
            a, b, c, d, top = other[1], other[2], other[4], other[5], other[6]
        if low <= top <= z and a < x1 and x0 < c and b < y1 and y0 < d:
            under[size, 0], under[size, 1], under[size, 2] = a, b, c
            under[size, 3], under[size, 4] = d, top
            size += 1
            highest = max(highest, top)
    # a box is planned where it touches: the highest top under it is its base
    if highest != z:
        return False
    return well_supported(
        under[:size], (x0, y0, x0, y0), (entry[4], entry[5], entry[6]), z, tolerance, centre,
        com_margin, min_share, 0.0, np.empty(0), np.empty((0, 0)),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def overlaps(entry, volume):  # type: ignore[no-untyped-def]
    """Whether a box at ``entry`` shares space with ``volume`` = (bin, x0, y0, z0, x1, y1, z1)."""
    return (
        entry[1] < volume[4]
        and volume[1] < entry[1] + entry[4]
        and entry[2] < volume[5]
        and volume[2] < entry[2] + entry[5]
        and entry[3] < volume[6]
        and volume[3] < entry[3] + entry[6]
        and entry[0] == volume[0]
    )


@njit(cache=True, nogil=True)
def lies_on(entry, volume, tolerance):  # type: ignore[no-untyped-def]
    """Whether a box at ``entry`` lies on the top of ``volume``, at most ``tolerance`` above it."""
    return (
        0 <= entry[3] - volume[6] <= tolerance
        and entry[1] < volume[4]
        and volume[1] < entry[1] + entry[4]
        and entry[2] < volume[5]
        and volume[2] < entry[2] + entry[5]
        and entry[0] == volume[0]
    )


@njit(cache=True, nogil=True)
def allowed(  # type: ignore[no-untyped-def]
    entry, centre, alone, fixed, on, avoid, avoided,
    boxes, spans, heights, rule, min_vertices,
):  # fmt: skip
    """Whether a node allows ``entry``.

    Parameters
    ----------
    alone : how many of ``fixed`` it may rest on besides placed boxes; -1 if it may lean.
    on : row of ``fixed`` on which it must rest, or -1.
    avoid : the first ``avoided`` rows are volumes it must not meet.
    """
    leans = entry[7] == 1
    if leans:
        if alone == 0 or (on >= 0 and not lies_on(entry, fixed[on], rule[1])):
            return False
    elif on >= 0:
        return False
    for k in range(avoided):
        if overlaps(entry, avoid[k]):
            return False
    if leans and alone > 0:
        number = entry[0]
        return rests_on(
            entry, centre, fixed, alone, boxes, spans[number], spans[number + 1], heights, rule,
            min_vertices,
        )  # fmt: skip
    return True
