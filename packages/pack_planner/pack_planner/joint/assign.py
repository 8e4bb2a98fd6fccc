"""Compiled: which bin and which face up for each box, bounded and listed.

An option is a bin and a face up of one box, in its one or two turns. What two boxes with given
options cost at least side by side or one above the other, and what that gives for all pairs, bounds
an assignment of options to all boxes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.bounds import NEVER
from pack_planner.joint.branching import EPS, HUGE
from pack_planner.joint.relations import matched


@njit(cache=True, nogil=True)
def extent(low, w1, w2, flat, cap, area):  # type: ignore[no-untyped-def]
    """The least cost below ``cap`` of a shape with bases ``low`` (cells, cells), else 1e18.

    ``area`` becomes what bounds all such places: least and most x, y (cells) and base.
    """
    best = HUGE
    area[0], area[2], area[4] = NEVER, NEVER, NEVER
    area[1], area[3], area[5] = -1, -1, -1
    for x in range(low.shape[0]):
        for y in range(low.shape[1]):
            z = low[x, y]
            cost = flat + w1 * (x + y) + w2 * z
            if z >= NEVER or cost >= cap:
                continue
            best = min(best, cost)
            area[0], area[1] = min(area[0], x), max(area[1], x)
            area[2], area[3] = min(area[2], y), max(area[3], y)
            area[4] = min(area[4], z)
            if w2 > 0:
                area[5] = max(area[5], np.int64(min((cap - cost) / w2, 1e6)) + z)
            else:
                area[5] = NEVER
    return best


@njit(cache=True, nogil=True)
def _least(low, w1, w2, flat, window, cap):  # type: ignore[no-untyped-def]
    x0, x1, y0, y1, z0, z1 = window
    best = cap
    for x in range(x0, x1 + 1):
        if flat + w1 * (x + y0) + w2 * z0 >= best:
            break
        for y in range(y0, y1 + 1):
            here = flat + w1 * (x + y)
            if here + w2 * z0 >= best:
                break
            z = max(low[x, y], z0)
            if z <= z1:
                best = min(best, here + w2 * z)
    return best


@njit(cache=True, nogil=True)
def pair_costs(low, shapes, areas, flat, box, weights, limits):  # type: ignore[no-untyped-def]
    """What two shapes in one bin cost at least together, (shapes, shapes).

    Parameters
    ----------
    low : bases of each shape, (shapes, cells, cells).
    shapes : size of each, cells, cells, millimetres.
    areas, flat : from and for :func:`extent`.
    box : whose shape it is.
    weights : w1 per cell, w2.
    limits : for two boxes, the most that matters; infinite costs stand for more.
    """
    w1, w2 = weights
    count = len(shapes)
    found = np.full((count, count), np.inf)
    one, two = np.empty(6, np.int64), np.empty(6, np.int64)
    for i in range(count):
        for k in range(i + 1, count):
            limit = limits[box[i], box[k]]
            if box[i] == box[k] or areas[i, 1] < 0 or areas[k, 1] < 0:
                continue
            best = limit
            for side in range(6):
                axis = side // 2
                a, b = (i, k) if side % 2 == 0 else (k, i)
                one[:], two[:] = areas[a], areas[b]
                two[2 * axis] = max(two[2 * axis], one[2 * axis] + shapes[a, axis])
                one[2 * axis + 1] = min(one[2 * axis + 1], two[2 * axis + 1] - shapes[a, axis])
                if one[2 * axis] > one[2 * axis + 1] or two[2 * axis] > two[2 * axis + 1]:
                    continue
                first = _least(low[a], w1, w2, flat[a], one, best)
                if first < best:
                    second = _least(low[b], w1, w2, flat[b], two, best - first)
                    best = min(best, first + second)
            if best < limit:
                found[i, k] = found[k, i] = best
    return found


@njit(cache=True, nogil=True)
def assignments(starts, costs, extra, rank, twin, upper, most):  # type: ignore[no-untyped-def]
    """All ways to give each box an option that may cost less than ``upper`` together.

    Parameters
    ----------
    starts : options of box i are those from starts[i] to starts[i + 1].
    costs, extra : least cost of each option, what two of them must pay on top; infinite: never.
    rank, twin : a box has no option of lower rank than box twin[i], which is the same but for its
        id; -1 for none.
    most : how many at most.

    Returns
    -------
    picks : options, (found, boxes); one more than ``most`` rows if there are more.
    """
    count = len(starts) - 1
    rest = np.zeros(count + 1)
    for i in range(count - 1, -1, -1):
        least = HUGE
        for o in range(starts[i], starts[i + 1]):
            least = min(least, costs[o])
        rest[i] = rest[i + 1] + least
    picks = np.empty((64, count), np.int64)
    pick, at = np.zeros(count, np.int64), np.zeros(count, np.int64)
    pays = np.zeros((count, count))
    found, depth = 0, 0
    at[0] = starts[0]
    while depth >= 0:
        if at[depth] >= starts[depth + 1]:
            depth -= 1
            if depth >= 0:
                at[depth] += 1
            continue
        o = at[depth]
        pick[depth] = o
        total = rest[depth + 1]
        for i in range(depth + 1):
            total += costs[pick[i]]
        good = total < upper - EPS
        if twin[depth] >= 0 and rank[pick[twin[depth]]] > rank[o]:
            good = False
        if good:
            for i in range(depth):
                pays[i, depth] = pays[depth, i] = extra[pick[i], o]
                good = good and extra[pick[i], o] < HUGE
            good = good and total + matched(depth + 1, pays) < upper - EPS
        if not good:
            at[depth] += 1
        elif depth < count - 1:
            depth += 1
            at[depth] = starts[depth]
        else:
            if found == len(picks):
                picks = np.concatenate((picks, np.empty_like(picks)))
            picks[found] = pick
            found += 1
            at[depth] += 1
            if found > most:
                break
    return picks[:found]


@njit(cache=True, nogil=True)
def group_bounds(groups, costs, extra):  # type: ignore[no-untyped-def]
    """The least that each group costs; rows of ``groups`` are options, -1 for none."""
    found = np.zeros(len(groups))
    pays = np.zeros((groups.shape[1], groups.shape[1]))
    for g in range(len(groups)):
        size = 0
        for i in range(groups.shape[1]):
            if groups[g, i] >= 0:
                found[g] += costs[groups[g, i]]
                size += 1
                other = 0
                for k in range(i):
                    if groups[g, k] >= 0:
                        pays[other, size - 1] = pays[size - 1, other] = extra[
                            groups[g, k], groups[g, i]
                        ]
                        other += 1
        found[g] += matched(size, pays)
    return found


@njit(cache=True, nogil=True)
def next_open(parts, bounds, first, upper):  # type: ignore[no-untyped-def]
    """The first assignment from ``first`` on whose groups cost less than ``upper``; -1 for none."""
    for a in range(first, len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        if total < upper - EPS:
            return a
    return -1


@njit(cache=True, nogil=True)
def least_open(parts, bounds):  # type: ignore[no-untyped-def]
    """The least that any assignment costs."""
    best = np.inf
    for a in range(len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        best = min(best, total)
    return best
