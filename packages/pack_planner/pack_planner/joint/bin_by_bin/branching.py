"""Compiled: the children of a node of :mod:`.arrangement`, by what is wrong with it."""

from __future__ import annotations

from pack_planner.joint.compiled import uncounted

#: No relation.
NONE = -(1 << 29)
#: More than any cost.
HUGE = 1e18
EPS = 1e-6
#: State of a corner: not decided, on a placed box, on nothing, 3 + k: on box k.
OPEN, PLACED, NOTHING, ON = 0, 1, 2, 3
#: Both turns are left.
EITHER = 2


@uncounted
def copy(nodes, here, there):  # type: ignore[no-untyped-def]
    """Copy node number ``here`` over another one, element by element."""
    count = nodes.low.shape[1]
    nodes.bound[there, 0] = nodes.bound[here, 0]
    for i in range(count):
        nodes.turn[there, i] = nodes.turn[here, i]
        nodes.cost[there, i] = nodes.cost[here, i]
        nodes.stale[there, i] = nodes.stale[here, i]
        for axis in range(2):
            nodes.low[there, i, axis] = nodes.low[here, i, axis]
            nodes.high[there, i, axis] = nodes.high[here, i, axis]
            nodes.touch[there, i, axis] = nodes.touch[here, i, axis]
            nodes.least[there, i, axis] = nodes.least[here, i, axis]
            for k in range(count):
                nodes.apart[there, axis, i, k] = nodes.apart[here, axis, i, k]
        for k in range(count):
            nodes.clear[there, i, k] = nodes.clear[here, i, k]
        for c in range(4):
            nodes.corner[there, i, c] = nodes.corner[here, i, c]
        for c in range(3):
            nodes.place[there, i, c] = nodes.place[here, i, c]


@uncounted
def _child(nodes, counters):  # type: ignore[no-untyped-def]
    """A copy of the node that is looked at on top of the stack."""
    new = counters[0]
    counters[0] = new + 1
    copy(nodes, len(nodes.low) - 1, new)
    return new


@uncounted
def relate(apart, axis, i, k, distance):  # type: ignore[no-untyped-def]
    """Box ``i`` lies at least ``distance`` beyond ``k`` along ``axis``."""
    apart[axis, i, k] = max(apart[axis, i, k], distance)


@uncounted
def part(i, k, costs, rest, problem, node, nodes, counters, upper):  # type: ignore[no-untyped-def]
    """Children in which boxes ``i`` and ``k`` do not meet; the cheapest comes up first.

    ``costs`` are used up.
    """
    sizes = problem.sizes
    base, most = node.bound[0], upper - EPS - rest
    while True:
        cost, p, q, side = -1.0, 0, 0, 0
        for t in range(2):
            for u in range(2):
                for s in range(4):
                    if cost < costs[t, u, s] < most:
                        cost, p, q, side = costs[t, u, s], t, u, s
        if cost < 0.0:
            return
        costs[p, q, side] = HUGE
        axis = side // 2
        new = _child(nodes, counters)
        nodes.bound[new, 0] = max(base, rest + cost)
        nodes.turn[new, i], nodes.turn[new, k] = p, q
        nodes.stale[new, i] = nodes.stale[new, k] = True
        apart, known = nodes.apart[new], nodes.clear[new]
        known[i, k] = known[k, i] = True
        a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
        relate(apart, axis, b, a, sizes[a, ta, axis])
        if axis == 1:
            relate(apart, 0, a, b, 1 - sizes[a, ta, 0])
            relate(apart, 0, b, a, 1 - sizes[b, tb, 0])


@uncounted
def broken(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the range of a box whose place breaks a relation; False if all hold."""
    apart, place = node.apart, node.place
    count = len(place)
    for axis in range(2):
        for i in range(count):
            for k in range(count):
                d = apart[axis, i, k]
                if d == NONE or place[i, axis] >= place[k, axis] + d:
                    continue
                cut = place[i, axis] - d
                new = _child(nodes, counters)
                nodes.low[new, k, axis] = cut + 1
                nodes.stale[new, k] = True
                new = _child(nodes, counters)
                nodes.high[new, k, axis] = cut
                nodes.stale[new, k] = True
                return True
    return False


@uncounted
def rests(a, b, height, base, tolerance):  # type: ignore[no-untyped-def]
    """Whether a placed box is right under ``base`` at the cell (a, b)."""
    return height[a, b] > 0 and base - tolerance <= height[a, b] <= base


@uncounted
def hanging(problem, node):  # type: ignore[no-untyped-def]
    """A box with too few corners on something, and a corner of it to decide on; (-1, -1): none."""
    sizes, leans, holds = problem.sizes, problem.leans, problem.under
    height, tolerance = problem.height, problem.tolerance
    needed, bases = problem.needed, problem.base
    corner, place = node.corner, node.place
    count = len(place)
    for i in range(count):
        if not leans[i]:
            continue
        x, y, t = place[i, 0], place[i, 1], place[i, 2]
        good, open_corner = 0, -1
        for c in range(4):
            a = x if c % 2 == 0 else x + sizes[i, t, 0] - 1
            b = y if c < 2 else y + sizes[i, t, 1] - 1
            held = rests(a, b, height, bases[i], tolerance)
            for k in range(count):
                below = sizes[k, place[k, 2]]
                if (
                    holds[i, k]
                    and place[k, 0] <= a < place[k, 0] + below[0]
                    and place[k, 1] <= b < place[k, 1] + below[1]
                ):
                    held = True
            if held:
                good += 1
            elif corner[i, c] == OPEN and open_corner < 0:
                open_corner = c
        if good < needed[i]:
            return i, open_corner
    return -1, -1


@uncounted
def _turned(i, node, nodes, counters):  # type: ignore[no-untyped-def]
    """One child for each turn of box ``i``; False if it has one only."""
    if node.turn[i] != EITHER:
        return False
    chosen = node.place[i, 2]
    for t in (1 - chosen, chosen):
        new = _child(nodes, counters)
        nodes.turn[new, i] = t
        nodes.stale[new, i] = True
    return True


@uncounted
def _on(i, k, t, node, nodes, counters):  # type: ignore[no-untyped-def]
    """A child in which box ``k``, turned ``t``, is under box ``i``; its number."""
    new = _child(nodes, counters)
    nodes.stale[new, i] = nodes.stale[new, k] = True
    nodes.turn[new, k] = t
    return new


@uncounted
def hold(i, corner, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what ``corner`` of box ``i`` lies on."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns, holds, needed = problem.sizes, problem.turns, problem.under, problem.needed[i]
    count = len(sizes)
    own = sizes[i, node.turn[i]]
    if not problem.doubtful[i]:  # wholly on the only one that can hold it
        for k in range(count):
            for t in range(turns[k]):
                if holds[i, k] and node.turn[k] in (EITHER, t):
                    apart = nodes.apart[_on(i, k, t, node, nodes, counters)]
                    for axis in range(2):
                        relate(apart, axis, k, i, own[axis] - sizes[k, t, axis])
        return
    free = 0
    for c in range(4):
        free += int(node.corner[i, c] == NOTHING)
    off = (0 if corner % 2 == 0 else own[0] - 1, 0 if corner < 2 else own[1] - 1)
    if free < 4 - needed:
        new = _child(nodes, counters)
        nodes.corner[new, i, corner] = NOTHING
        nodes.stale[new, i] = True
    new = _child(nodes, counters)
    nodes.corner[new, i, corner] = PLACED
    nodes.stale[new, i] = True
    for k in range(count):
        for t in range(turns[k]):
            if not holds[i, k] or node.turn[k] not in (EITHER, t):
                continue
            new = _on(i, k, t, node, nodes, counters)
            nodes.corner[new, i, corner] = ON + k
            for axis in range(2):
                relate(nodes.apart[new], axis, i, k, -off[axis])
                relate(nodes.apart[new], axis, k, i, off[axis] + 1 - sizes[k, t, axis])


@uncounted
def loose(problem, node):  # type: ignore[no-untyped-def]
    """A box that touches nothing along an axis, and the axis; (-1, -1): none."""
    rows, sizes, beside = problem.rows, problem.sizes, problem.beside
    touch, place = node.touch, node.place
    count = len(place)
    for i in range(count):
        t = place[i, 2]
        for axis in range(2):
            at = place[i, axis]
            if touch[i, axis] == 2 or beside[rows[i, t], axis, at]:
                continue
            good = False
            for k in range(count):
                if k != i and (
                    at == place[k, axis] + sizes[k, place[k, 2], axis]
                    or place[k, axis] == at + sizes[i, t, axis]
                ):
                    good = True
            if not good:
                return i, axis
    return -1, -1


@uncounted
def attach(i, axis, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what box ``i`` touches along ``axis``."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns = problem.sizes, problem.turns
    own = sizes[i, node.turn[i], axis]
    for k in range(len(sizes)):
        for t in range(turns[k]):
            if k == i or (node.turn[k] != EITHER and node.turn[k] != t):
                continue
            for extent in (sizes[k, t, axis], -own):
                new = _child(nodes, counters)
                nodes.turn[new, k] = t
                nodes.touch[new, i, axis] = 2
                nodes.stale[new, i] = nodes.stale[new, k] = True
                relate(nodes.apart[new], axis, i, k, extent)
                relate(nodes.apart[new], axis, k, i, -extent)
    new = _child(nodes, counters)
    nodes.touch[new, i, axis] = 1
    nodes.stale[new, i] = True


@uncounted
def around(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the ranges of some box around its place, which it may keep; none if all are fixed."""
    lo, hi, place = node.low, node.high, node.place
    for i in range(len(lo)):
        if _turned(i, node, nodes, counters):
            return
        if lo[i, 0] == hi[i, 0] and lo[i, 1] == hi[i, 1]:
            continue
        for axis in range(2):
            at = place[i, axis]
            for below in (True, False):
                new = _child(nodes, counters)
                nodes.stale[new, i] = True
                for e in range(axis):
                    nodes.low[new, i, e] = nodes.high[new, i, e] = place[i, e]
                if below:
                    nodes.high[new, i, axis] = at - 1
                else:
                    nodes.low[new, i, axis] = at + 1
        new = _child(nodes, counters)
        nodes.stale[new, i] = True
        for axis in range(2):
            nodes.low[new, i, axis] = nodes.high[new, i, axis] = place[i, axis]
        return
