"""Compiled: where each box of a look-ahead can be in a joint solution better than a known one.

A box at (x, y) stands on at least the highest top under it. Where too few of its corner cells have
a top there, other boxes of the look-ahead must first bring one up to its base. How low such a top
can be over each cell follows from where those boxes can be: first on the placed boxes alone, then
also on each other, once more for each box of the look-ahead, since no stack is higher. Places that
cost too much next to the least of all others are left out, and so are those whose helpers do.
:mod:`.reach` says in which order.

Each function ends early once ``stop`` is raised, see :mod:`.budget`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pack_planner.joint.compiled import compiled, entry

#: Height of a top that is not to be had.
NEVER = 1 << 28
#: What rounding may take from a cost, millimetres.
SLACK = 0.01
#: A cost that nothing reaches.
UNBOUNDED = 1e15


class CostWeights(NamedTuple):
    """Ten times eq. (1), for a box in one bin.

    Attributes
    ----------
    position : w1, per millimetre of x and y, or per cell where that is said.
    height : w2, per millimetre of its top.
    bin_index : w3 times the number of the bin.
    """

    position: float
    height: float
    bin_index: float


class SupportRule(NamedTuple):
    """When a box is held up.

    Attributes
    ----------
    step : resolution of x and y, millimetres.
    tolerance : how far below its base a top may lie, millimetres.
    needed : corners of the base that must be held.
    """

    step: int
    tolerance: int
    needed: int


@entry
def paint(boxes, cells_x, cells_y, step):  # type: ignore[no-untyped-def]
    """Height of the highest top over each grid cell, and the number of its box, -1 for none."""
    height = np.zeros((cells_x, cells_y), np.int32)
    owner = np.full((cells_x, cells_y), -1, np.int32)
    for number in range(len(boxes)):
        x0, y0, x1, y1, top = boxes[number]
        for i in range(x0 // step, min(cells_x, -(-x1 // step))):
            for j in range(y0 // step, min(cells_y, -(-y1 // step))):
                if top > height[i, j]:
                    height[i, j] = top
                    owner[i, j] = number
    return height, owner


@compiled
def windows(values, wide, deep):  # type: ignore[no-untyped-def]
    """Maximum of ``values`` over every window of ``wide`` x ``deep`` cells, by doubling."""
    done = 1
    highest = values
    while done < wide:
        shift = min(done, wide - done)
        highest = np.maximum(highest[: len(highest) - shift], highest[shift:])
        done += shift
    done = 1
    while done < deep:
        shift = min(done, deep - done)
        highest = np.maximum(highest[:, : highest.shape[1] - shift], highest[:, shift:])
        done += shift
    return highest


@entry
def landings(bin_size, height, step, shapes, stop):  # type: ignore[no-untyped-def]
    """Highest top under every position, (shapes, cells, cells); ``NEVER`` where a box sticks out.

    ``shapes`` are rows (box, orientation number, dx, dy, dz), millimetres.
    """
    low = np.full((len(shapes), height.shape[0], height.shape[1]), NEVER, np.int32)
    for s in range(len(shapes)):
        if stop[0]:
            break
        wide, deep, dz = shapes[s, 2] // step, shapes[s, 3] // step, shapes[s, 4]
        if wide > height.shape[0] or deep > height.shape[1] or dz > bin_size[2]:
            continue
        top = windows(height, wide, deep)
        if stop[0]:
            break
        for i in range(top.shape[0]):
            for j in range(top.shape[1]):
                if top[i, j] + dz <= bin_size[2]:
                    low[s, i, j] = top[i, j]
    return low


@entry
def cheapest(land, shapes, step, weights, least, stop):  # type: ignore[no-untyped-def]
    """Lower ``least`` of each box to its cheapest position of :func:`landings`."""
    for s in range(len(shapes)):
        if stop[0]:
            return
        which, dz = shapes[s, 0], shapes[s, 4]
        flat = weights.height * dz + weights.bin_index
        for i in range(land.shape[1]):
            if flat + weights.position * i * step >= least[which]:
                break
            for j in range(land.shape[2]):
                base = flat + weights.position * (i + j) * step
                if base >= least[which]:
                    break
                if land[s, i, j] < NEVER:
                    least[which] = min(least[which], base + weights.height * land[s, i, j])


@entry
def carriers(low, shapes, step, weights, caps, tops, costs, stop):  # type: ignore[no-untyped-def]
    """What each box can do for others: lower ``tops`` and ``costs`` (boxes, cells, cells).

    ``tops`` becomes the lowest top that the box can have over a cell, ``costs`` the least that it
    costs there, whatever its top.
    """
    w1, w2, flat = weights
    for s in range(len(shapes)):
        if stop[0]:
            return
        which, _, dx, dy, dz = shapes[s]
        wide, deep = dx // step, dy // step
        last_i, last_j = low.shape[1] - wide, low.shape[2] - deep
        room = caps[which] + SLACK - w2 * dz - flat
        if last_i < 0 or last_j < 0 or room < 0:
            continue
        count_i, count_j = last_i + 1, last_j + 1
        if w1 > 0:  # positions that cost too much at any height are the far ones
            count_i = min(count_i, int(room / (w1 * step)) + 1)
            count_j = min(count_j, int(room / (w1 * step)) + 1)
        shape = (count_i + 2 * wide - 2, count_j + 2 * deep - 2)
        top = np.full(shape, -NEVER, np.int32)
        cost = np.full(shape, -1e18, np.float32)
        for i in range(count_i):
            for j in range(count_j):
                z = low[s, i, j]
                own = w1 * (i + j) * step + w2 * z
                if z < NEVER and own <= room:
                    top[i + wide - 1, j + deep - 1] = -z - dz
                    cost[i + wide - 1, j + deep - 1] = -own
        top = windows(top, wide, deep)
        cost = windows(cost, wide, deep)
        own_tops, own_costs = tops[which], costs[which]
        base = w2 * dz + flat
        for i in range(min(top.shape[0], own_tops.shape[0])):
            for j in range(min(top.shape[1], own_tops.shape[1])):
                own_tops[i, j] = min(own_tops[i, j], -top[i, j])
                own_costs[i, j] = min(own_costs[i, j], base - cost[i, j])


@entry
def raise_bases(  # type: ignore[no-untyped-def]
    height, limit, rule, shapes, weights, caps, known, tops, costs, land, low, least,
    stop,
):  # fmt: skip
    """Raise ``low`` to bases at which enough corners can be supported, and find ``least``.

    ``tops``, ``costs`` as from :func:`carriers`; ``known`` is the least that each box costs in any
    bin, ``least`` (boxes,) is lowered to the least it costs in this one. ``land`` is from
    :func:`landings`. Returns a sum that grows with each position and each lower base.
    """
    step, tolerance, min_vertices = rule
    w1, w2, index = weights
    helped = np.full(height.shape, NEVER, np.int32)
    extra = np.full(height.shape, np.inf, np.float32)
    current = -1
    option = np.empty(5, np.int64)
    ground = np.empty(4, np.int64)
    price = np.empty(4)
    left = 0
    for s in range(len(shapes)):
        if stop[0]:
            break
        which, _, dx, dy, dz = shapes[s]
        if which != current:
            current = which
            helped[:] = NEVER
            extra[:] = np.inf
            for k in range(len(tops)):
                if k != which:
                    helped[:] = np.minimum(helped, tops[k])
                    extra[:] = np.minimum(extra, costs[k] - np.float32(known[k]))
        cap = caps[which] + SLACK
        wide, deep = dx // step, dy // step
        flat = w2 * dz + index
        for i in range(height.shape[0] - wide + 1):
            if flat + w1 * i * step > cap:
                low[s, i:] = NEVER
                break
            for j in range(height.shape[1] - deep + 1):
                z0 = np.int64(land[s, i, j])
                low[s, i, j] = NEVER
                if z0 >= NEVER:
                    continue
                base = flat + w1 * (i + j) * step
                if base + w2 * z0 > cap:
                    land[s, i, j] = NEVER
                    continue
                best = z0
                if z0 > 0:
                    best = np.int64(NEVER)
                    option[4] = z0
                    for corner in range(4):
                        a = i if corner % 2 == 0 else i + wide - 1
                        b = j if corner < 2 else j + deep - 1
                        ground[corner] = height[a, b]
                        option[corner] = max(z0, np.int64(helped[a, b]))
                        price[corner] = extra[a, b]
                    for which_z in range(5):
                        z = option[which_z]
                        if z >= best or z + dz > limit or base + w2 * z > cap:
                            continue
                        resting = 0
                        for corner in range(4):
                            if ground[corner] >= z - tolerance:
                                resting += 1
                        # the other boxes that help cost something there as well
                        spare = cap - base - w2 * z
                        for corner in range(4):
                            if (
                                ground[corner] < z - tolerance
                                and option[corner] <= z
                                and price[corner] <= spare
                            ):
                                resting += 1
                        if resting >= min_vertices:
                            best = z
                    if best == NEVER:
                        continue
                low[s, i, j] = best
                left += NEVER - best
                least[which] = min(least[which], base + w2 * best)
    return left
