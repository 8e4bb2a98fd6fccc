"""Compiled: the cheapest way to put some boxes, each with given face up and base, into one bin.

Depth-first branch and bound. A node keeps, for every box, ranges of x and y, which of its two turns
are left, and relations between boxes: one is wholly beside another, a corner of one lies on
another, two faces lie in one plane. Every relation is a difference of two coordinates, so ranges
follow from each other as lengths of longest paths, and what a box costs at least is the least over
the places in its ranges where its base can be held up. The bound of a node is the sum of that, and
what pairs of boxes must pay to stay clear of each other, with all that rests wholly on them, over
the best set of pairs and triples that share no box.

Branching, on what is wrong when every box is at its cheapest place:

``two boxes meet``
    one is beside the other: four sides, for each pair of turns. Those along y exclude those along
    x, so that no arrangement is met twice.
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
from pack_planner.joint.held import farthest, is_plain, least_cost, plain_cost, scan

#: Why the search returns.
DONE, PAUSED, SOLUTION, FULL = 0, 1, 2, 3


@njit(cache=True, nogil=True)
def matched(count, extra):  # type: ignore[no-untyped-def]
    """The most that disjoint pairs and triples of ``count`` boxes must pay, by ``extra`` of pairs.

    Three boxes pay at least half of what their three pairs do.
    """
    return matched_wholes(count, extra, 1 << np.arange(count))


@njit(cache=True, nogil=True)
def matched_wholes(count, extra, whole):  # type: ignore[no-untyped-def]
    """The same where ``extra`` of a pair is paid by two sets of boxes, ``whole`` of each as bits.

    Pairs and triples then share no box of these sets.
    """
    found = np.zeros(1 << count)
    for mask in range(1, 1 << count):
        best = 0.0
        for i in range(count):
            if mask >> i & 1:
                best = max(best, found[mask & ~(1 << i)])
        for i in range(count):
            if whole[i] & ~mask:
                continue
            rest = mask & ~whole[i]
            for k in range(i + 1, count):
                if whole[k] & ~rest or extra[i, k] <= 0.0:
                    continue
                left = rest & ~whole[k]
                best = max(best, extra[i, k] + found[left])
                for j in range(k + 1, count):
                    if whole[j] & ~left == 0:
                        three = extra[i, k] + extra[i, j] + extra[k, j]
                        best = max(best, 0.5 * three + found[left & ~whole[j]])
        found[mask] = best
    return found[(1 << count) - 1]


@njit(cache=True, nogil=True)
def _follow(lo, hi, apart):  # type: ignore[no-untyped-def]
    """Narrow ranges by the relations; False if one is empty."""
    count = len(lo)
    for _ in range(count + 2):
        again = False
        for axis in range(2):
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
            if lo[i, 0] > hi[i, 0] or lo[i, 1] > hi[i, 1]:
                return False
        if not again:
            return True
    return False  # relations that chase each other


@njit(cache=True, nogil=True)
def _settle(problem, node, upper):  # type: ignore[no-untyped-def]
    """Narrow ranges of a node and find the cheapest place of each box; False if hopeless.

    Boxes whose ranges did not change keep their places, unless they lean on others.
    """
    lo, hi, cost, place, stale = node[0], node[1], node[6], node[7], node[11]
    flat, w1, doubtful = problem[4], problem[10], problem[15]
    count = len(lo)
    found = np.empty(3, np.int64)
    low, high = np.empty_like(lo), np.empty_like(hi)
    narrowed = False
    for _ in range(40):
        low[:] = lo
        high[:] = hi
        if not _follow(lo, hi, node[2]):
            return False
        some = narrowed
        for i in range(count):
            for axis in range(2):
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
            if not stale[i] and not doubtful[i]:
                continue
            stale[i] = False
            cap = upper - EPS - (total - cost[i])
            least = scan(i, problem, node, cap, found)
            if least >= HUGE:
                return False
            place[i] = found
            if least > cost[i]:
                total += least - cost[i]
                cost[i] = least
            far = farthest(cap, flat[i], w1)
            for axis in range(2):
                if far - lo[i, 1 - axis] < hi[i, axis]:
                    hi[i, axis] = far - lo[i, 1 - axis]
                    narrowed = True
        if total >= upper - EPS:
            return False
    return True


@njit(cache=True, nogil=True)
def _meet(i, k, place, sizes):  # type: ignore[no-untyped-def]
    a, b = sizes[i, place[i, 2]], sizes[k, place[k, 2]]
    for axis in range(2):
        if place[i, axis] >= place[k, axis] + b[axis]:
            return False
        if place[k, axis] >= place[i, axis] + a[axis]:
            return False
    return True


@njit(cache=True, nogil=True)
def _loads(k, axis, first, problem, node, limit):  # type: ignore[no-untyped-def]
    """What the boxes that rest wholly on ``k`` cost at least when it begins at ``first``."""
    lo, hi, turn, cost, place = node[0], node[1], node[5], node[6], node[7]
    wholly, turns = problem[14][k], problem[3]
    total = 0.0
    for m in range(len(lo)):
        if m == k or not wholly >> m & 1:
            continue
        if place[m, axis] >= first:
            total += cost[m]
            continue
        x0, y0 = lo[m]
        if axis == 0:
            x0 = max(x0, first)
        else:
            y0 = max(y0, first)
        window = (x0, hi[m, 0], y0, hi[m, 1])
        best = limit - total
        for t in range(turns[m]):
            if turn[m] == EITHER or turn[m] == t:
                best = least_cost(m, t, problem, node, window, best)
        total += best
        if total >= limit:
            return limit
    return total


@njit(cache=True, nogil=True)
def _sides(i, k, problem, node, limit, out):  # type: ignore[no-untyped-def]
    """What two boxes and what rests wholly on them cost at least, returned and in ``out``.

    ``out`` is (turns of i, of k, sides); side 2 * axis: ``i`` comes first along the axis; the next
    one: ``k`` does.
    """
    lo, hi, turn, least, cost = node[0], node[1], node[5], node[10], node[6]
    sizes, turns, wholly = problem[2], problem[3], problem[14]
    after, rows, flat, w1 = problem[0], problem[1], problem[4], problem[10]
    plain = np.empty(len(lo), np.bool_)
    for m in (i, k):
        plain[m] = is_plain(m, problem, node)
    loads = np.zeros(2)
    for m in range(len(lo)):
        loads[0] += cost[m] if m != i and wholly[i] >> m & 1 else 0.0
        loads[1] += cost[m] if m != k and wholly[k] >> m & 1 else 0.0
    best = HUGE
    out[:] = HUGE
    for p in range(turns[i]):
        if turn[i] != EITHER and turn[i] != p:
            continue
        for q in range(turns[k]):
            if turn[k] != EITHER and turn[k] != q:
                continue
            if least[i, p] + least[k, q] + loads[0] + loads[1] >= limit:
                continue
            for side in range(4):
                axis = side // 2
                a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
                first = max(lo[b, axis], lo[a, axis] + sizes[a, ta, axis])
                last = min(hi[a, axis], hi[b, axis] - sizes[a, ta, axis])
                if first > hi[b, axis] or last < lo[a, axis]:
                    continue
                one = least[a, ta] + loads[side % 2]
                if last < hi[a, axis]:
                    x0, y0 = lo[a]
                    x1, y1 = (last, hi[a, 1]) if axis == 0 else (hi[a, 0], last)
                    most = limit - least[b, tb] - loads[side % 2]
                    if plain[a]:
                        one = plain_cost(after, rows[a, ta], flat[a], w1, x0, x1, y0, y1, most)
                    else:
                        one = least_cost(a, ta, problem, node, (x0, x1, y0, y1), most)
                    one += loads[side % 2]
                    if one + least[b, tb] >= limit:
                        continue
                x1, y1 = hi[b]
                x0, y0 = (first, lo[b, 1]) if axis == 0 else (lo[b, 0], first)
                other = loads[1 - side % 2]
                most = limit - one - other
                if plain[b]:
                    two = plain_cost(after, rows[b, tb], flat[b], w1, x0, x1, y0, y1, most)
                else:
                    two = least_cost(b, tb, problem, node, (x0, x1, y0, y1), most)
                if one + two + other >= limit:
                    continue
                if other > 0.0:
                    two += _loads(b, axis, first, problem, node, limit - one - two)
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


@njit(cache=True, nogil=True)
def search(problem, nodes, counters, upper, budget, rejected):  # type: ignore[no-untyped-def]
    """Search on until something happens.

    Parameters
    ----------
    problem : see :func:`pack_planner.joint.groups.problem_of`.
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
    sizes, contact, meets, wholly = problem[2], problem[13], problem[12], problem[14]
    count = len(sizes)
    room = 12 * count + 24
    costs, chosen = np.empty((2, 2, 4)), np.empty((2, 2, 4))
    extra = np.empty((count, count))
    node = (
        nodes[0][here], nodes[1][here], nodes[2][here], nodes[3][here], nodes[4][here],
        nodes[5][here], nodes[6][here], nodes[7][here], nodes[8][here], nodes[9][here],
        nodes[10][here], nodes[11][here],
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
        if nodes[8][top, 0] >= upper - EPS:
            continue
        counters[1] += 1
        budget -= 1
        _take(top, node, nodes)
        if not _settle(problem, node, upper):
            continue
        cost, place = node[6], node[7]
        total = 0.0
        for i in range(count):
            total += cost[i]
        extra[:] = 0.0
        one, two, most, second, own = -1, -1, -1.0, -1.0, 0.0
        hopeless = False
        for i in range(count):
            for k in range(i + 1, count):
                if hopeless or not meets[i, k] or node[3][i, k] or not _meet(i, k, place, sizes):
                    continue
                pair = 0.0
                for m in range(count):
                    pair += cost[m] if (wholly[i] | wholly[k]) >> m & 1 else 0.0
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
                    one, two, most, second, own = i, k, least - pair, spread, pair
                    chosen[:] = costs
        if hopeless:
            continue
        if one >= 0:
            node[8][0] = max(node[8][0], total + matched_wholes(count, extra, wholly))
            if node[8][0] < upper - EPS:
                part(one, two, chosen, total - own, problem, node, nodes, counters, upper)
            continue
        node[8][0] = max(node[8][0], total)
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
