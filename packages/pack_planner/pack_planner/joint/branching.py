"""Compiled: the children of a node of :mod:`.relations`, by what is wrong with it."""

from __future__ import annotations

import numpy as np
from numba import njit

#: No relation.
NONE = -(1 << 29)
#: More than any cost.
HUGE = 1e18
EPS = 1e-6
#: State of a corner: not decided, on a placed box, on nothing, 3 + k: on box k.
OPEN, PLACED, NOTHING, ON = 0, 1, 2, 3
#: Both turns are left.
EITHER = 2


@njit(cache=True, nogil=True)
def _child(node, nodes, counters):  # type: ignore[no-untyped-def]
    """A copy of ``node`` on top of the stack."""
    new = counters[0]
    counters[0] = new + 1
    nodes[0][new] = node[0]
    nodes[1][new] = node[1]
    nodes[2][new] = node[2]
    nodes[3][new] = node[3]
    nodes[4][new] = node[4]
    nodes[5][new] = node[5]
    nodes[6][new] = node[6]
    nodes[7][new] = node[7]
    nodes[8][new] = node[8]
    nodes[9][new] = node[9]
    nodes[10][new] = node[10]
    nodes[11][new] = node[11]
    return new


@njit(cache=True, nogil=True)
def relate(apart, axis, i, k, distance):  # type: ignore[no-untyped-def]
    """Box ``i`` lies at least ``distance`` beyond ``k`` along ``axis``."""
    apart[axis, i, k] = max(apart[axis, i, k], distance)


@njit(cache=True, nogil=True)
def part(i, k, costs, rest, problem, node, nodes, counters, upper):  # type: ignore[no-untyped-def]
    """Children in which boxes ``i`` and ``k`` do not meet; the cheapest comes up first."""
    sizes = problem[2]
    base = node[8][0]
    flat = costs.ravel()
    for which in np.argsort(-flat):
        if flat[which] >= HUGE or rest + flat[which] >= upper - EPS:
            continue
        p, q, side = which // 8, which // 4 % 2, which % 4
        axis = side // 2
        new = _child(node, nodes, counters)
        nodes[8][new, 0] = max(base, rest + flat[which])
        nodes[5][new, i], nodes[5][new, k] = p, q
        nodes[11][new, i] = nodes[11][new, k] = True
        apart, known = nodes[2][new], nodes[3][new]
        known[i, k] = known[k, i] = True
        a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
        relate(apart, axis, b, a, sizes[a, ta, axis])
        if axis == 1:
            relate(apart, 0, a, b, 1 - sizes[a, ta, 0])
            relate(apart, 0, b, a, 1 - sizes[b, tb, 0])


@njit(cache=True, nogil=True)
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
                new = _child(node, nodes, counters)
                nodes[0][new, k, axis] = cut + 1
                nodes[11][new, k] = True
                new = _child(node, nodes, counters)
                nodes[1][new, k, axis] = cut
                nodes[11][new, k] = True
                return True
    return False


@njit(cache=True, nogil=True)
def rests(a, b, height, base, tolerance):  # type: ignore[no-untyped-def]
    """Whether a placed box is right under ``base`` at the cell (a, b)."""
    return height[a, b] > 0 and base - tolerance <= height[a, b] <= base


@njit(cache=True, nogil=True)
def hanging(problem, node):  # type: ignore[no-untyped-def]
    """A box with too few corners on something, and a corner of it to decide on; (-1, -1): none."""
    sizes, leans, holds = problem[2], problem[5], problem[6]
    height, (tolerance, needed), bases = problem[8], problem[9], problem[11]
    corner, place = node[4], node[7]
    count = len(place)
    for i in range(count):
        if not leans[i]:
            continue
        x, y, t = place[i]
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
        if good < needed:
            return i, open_corner
    return -1, -1


@njit(cache=True, nogil=True)
def _turned(i, node, nodes, counters):  # type: ignore[no-untyped-def]
    """One child for each turn of box ``i``; False if it has one only."""
    if node[5][i] != EITHER:
        return False
    chosen = node[7][i, 2]
    for t in (1 - chosen, chosen):
        new = _child(node, nodes, counters)
        nodes[5][new, i] = t
        nodes[11][new, i] = True
    return True


@njit(cache=True, nogil=True)
def _on(i, k, t, node, nodes, counters):  # type: ignore[no-untyped-def]
    """A child in which box ``k``, turned ``t``, is under box ``i``; its number."""
    new = _child(node, nodes, counters)
    nodes[11][new, i] = nodes[11][new, k] = True
    nodes[5][new, k] = t
    return new


@njit(cache=True, nogil=True)
def hold(i, corner, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what ``corner`` of box ``i`` lies on."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns, holds, needed = problem[2], problem[3], problem[6], problem[9][1]
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
        new = _child(node, nodes, counters)
        nodes[4][new, i, corner] = NOTHING
        nodes[11][new, i] = True
    new = _child(node, nodes, counters)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
                new = _child(node, nodes, counters)
                nodes[5][new, k] = t
                nodes[9][new, i, axis] = 2
                nodes[11][new, i] = nodes[11][new, k] = True
                relate(nodes[2][new], axis, i, k, extent)
                relate(nodes[2][new], axis, k, i, -extent)
    new = _child(node, nodes, counters)
    nodes[9][new, i, axis] = 1
    nodes[11][new, i] = True


@njit(cache=True, nogil=True)
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
                new = _child(node, nodes, counters)
                nodes[11][new, i] = True
                for e in range(axis):
                    nodes[0][new, i, e] = nodes[1][new, i, e] = place[i, e]
                if below:
                    nodes[1][new, i, axis] = at - 1
                else:
                    nodes[0][new, i, axis] = at + 1
        new = _child(node, nodes, counters)
        nodes[11][new, i] = True
        for axis in range(2):
            nodes[0][new, i, axis] = nodes[1][new, i, axis] = place[i, axis]
        return
