"""Compiled: the cheapest way to put some boxes, each with a given face up, into one bin.

Depth-first branch and bound. A node keeps, for every box, ranges of x, y and base, which of its two
turns are left, and relations between boxes: one is wholly beside or above another, a corner of one
lies on another, two faces lie in one plane. Every relation is a difference of two coordinates, so
ranges follow from each other as lengths of longest paths, and what a box costs at least is the
least over the places in its ranges where its base can be held up. The bound of a node is the sum of
that, and what pairs of boxes must pay to stay clear of each other, over the best set of pairs and
triples that share no box.

Branching, on what is wrong when every box is at its cheapest place:

``two boxes meet``
    one is beside or above the other: six sides, for each pair of turns. A side excludes those
    before it, so that no arrangement is met twice.
``a relation does not hold``
    between the places, though it does between the ranges: one range is cut in two.
``a corner hangs in the air``
    and too few others do not: it stays so, or lies on a placed box, or on one of the others.
``a box touches nothing``
    along x or y, where contact is asked for: a wall or placed box, or a face of another box.
``nothing``
    that is a solution. The caller holds it against the rules that are not known here; if it breaks
    one, the range of some box is cut around its place.

x and y are grid cells, heights are millimetres.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.branching import (
    EITHER,
    EPS,
    HUGE,
    NONE,
    around,
    attach,
    broken,
    hanging,
    hold,
    loose,
    part,
)
from pack_planner.joint.held import least_cost, scan

#: Why the search returns.
DONE, PAUSED, SOLUTION, FULL = 0, 1, 2, 3


@njit(cache=True, nogil=True)
def matched(count, extra):  # type: ignore[no-untyped-def]
    """The most that disjoint pairs and triples of ``count`` boxes must pay, by ``extra`` of pairs.

    Three boxes pay at least half of what their three pairs do.
    """
    found = np.zeros(1 << count)
    for mask in range(1, 1 << count):
        i = 0
        while not mask >> i & 1:
            i += 1
        rest = mask & ~(1 << i)
        best = found[rest]
        for k in range(i + 1, count):
            if not rest >> k & 1:
                continue
            left = rest & ~(1 << k)
            best = max(best, extra[i, k] + found[left])
            for j in range(k + 1, count):
                if left >> j & 1:
                    three = extra[i, k] + extra[i, j] + extra[k, j]
                    best = max(best, 0.5 * three + found[left & ~(1 << j)])
        found[mask] = best
    return found[(1 << count) - 1]


@njit(cache=True, nogil=True)
def _follow(lo, hi, apart, levels):  # type: ignore[no-untyped-def]
    """Narrow ranges by the relations; False if one is empty."""
    count = len(lo)
    for _ in range(count + 2):
        again = False
        for axis in range(3):
            for i in range(count):
                for k in range(count):
                    d = apart[axis, i, k]
                    if d == NONE:
                        continue
                    if lo[k, axis] + d > lo[i, axis]:
                        lo[i, axis] = lo[k, axis] + d
                        again = True
                    if hi[i, axis] - d < hi[k, axis]:
                        hi[k, axis] = hi[i, axis] - d
                        again = True
        for i in range(count):
            for axis in range(3):
                if lo[i, axis] > hi[i, axis]:
                    return False
            level = levels[i, lo[i, 2]]
            if level > lo[i, 2]:
                lo[i, 2] = level
                again = True
                if level > hi[i, 2]:
                    return False
        if not again:
            return True
    return False  # relations that chase each other


@njit(cache=True, nogil=True)
def _settle(problem, node, upper):  # type: ignore[no-untyped-def]
    """Narrow ranges of a node and find the cheapest place of each box; False if hopeless.

    Boxes whose ranges did not change keep their places, unless they lean on others.
    """
    lo, hi, cost, place, stale = node[0], node[1], node[7], node[8], node[12]
    count = len(lo)
    area = np.empty(6, np.int64)
    found = np.empty(4, np.int64)
    narrowed = False
    for _ in range(40):
        low, high = lo.copy(), hi.copy()
        if not _follow(lo, hi, node[2], problem[5]):
            return False
        some = narrowed
        for i in range(count):
            for axis in range(3):
                if low[i, axis] != lo[i, axis] or high[i, axis] != hi[i, axis]:
                    stale[i] = True
            some = some or stale[i]
        if not some:
            break
        narrowed = False
        total = 0.0
        for i in range(count):
            total += cost[i]
        for i in range(count):
            if not stale[i] and place[i, 2] == 0:
                continue
            stale[i] = False
            least = scan(i, problem, node, upper - EPS - (total - cost[i]), found, area)
            if least >= HUGE:
                return False
            place[i] = found
            if least > cost[i]:
                total += least - cost[i]
                cost[i] = least
            for axis in range(3):
                if area[2 * axis] > lo[i, axis]:
                    lo[i, axis] = area[2 * axis]
                    narrowed = True
                if area[2 * axis + 1] < hi[i, axis]:
                    hi[i, axis] = area[2 * axis + 1]
                    narrowed = True
        if total >= upper - EPS:
            return False
    return True


@njit(cache=True, nogil=True)
def _meet(i, k, place, sizes):  # type: ignore[no-untyped-def]
    a, b = sizes[i, place[i, 3]], sizes[k, place[k, 3]]
    for axis in range(3):
        if place[i, axis] >= place[k, axis] + b[axis]:
            return False
        if place[k, axis] >= place[i, axis] + a[axis]:
            return False
    return True


@njit(cache=True, nogil=True)
def _sides(i, k, problem, node, limit, out):  # type: ignore[no-untyped-def]
    """What two boxes cost at least, (turns of i, of k, sides) into ``out``; returns the least.

    Side 2 * axis: ``i`` comes first along the axis; the next one: ``k`` does.
    """
    lo, hi, turn, least = node[0], node[1], node[6], node[11]
    sizes, turns = problem[2], problem[3]
    window = np.empty(6, np.int64)
    best = HUGE
    out[:] = HUGE
    for p in range(turns[i]):
        if turn[i] != EITHER and turn[i] != p:
            continue
        for q in range(turns[k]):
            if turn[k] != EITHER and turn[k] != q:
                continue
            if least[i, p] + least[k, q] >= limit:
                continue
            for side in range(6):
                axis = side // 2
                a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
                first = max(lo[b, axis], lo[a, axis] + sizes[a, ta, axis])
                last = min(hi[a, axis], hi[b, axis] - sizes[a, ta, axis])
                if first > hi[b, axis] or last < lo[a, axis]:
                    continue
                one = least[a, ta]
                if last < hi[a, axis]:
                    for e in range(3):
                        window[2 * e], window[2 * e + 1] = lo[a, e], hi[a, e]
                    window[2 * axis + 1] = last
                    one = least_cost(a, ta, problem, node, window, limit - least[b, tb])
                    if one + least[b, tb] >= limit:
                        continue
                for e in range(3):
                    window[2 * e], window[2 * e + 1] = lo[b, e], hi[b, e]
                window[2 * axis] = first
                two = least_cost(b, tb, problem, node, window, limit - one)
                if one + two < limit:
                    out[p, q, side] = one + two
                    best = min(best, one + two)
    return best


@njit(cache=True, nogil=True)
def _take(top, node, nodes):  # type: ignore[no-untyped-def]
    """Copy the open node ``top`` to ``node``."""
    node[0][:] = nodes[0][top]
    node[1][:] = nodes[1][top]
    node[2][:] = nodes[2][top]
    node[3][:] = nodes[3][top]
    node[4][:] = nodes[4][top]
    node[5][:] = nodes[5][top]
    node[6][:] = nodes[6][top]
    node[7][:] = nodes[7][top]
    node[8][:] = nodes[8][top]
    node[9][:] = nodes[9][top]
    node[10][:] = nodes[10][top]
    node[11][:] = nodes[11][top]
    node[12][:] = nodes[12][top]


@njit(cache=True, nogil=True)
def search(problem, nodes, counters, upper, budget, rejected):  # type: ignore[no-untyped-def]
    """Search on until something happens.

    Parameters
    ----------
    problem : see :class:`pack_planner.joint.groups.Group`.
    nodes : arrays of the nodes, see :func:`pack_planner.joint.groups.empty_nodes`; the open ones
        are a stack, the last row is the node that is looked at.
    counters : [open nodes, nodes taken].
    upper : nothing that costs so much is wanted.
    budget : how many nodes to take at most.
    rejected : whether the solution last returned breaks a rule.

    Returns
    -------
    One of DONE, PAUSED, SOLUTION and FULL; a SOLUTION is in the last row.
    """
    here = len(nodes[0]) - 1
    sizes, contact = problem[2], problem[8]
    count = len(sizes)
    room = 12 * count + 24
    costs, chosen = np.empty((2, 2, 6)), np.empty((2, 2, 6))
    extra = np.empty((count, count))
    node = (
        nodes[0][here], nodes[1][here], nodes[2][here], nodes[3][here], nodes[4][here],
        nodes[5][here], nodes[6][here], nodes[7][here], nodes[8][here], nodes[9][here],
        nodes[10][here], nodes[11][here], nodes[12][here],
    )  # fmt: skip
    if rejected:
        around(node, nodes, counters)
    while counters[0] > 0:
        if counters[0] + room > here:
            return FULL
        if budget <= 0:
            return PAUSED
        counters[0] -= 1
        top = counters[0]
        if nodes[9][top, 0] >= upper - EPS:
            continue
        counters[1] += 1
        budget -= 1
        _take(top, node, nodes)
        if not _settle(problem, node, upper):
            continue
        cost, place = node[7], node[8]
        total = 0.0
        for i in range(count):
            total += cost[i]
        extra[:] = 0.0
        one, two, most, second = -1, -1, -1.0, -1.0
        hopeless = False
        for i in range(count):
            for k in range(i + 1, count):
                if hopeless or node[3][i, k] or not _meet(i, k, place, sizes):
                    continue
                pair = cost[i] + cost[k]
                limit = upper - (total - pair)
                least = _sides(i, k, problem, node, limit, costs)
                if least >= HUGE:
                    hopeless = True
                    continue
                extra[i, k] = extra[k, i] = least - pair
                spread = 0.0
                for value in costs.ravel():
                    spread += min(value, limit)
                if least - pair > most + 1e-9 or (least - pair > most - 1e-9 and spread > second):
                    one, two, most, second = i, k, least - pair, spread
                    chosen[:] = costs
        if hopeless:
            continue
        if one >= 0:
            node[9][0] = max(node[9][0], total + matched(count, extra))
            if node[9][0] < upper - EPS:
                rest = total - cost[one] - cost[two]
                part(one, two, chosen, rest, problem, node, nodes, counters, upper)
            continue
        node[9][0] = max(node[9][0], total)
        if broken(node, nodes, counters):
            continue
        i, corner = hanging(problem, node)
        if i >= 0:
            hold(i, corner, problem, node, nodes, counters)
            continue
        if contact:
            i, axis = loose(problem, node)
            if i >= 0:
                attach(i, axis, problem, node, nodes, counters)
                continue
        return SOLUTION
    return DONE
