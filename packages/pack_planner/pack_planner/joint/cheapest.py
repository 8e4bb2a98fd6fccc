"""Compiled: the cheapest entry of one box that a node of the joint search still allows."""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.engine.support import well_supported

_BIN, _X, _Y, _DX, _DY, _DZ, _KIND, _TURN = 0, 1, 2, 4, 5, 6, 7, 8


@njit(cache=True, nogil=True)
def rests_on(  # type: ignore[no-untyped-def]
    entry, z, centre, others, count, boxes, first, last, heights, bin_size, rule, min_vertices
):
    """Whether a box at ``entry``, base at ``z``, is supported by placed boxes and ``others``.

    ``others`` are rows (bin, x0, y0, z0, x1, y1, z1); ``boxes[first:last]`` the placed ones of the
    bin. Loads are left to the caller.
    """
    step, tolerance, com_margin, min_share = rule
    if z == 0:
        return True
    number, x0, y0 = entry[0], entry[1], entry[2]
    x1, y1 = x0 + entry[4], y0 + entry[5]
    low = z - tolerance
    resting = 0
    highest = -1
    for corner in range(4):
        cx = x0 if corner % 2 == 0 else x1 - step
        cy = y0 if corner < 2 else y1 - step
        top = heights[number, cx // step, cy // step]
        good = low <= top <= z
        for k in range(count):
            other = others[k]
            if (
                not good
                and other[0] == number
                and low <= other[6] <= z
                and other[1] <= cx
                and other[2] <= cy
                and cx + step <= other[4]
                and cy + step <= other[5]
            ):
                good = True
        resting += int(good)
    if resting < min_vertices:
        return False
    if tolerance == 0 and com_margin == -np.inf and min_share <= 0.0:
        return True
    under = np.empty((last - first + count, 5), np.int64)
    size = 0
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
def _overlaps(entry, z, volume):  # type: ignore[no-untyped-def]
    return (
        entry[0] == volume[0]
        and entry[1] < volume[4]
        and volume[1] < entry[1] + entry[4]
        and entry[2] < volume[5]
        and volume[2] < entry[2] + entry[5]
        and z < volume[6]
        and volume[3] < z + entry[6]
    )


@njit(cache=True, nogil=True)
def lowest_free(entry, z, ceiling, avoid, count, zones, radius):  # type: ignore[no-untyped-def]
    """Least height from ``z`` at which the box meets no volume of ``avoid`` and no refused zone.

    -1 when that is above ``ceiling``.
    """
    moved = True
    while moved:
        moved = False
        if z > ceiling:
            return -1
        for k in range(count):
            if _overlaps(entry, z, avoid[k]):
                z = avoid[k, 6]
                moved = True
        if len(zones) > 0:
            for k in range(len(zones)):
                zone = zones[k]
                if (
                    zone[0] == entry[0]
                    and zone[1] == entry[8]
                    and zone[4] == z
                    and abs(entry[1] - zone[2]) < radius
                    and abs(entry[2] - zone[3]) < radius
                ):
                    z += 1
                    moved = True
    return z


@njit(cache=True, nogil=True)
def _standing(  # type: ignore[no-untyped-def]
    entry, low, ceiling, centre, fixed, count, avoid, avoided, zones, radius,
    boxes, first, last, heights, bin_size, rule, min_vertices,
):  # fmt: skip
    """Least height at which the box stands on placed boxes and ``fixed``; -1 if it does not."""
    least = -1
    for k in range(count):
        z = fixed[k, 6]
        if (
            fixed[k, 0] != entry[0]
            or fixed[k, 1] >= entry[1] + entry[4]
            or entry[1] >= fixed[k, 4]
            or fixed[k, 2] >= entry[2] + entry[5]
            or entry[2] >= fixed[k, 5]
        ):
            continue
        # within the tolerance the base may lie above a fixed top, on a placed one
        for height in (z, entry[3]):
            if height < z or height - z > rule[1] or height < low or height > ceiling:
                continue
            if least >= 0 and height >= least:
                continue
            if lowest_free(entry, height, height, avoid, avoided, zones, radius) != height:
                continue
            if rests_on(
                entry, height, centre, fixed, count, boxes, first, last, heights, bin_size, rule,
                min_vertices,
            ):  # fmt: skip
                least = height
    return least


@njit(cache=True, nogil=True)
def next_height(  # type: ignore[no-untyped-def]
    entry, centre, least_z, alone, fixed, on, leaning_only, avoid, avoided, zones, radius,
    boxes, spans, heights, bin_sizes, rule, min_vertices,
):  # fmt: skip
    """Height at which a node allows ``entry``, -1 if it does not.

    Parameters
    ----------
    least_z : no lower than this.
    alone : how many of ``fixed`` it may rest on besides placed boxes; -1 if it may lean.
    on : row of ``fixed`` on which it must rest, or -1.
    leaning_only : only what does not stand on the placed boxes alone.
    avoid : the first ``avoided`` rows are volumes it must not meet.
    """
    number = entry[0]
    ceiling = bin_sizes[number, 2] - entry[6]
    if entry[7] == 0:
        if leaning_only or entry[3] < least_z:
            return -1
        return lowest_free(entry, entry[3], entry[3], avoid, avoided, zones, radius)
    low = max(np.int64(entry[3]), least_z)
    if on >= 0:
        below = fixed[on]
        if (
            below[0] != number
            or below[1] >= entry[1] + entry[4]
            or entry[1] >= below[4]
            or below[2] >= entry[2] + entry[5]
            or entry[2] >= below[5]
        ):
            return -1
        low = max(low, below[6])
        ceiling = min(ceiling, below[6] + rule[1])
        if low > ceiling:
            return -1
    if alone < 0:
        return lowest_free(entry, low, ceiling, avoid, avoided, zones, radius)
    if alone == 0:
        return -1
    return _standing(
        entry, low, ceiling, centre, fixed, alone, avoid, avoided, zones, radius,
        boxes, spans[number], spans[number + 1], heights, bin_sizes[number], rule, min_vertices,
    )  # fmt: skip
