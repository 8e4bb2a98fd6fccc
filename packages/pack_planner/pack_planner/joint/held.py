"""Compiled: what a box costs at least within the ranges of a node, where its base can be held up.

A base needs corners on placed boxes or on other boxes of the group, wherever their ranges let them
be: optimistic, so that the least cost is a bound. Arrays as in :mod:`.relations`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.bounds import NEVER
from pack_planner.joint.branching import EITHER, HUGE, NOTHING, ON, PLACED


@njit(cache=True, nogil=True)
def _corners_held(i, t, x, y, z, problem, node):  # type: ignore[no-untyped-def]
    """Whether enough corners of box ``i``, turned ``t``, can be held up at (x, y, z)."""
    sizes, height = problem[2], problem[4]
    tolerance, needed = problem[9]
    lo, hi, may, corner, turn = node[0], node[1], node[4], node[5], node[6]
    held = 0
    for c in range(4):
        what = corner[i, c]
        if what == NOTHING:
            continue
        a = x if c % 2 == 0 else x + sizes[i, t, 0] - 1
        b = y if c < 2 else y + sizes[i, t, 1] - 1
        if what < NOTHING and height[a, b] > 0 and height[a, b] >= z - tolerance:
            held += 1
            continue
        if what == PLACED:
            return False
        good = False
        for k in range(len(sizes)):
            if k == i or not may[i, k] or (what >= ON and what - ON != k):
                continue
            dz = sizes[k, 0, 2]
            if z < lo[k, 2] + dz or z > hi[k, 2] + dz + tolerance:
                continue
            if a < lo[k, 0] or b < lo[k, 1]:
                continue
            if turn[k] == EITHER:
                wide = max(sizes[k, 0, 0], sizes[k, 1, 0])
                deep = max(sizes[k, 0, 1], sizes[k, 1, 1])
            else:
                wide, deep = sizes[k, turn[k], 0], sizes[k, turn[k], 1]
            if a < hi[k, 0] + wide and b < hi[k, 1] + deep:
                good = True
                break
        if good:
            held += 1
        elif what >= ON:
            return False
    return held >= needed


@njit(cache=True, nogil=True)
def _helped(i, t, x, y, z, problem, node):  # type: ignore[no-untyped-def]
    """Whether some other box of the group may lie under box ``i`` at (x, y, z)."""
    sizes = problem[2]
    tolerance = problem[9][0]
    lo, hi, may, turn = node[0], node[1], node[4], node[6]
    for k in range(len(sizes)):
        if k == i or not may[i, k]:
            continue
        dz = sizes[k, 0, 2]
        if z < lo[k, 2] + dz or z > hi[k, 2] + dz + tolerance:
            continue
        for other in range(2):
            if (
                turn[k] in (EITHER, other)
                and lo[k, 0] < x + sizes[i, t, 0]
                and lo[k, 1] < y + sizes[i, t, 1]
                and x < hi[k, 0] + sizes[k, other, 0]
                and y < hi[k, 1] + sizes[k, other, 1]
            ):
                return True
    return False


@njit(cache=True, nogil=True)
def _refused(i, t, x, y, z, problem):  # type: ignore[no-untyped-def]
    """Whether (x, y, z) is near a refused position of this box and turn."""
    zones, radius = problem[6], problem[11]
    for zone in zones:
        if (
            zone[0] == i
            and zone[1] == t
            and zone[4] == z
            and abs(x * radius[1] - zone[2]) < radius[0]
            and abs(y * radius[1] - zone[3]) < radius[0]
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _base(i, t, x, y, z, highest, problem, node):  # type: ignore[no-untyped-def]
    """The least base from ``z`` to ``highest`` that can be held up at (x, y), or ``NEVER``."""
    sizes, levels, weak = problem[2], problem[5], problem[12]
    lo, may = node[0], node[4]
    while z <= highest:
        best = NEVER
        if z == 0 or _corners_held(i, t, x, y, z, problem, node):
            best = z
        else:
            # what holds a corner begins at a top
            for k in range(len(sizes)):
                if k == i or not may[i, k]:
                    continue
                top = lo[k, 2] + sizes[k, 0, 2]
                if z < top < best and top <= highest:  # noqa: SIM102 - numba
                    if _corners_held(i, t, x, y, top, problem, node):
                        best = top
        if best == NEVER:
            return NEVER
        if not _refused(i, t, x, y, best, problem) and (
            len(weak) == 0 or weak[i, t, x, y] != best or _helped(i, t, x, y, best, problem, node)
        ):
            return best
        z = np.int64(levels[i, best + 1])
    return NEVER


@njit(cache=True, nogil=True)
def scan(i, problem, node, cap, found, area):  # type: ignore[no-untyped-def]
    """Cost of the cheapest place of box ``i`` below ``cap``, 1e18 if there is none.

    The place (x, y, z, turn) goes into ``found``, what bounds all places below ``cap`` into
    ``area`` (least and most x, y, z). A turn without a place is struck off. The least costs of the
    turns go into the node; 1e18 stands for none below ``cap``.
    """
    low, flat, turns, levels = problem[0][i], problem[1][i], problem[3][i], problem[5][i]
    w1, w2 = problem[10]
    turn = node[6]
    x0, y0, z0 = node[0][i]
    x1, y1, z1 = node[1][i]
    touch, beside = node[10][i], problem[7][i]
    least = node[11][i]
    best = HUGE
    area[0], area[2], area[4] = NEVER, NEVER, NEVER
    area[1], area[3], area[5] = -1, -1, -1
    possible = 0
    for t in range(turns):
        least[t] = HUGE
        if turn[i] != EITHER and turn[i] != t:
            continue
        some = False
        for x in range(x0, x1 + 1):
            if flat + w1 * (x + y0) + w2 * z0 >= cap:
                break
            if touch[0] == 1 and not beside[t, 0, x]:
                continue
            for y in range(y0, y1 + 1):
                here = flat + w1 * (x + y)
                if here + w2 * z0 >= cap:
                    break
                if low[t, x, y] > z1 or (touch[1] == 1 and not beside[t, 1, y]):
                    continue
                z = np.int64(levels[max(low[t, x, y], z0)])
                cost = here + w2 * z
                if z > z1 or cost >= cap:
                    continue
                if cost < least[t]:
                    z = _base(i, t, x, y, z, z1, problem, node)
                    cost = here + w2 * z
                    if z > z1 or cost >= cap:
                        continue
                    least[t] = min(least[t], cost)
                    if cost < best:
                        best = cost
                        found[0], found[1], found[2], found[3] = x, y, z, t
                some = True
                area[0], area[1] = min(area[0], x), max(area[1], x)
                area[2], area[3] = min(area[2], y), max(area[3], y)
                area[4] = min(area[4], z)
                if w2 > 0:
                    area[5] = max(area[5], np.int64((cap - here) / w2))
        if some:
            possible += 1 + t
    if w2 <= 0:
        area[5] = z1
    if turn[i] == EITHER and 0 < possible < 3:
        turn[i] = possible - 1
    return best


@njit(cache=True, nogil=True)
def least_cost(i, t, problem, node, window, cap):  # type: ignore[no-untyped-def]
    """The least that box ``i``, turned ``t``, costs in a window (x0, x1, y0, y1, z0, z1).

    ``cap`` if nothing there costs less.
    """
    low, flat, levels = problem[0][i, t], problem[1][i], problem[5][i]
    w1, w2 = problem[10]
    x0, x1, y0, y1, z0, z1 = window
    touch, beside = node[10][i], problem[7][i, t]
    best = cap
    for x in range(x0, x1 + 1):
        if flat + w1 * (x + y0) + w2 * z0 >= best:
            break
        if touch[0] == 1 and not beside[0, x]:
            continue
        for y in range(y0, y1 + 1):
            here = flat + w1 * (x + y)
            if here + w2 * z0 >= best:
                break
            if low[x, y] > z1 or (touch[1] == 1 and not beside[1, y]):
                continue
            z = np.int64(levels[max(low[x, y], z0)])
            if z > z1 or here + w2 * z >= best:
                continue
            z = _base(i, t, x, y, z, z1, problem, node)
            if z <= z1:
                best = min(best, here + w2 * z)
    return best
