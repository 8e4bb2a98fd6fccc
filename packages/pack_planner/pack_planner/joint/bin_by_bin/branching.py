"""Compiled: the children of a node of :mod:`.relations`, by what is wrong with it."""

from __future__ import annotations

from pack_planner.joint.bin_by_bin.compiled import compiled

#: No relation.
NONE = -(1 << 29)
#: More than any cost.
HUGE = 1e18
EPS = 1e-6
#: State of a corner: not decided, on a placed box, on nothing, 3 + k: on box k.
OPEN, PLACED, NOTHING, ON = 0, 1, 2, 3
#: Both turns are left.
EITHER = 2


@compiled
def copy(nodes, here, there):  # type: ignore[no-untyped-def]
    """Copy node number ``here`` over another one, element by element."""
    count = nodes[0].shape[1]
    nodes[8][there, 0] = nodes[8][here, 0]
    for i in range(count):
        nodes[5][there, i] = nodes[5][here, i]
        nodes[6][there, i] = nodes[6][here, i]
        nodes[11][there, i] = nodes[11][here, i]
        for axis in range(2):
            nodes[0][there, i, axis] = nodes[0][here, i, axis]
            nodes[1][there, i, axis] = nodes[1][here, i, axis]
            nodes[9][there, i, axis] = nodes[9][here, i, axis]
            nodes[10][there, i, axis] = nodes[10][here, i, axis]
            for k in range(count):
                nodes[2][there, axis, i, k] = nodes[2][here, axis, i, k]
        for k in range(count):
            nodes[3][there, i, k] = nodes[3][here, i, k]
        for c in range(4):
            nodes[4][there, i, c] = nodes[4][here, i, c]
        for c in range(3):
            nodes[7][there, i, c] = nodes[7][here, i, c]


@compiled
def _child(nodes, counters):  # type: ignore[no-untyped-def]
    """A copy of the node that is looked at on top of the stack."""
    new = counters[0]
    counters[0] = new + 1
    copy(nodes, len(nodes[0]) - 1, new)
    return new


@compiled
def relate(apart, axis, i, k, distance):  # type: ignore[no-untyped-def]
    """Box ``i`` lies at least ``distance`` beyond ``k`` along ``axis``."""
    apart[axis, i, k] = max(apart[axis, i, k], distance)


@compiled
def part(i, k, costs, rest, problem, node, nodes, counters, upper):  # type: ignore[no-untyped-def]
    """Children in which boxes ``i`` and ``k`` do not meet; the cheapest comes up first.

    ``costs`` are used up.
    """
    sizes = problem[2]
    base, most = node[8][0], upper - EPS - rest
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
        nodes[8][new, 0] = max(base, rest + cost)
        nodes[5][new, i], nodes[5][new, k] = p, q
        nodes[11][new, i] = nodes[11][new, k] = True
        apart, known = nodes[2][new], nodes[3][new]
        known[i, k] = known[k, i] = True
        a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
        relate(apart, axis, b, a, sizes[a, ta, axis])
        if axis == 1:
            relate(apart, 0, a, b, 1 - sizes[a, ta, 0])
            relate(apart, 0, b, a, 1 - sizes[b, tb, 0])


@compiled
def broken(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the range of a box whose place breaks a relation; False if all hold."""
    apart, place = node[2], node[7]
    count = len(place)
    for axis in range(2):
        for i in range(count):
            for k in range(count):
                d = apart[axis, i, k]
                if d == NONE or place[i, axis] >= place[k, axis] + d:
                    continue
                cut = place[i, axis] - d
                new = _child(nodes, counters)
                nodes[0][new, k, axis] = cut + 1
                nodes[11][new, k] = True
                new = _child(nodes, counters)
                nodes[1][new, k, axis] = cut
                nodes[11][new, k] = True
                return True
    return False


@compiled
def rests(a, b, height, base, tolerance):  # type: ignore[no-untyped-def]
    """Whether a placed box is right under ``base`` at the cell (a, b)."""
    return height[a, b] > 0 and base - tolerance <= height[a, b] <= base


@compiled
def hanging(problem, node):  # type: ignore[no-untyped-def]
    """A box with too few corners on something, and a corner of it to decide on; (-1, -1): none."""
    sizes, leans, holds = problem[2], problem[5], problem[6]
    height, (tolerance, needed), bases = problem[8], problem[9], problem[11]
    corner, place = node[4], node[7]
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


@compiled
def _turned(i, node, nodes, counters):  # type: ignore[no-untyped-def]
    """One child for each turn of box ``i``; False if it has one only."""
    if node[5][i] != EITHER:
        return False
    chosen = node[7][i, 2]
    for t in (1 - chosen, chosen):
        new = _child(nodes, counters)
        nodes[5][new, i] = t
        nodes[11][new, i] = True
    return True


@compiled
def _on(i, k, t, node, nodes, counters):  # type: ignore[no-untyped-def]
    """A child in which box ``k``, turned ``t``, is under box ``i``; its number."""
    new = _child(nodes, counters)
    nodes[11][new, i] = nodes[11][new, k] = True
    nodes[5][new, k] = t
    return new


@compiled
def hold(i, corner, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what ``corner`` of box ``i`` lies on."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns, holds, needed = problem[2], problem[3], problem[6], problem[9][1][i]
    count = len(sizes)
    own = sizes[i, node[5][i]]
    if not problem[15][i]:  # wholly on the only one that can hold it
        for k in range(count):
            for t in range(turns[k]):
                if holds[i, k] and node[5][k] in (EITHER, t):
                    apart = nodes[2][_on(i, k, t, node, nodes, counters)]
                    for axis in range(2):
                        relate(apart, axis, k, i, own[axis] - sizes[k, t, axis])
        return
    free = 0
    for c in range(4):
        free += int(node[4][i, c] == NOTHING)
    off = (0 if corner % 2 == 0 else own[0] - 1, 0 if corner < 2 else own[1] - 1)
    if free < 4 - needed:
        new = _child(nodes, counters)
        nodes[4][new, i, corner] = NOTHING
        nodes[11][new, i] = True
    new = _child(nodes, counters)
    nodes[4][new, i, corner] = PLACED
    nodes[11][new, i] = True
    for k in range(count):
        for t in range(turns[k]):
            if not holds[i, k] or node[5][k] not in (EITHER, t):
                continue
            new = _on(i, k, t, node, nodes, counters)
            nodes[4][new, i, corner] = ON + k
            for axis in range(2):
                relate(nodes[2][new], axis, i, k, -off[axis])
                relate(nodes[2][new], axis, k, i, off[axis] + 1 - sizes[k, t, axis])


@compiled
def loose(problem, node):  # type: ignore[no-untyped-def]
    """A box that touches nothing along an axis, and the axis; (-1, -1): none."""
    rows, sizes, beside = problem[1], problem[2], problem[7]
    touch, place = node[9], node[7]
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


@compiled
def attach(i, axis, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what box ``i`` touches along ``axis``."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns = problem[2], problem[3]
    own = sizes[i, node[5][i], axis]
    for k in range(len(sizes)):
        for t in range(turns[k]):
            if k == i or (node[5][k] != EITHER and node[5][k] != t):
                continue
            for extent in (sizes[k, t, axis], -own):
                new = _child(nodes, counters)
                nodes[5][new, k] = t
                nodes[9][new, i, axis] = 2
                nodes[11][new, i] = nodes[11][new, k] = True
                relate(nodes[2][new], axis, i, k, extent)
                relate(nodes[2][new], axis, k, i, -extent)
    new = _child(nodes, counters)
    nodes[9][new, i, axis] = 1
    nodes[11][new, i] = True


@compiled
def around(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the ranges of some box around its place, which it may keep; none if all are fixed."""
    lo, hi, place = node[0], node[1], node[7]
    for i in range(len(lo)):
        if _turned(i, node, nodes, counters):
            return
        if lo[i, 0] == hi[i, 0] and lo[i, 1] == hi[i, 1]:
            continue
        for axis in range(2):
            at = place[i, axis]
            for below in (True, False):
                new = _child(nodes, counters)
                nodes[11][new, i] = True
                for e in range(axis):
                    nodes[0][new, i, e] = nodes[1][new, i, e] = place[i, e]
                if below:
                    nodes[1][new, i, axis] = at - 1
                else:
                    nodes[0][new, i, axis] = at + 1
        new = _child(nodes, counters)
        nodes[11][new, i] = True
        for axis in range(2):
            nodes[0][new, i, axis] = nodes[1][new, i, axis] = place[i, axis]
        return
