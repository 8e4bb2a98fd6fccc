"""Where each box of a look-ahead can be in a joint solution better than a known one.

A box at (x, y) stands on at least the highest top under it. Where too few of its corner cells have
a top there, other boxes of the look-ahead must first bring one up to its base. How low such a top
can be over each cell follows from where those boxes can be: first on the placed boxes alone, then
also on each other, once more for each box of the look-ahead, since no stack is higher. Places that
cost too much next to the least of all others are left out, and so are those whose helpers do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: Height of a top that is not to be had.
NEVER = 1 << 28
#: What rounding may take from a cost, millimetres.
SLACK = 0.01
#: A cost that nothing reaches.
UNBOUNDED = 1e15
#: How often the caps are lowered by what was found.
_PASSES = 2


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def landings(bin_size, height, step, shapes):  # type: ignore[no-untyped-def]
    """Highest top under every position, (shapes, cells, cells); ``NEVER`` where a box sticks out.

    ``shapes`` are rows (box, orientation number, dx, dy, dz), millimetres.
    """
    low = np.full((len(shapes), height.shape[0], height.shape[1]), NEVER, np.int32)
    for s in range(len(shapes)):
        wide, deep, dz = shapes[s, 2] // step, shapes[s, 3] // step, shapes[s, 4]
        if wide > height.shape[0] or deep > height.shape[1] or dz > bin_size[2]:
            continue
        top = windows(height, wide, deep)
        for i in range(top.shape[0]):
            for j in range(top.shape[1]):
                if top[i, j] + dz <= bin_size[2]:
                    low[s, i, j] = top[i, j]
    return low


@njit(cache=True, nogil=True)
def cheapest(land, shapes, step, weights, least):  # type: ignore[no-untyped-def]
    """Lower ``least`` of each box to its cheapest position of :func:`landings`."""
    for s in range(len(shapes)):
        which, dz = shapes[s, 0], shapes[s, 4]
        flat = weights[1] * dz + weights[2]
        for i in range(land.shape[1]):
            if flat + weights[0] * i * step >= least[which]:
                break
            for j in range(land.shape[2]):
                base = flat + weights[0] * (i + j) * step
                if base >= least[which]:
                    break
                if land[s, i, j] < NEVER:
                    least[which] = min(least[which], base + weights[1] * land[s, i, j])


@njit(cache=True, nogil=True)
def carriers(low, shapes, step, weights, caps, tops, costs):  # type: ignore[no-untyped-def]
    """What each box can do for others: lower ``tops`` and ``costs`` (boxes, cells, cells).

    ``tops`` becomes the lowest top that the box can have over a cell, ``costs`` the least that it
    costs there, whatever its top.
    """
    w1, w2, flat = weights
    for s in range(len(shapes)):
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


@njit(cache=True, nogil=True)
def raise_bases(  # type: ignore[no-untyped-def]
    height, limit, rule, min_vertices, shapes, weights, caps, known, tops, costs, land, low, least
):
    """Raise ``low`` to bases at which enough corners can be supported, and find ``least``.

    ``tops``, ``costs`` as from :func:`carriers`; ``known`` is the least that each box costs in any
    bin, ``least`` (boxes,) is lowered to the least it costs in this one. ``land`` is from
    :func:`landings`. Returns a sum that grows with each position and each lower base.
    """
    step, tolerance = rule[0], rule[1]
    w1, w2, _ = weights
    helped = np.full(height.shape, NEVER, np.int32)
    extra = np.full(height.shape, np.inf, np.float32)
    current = -1
    option = np.empty(5, np.int64)
    ground = np.empty(4, np.int64)
    price = np.empty(4)
    left = 0
    for s in range(len(shapes)):
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
        flat = w2 * dz + weights[2]
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


@dataclass(frozen=True, eq=False)
class Ground:
    """A bin as the bounds see it.

    Attributes
    ----------
    size : inner length, breadth, height, millimetres.
    height : highest top over each cell, (cells, cells), millimetres.
    shapes : rows (box, orientation number, dx, dy, dz) of what may go in.
    weights : w1, w2 and the value of the bin's index, per millimetre.
    """

    size: tuple[int, int, int]
    height: NDArray[np.int32]
    shapes: NDArray[np.int64]
    weights: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Reach:
    """Where each box can be in a joint solution no worse than the known one.

    Attributes
    ----------
    grounds : the bins.
    low : for each bin the lowest base of each of its shapes at each cell, (shapes, cells, cells),
        ``NEVER`` where it cannot be.
    least : the least that each box costs in each bin, (bins, boxes), infinite where it cannot be.
    caps : the most that each box may cost, (boxes,). Costs are ten times those of eq. (1).
    """

    grounds: tuple[Ground, ...]
    low: tuple[NDArray[np.int32], ...]
    least: NDArray[np.float64]
    caps: NDArray[np.float64]

    @property
    def cheapest(self) -> NDArray[np.float64]:
        """The least that each box costs in any bin, (boxes,)."""
        found: NDArray[np.float64] = self.least.min(axis=0)
        return found


def reach(
    grounds: Sequence[Ground], count: int, rule: tuple[int, int], min_vertices: int, upper: float
) -> Reach:
    """Bounds for ``count`` boxes; ``upper`` is what all of them cost in the known solution.

    ``rule`` = (resolution, support tolerance), millimetres.
    """
    land = [landings(one.size, one.height, rule[0], one.shapes) for one in grounds]
    low = [np.full_like(one, NEVER) for one in land]
    known = np.full(count, math.inf)
    for one, positions in zip(grounds, land, strict=True):
        cheapest(positions, one.shapes, rule[0], one.weights, known)
    least = np.tile(known, (len(grounds), 1))
    caps = np.full(count, UNBOUNDED)
    for _ in range(_PASSES):
        if not np.isfinite(known).all():
            break
        caps = np.minimum(caps, upper - (known.sum() - known))
        least = np.full((len(grounds), count), math.inf)
        for index, one in enumerate(grounds):
            _stack(one, land[index], low[index], rule, min_vertices, (caps, known), least[index])
        better = np.maximum(known, least.min(axis=0))
        gained = better.sum() - known.sum()
        known = better
        if not gained > 0.1 * (caps.max() - known.min()):
            break
    if np.isfinite(known).all():
        caps = np.minimum(caps, upper - (known.sum() - known))
    return Reach(tuple(grounds), tuple(low), least, caps)


def _stack(
    one: Ground, land: NDArray[np.int32], low: NDArray[np.int32], rule: tuple[int, int],
    min_vertices: int, limits: tuple[NDArray[np.float64], NDArray[np.float64]],
    least: NDArray[np.float64],
) -> None:  # fmt: skip
    """Fill ``low`` and ``least`` for one bin, stack by stack."""
    caps, known = limits
    count = len(least)
    tops = np.full((count, *one.height.shape), NEVER, np.int32)
    costs = np.full(tops.shape, np.float32(UNBOUNDED), np.float32)
    before = -1
    for _ in range(count):
        least[:] = math.inf
        left = raise_bases(
            one.height, one.size[2], rule, min_vertices, one.shapes, one.weights, caps, known,
            tops, costs, land, low, least,
        )  # fmt: skip
        if left == before or left == 0:
            return
        before = left
        carriers(low, one.shapes, rule[0], one.weights, caps, tops, costs)
