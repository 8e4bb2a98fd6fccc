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
    nodes[12][new] = node[12]
    return new


@njit(cache=True, nogil=True)
def _relate(apart, axis, i, k, distance):  # type: ignore[no-untyped-def]
    """Box ``i`` lies at least ``distance`` beyond ``k`` along ``axis``."""
    apart[axis, i, k] = max(apart[axis, i, k], distance)


@njit(cache=True, nogil=True)
def part(i, k, costs, rest, problem, node, nodes, counters, upper):  # type: ignore[no-untyped-def]
    """Children in which boxes ``i`` and ``k`` do not meet; the cheapest comes up first."""
    sizes = problem[2]
    base = node[9][0]
    flat = costs.ravel()
    for which in np.argsort(-flat):
        if flat[which] >= HUGE or rest + flat[which] >= upper - EPS:
            continue
        p, q, side = which // 12, which // 6 % 2, which % 6
        axis = side // 2
        new = _child(node, nodes, counters)
        nodes[9][new, 0] = max(base, rest + flat[which])
        nodes[6][new, i], nodes[6][new, k] = p, q
        nodes[12][new, i] = nodes[12][new, k] = True
        apart, apart_known, may = nodes[2][new], nodes[3][new], nodes[4][new]
        apart_known[i, k] = apart_known[k, i] = True
        a, b, ta, tb = (i, k, p, q) if side % 2 == 0 else (k, i, q, p)
        _relate(apart, axis, b, a, sizes[a, ta, axis])
        may[a, b] = False
        if axis < 2:
            may[b, a] = False
        for e in range(axis):
            _relate(apart, e, a, b, 1 - sizes[a, ta, e])
            _relate(apart, e, b, a, 1 - sizes[b, tb, e])


@njit(cache=True, nogil=True)
def broken(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the range of a box whose place breaks a relation; False if all hold."""
    apart, place = node[2], node[8]
    count = len(place)
    for axis in range(3):
        for i in range(count):
            for k in range(count):
                d = apart[axis, i, k]
                if d == NONE or place[i, axis] >= place[k, axis] + d:
                    continue
                cut = place[i, axis] - d
                new = _child(node, nodes, counters)
                nodes[0][new, k, axis] = cut + 1
                nodes[12][new, k] = True
                new = _child(node, nodes, counters)
                nodes[1][new, k, axis] = cut
                nodes[12][new, k] = True
                return True
    return False


@njit(cache=True, nogil=True)
def hanging(problem, node):  # type: ignore[no-untyped-def]
    """A box with too few corners on something, and a corner of it to decide on; (-1, -1): none."""
    height, sizes = problem[4], problem[2]
    tolerance, needed = problem[9]
    corner, place = node[5], node[8]
    count = len(place)
    for i in range(count):
        x, y, z, t = place[i]
        if z == 0:
            continue
        good, open_corner = 0, -1
        for c in range(4):
            a = x if c % 2 == 0 else x + sizes[i, t, 0] - 1
            b = y if c < 2 else y + sizes[i, t, 1] - 1
            rests = height[a, b] > 0 and height[a, b] >= z - tolerance
            for k in range(count):
                below = sizes[k, place[k, 3]]
                if (
                    k != i
                    and 0 <= z - place[k, 2] - below[2] <= tolerance
                    and place[k, 0] <= a < place[k, 0] + below[0]
                    and place[k, 1] <= b < place[k, 1] + below[1]
                ):
                    rests = True
            if rests:
                good += 1
            elif corner[i, c] == OPEN and open_corner < 0:
                open_corner = c
        if good < needed:
            return i, open_corner
    return -1, -1


@njit(cache=True, nogil=True)
def _turned(i, node, nodes, counters):  # type: ignore[no-untyped-def]
    """One child for each turn of box ``i``; False if it has one only."""
    if node[6][i] != EITHER:
        return False
    chosen = node[8][i, 3]
    for t in (1 - chosen, chosen):
        new = _child(node, nodes, counters)
        nodes[6][new, i] = t
        nodes[12][new, i] = True
    return True


@njit(cache=True, nogil=True)
def hold(i, corner, problem, node, nodes, counters):  # type: ignore[no-untyped-def]
    """Children that say what ``corner`` of box ``i`` lies on."""
    if _turned(i, node, nodes, counters):
        return
    sizes, turns = problem[2], problem[3]
    tolerance, needed = problem[9]
    count = len(sizes)
    free = 0
    for c in range(4):
        free += int(node[5][i, c] == NOTHING)
    own = sizes[i, node[6][i]]
    off = (0 if corner % 2 == 0 else own[0] - 1, 0 if corner < 2 else own[1] - 1)
    if free < 4 - needed:
        new = _child(node, nodes, counters)
        nodes[5][new, i, corner] = NOTHING
        nodes[12][new, i] = True
    new = _child(node, nodes, counters)
    nodes[5][new, i, corner] = PLACED
    nodes[12][new, i] = True
    for k in range(count):
        if k == i or not node[4][i, k]:
            continue
        for t in range(turns[k]):
            if node[6][k] != EITHER and node[6][k] != t:
                continue
            new = _child(node, nodes, counters)
            nodes[5][new, i, corner] = ON + k
            nodes[12][new, i] = nodes[12][new, k] = True
            nodes[6][new, k] = t
            nodes[3][new, i, k] = nodes[3][new, k, i] = True
            nodes[4][new, k, i] = False
            apart = nodes[2][new]
            _relate(apart, 2, i, k, sizes[k, t, 2])
            _relate(apart, 2, k, i, -sizes[k, t, 2] - tolerance)
            for axis in range(2):
                _relate(apart, axis, i, k, -off[axis])
                _relate(apart, axis, k, i, off[axis] + 1 - sizes[k, t, axis])


@njit(cache=True, nogil=True)
def loose(problem, node):  # type: ignore[no-untyped-def]
    """A box that touches nothing along an axis, and the axis; (-1, -1): none."""
    sizes, beside = problem[2], problem[7]
    touch, place = node[10], node[8]
    count = len(place)
    for i in range(count):
        t = place[i, 3]
        for axis in range(2):
            at = place[i, axis]
            if touch[i, axis] == 2 or beside[i, t, axis, at]:
                continue
            good = False
            for k in range(count):
                if k != i and (
                    at == place[k, axis] + sizes[k, place[k, 3], axis]
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
    own = sizes[i, node[6][i], axis]
    for k in range(len(sizes)):
        for t in range(turns[k]):
            if k == i or (node[6][k] != EITHER and node[6][k] != t):
                continue
            for extent in (sizes[k, t, axis], -own):
                new = _child(node, nodes, counters)
                nodes[6][new, k] = t
                nodes[10][new, i, axis] = 2
                nodes[12][new, i] = nodes[12][new, k] = True
                _relate(nodes[2][new], axis, i, k, extent)
                _relate(nodes[2][new], axis, k, i, -extent)
    new = _child(node, nodes, counters)
    nodes[10][new, i, axis] = 1
    nodes[12][new, i] = True


@njit(cache=True, nogil=True)
def around(node, nodes, counters):  # type: ignore[no-untyped-def]
    """Cut the ranges of some box around its place, which it may keep; none if all are fixed."""
    lo, hi, place = node[0], node[1], node[8]
    for i in range(len(lo)):
        if _turned(i, node, nodes, counters):
            return
        if lo[i, 0] == hi[i, 0] and lo[i, 1] == hi[i, 1] and hi[i, 2] <= place[i, 2]:
            continue
        for axis in range(3):
            at = place[i, axis]
            for below in (True, False):
                new = _child(node, nodes, counters)
                nodes[12][new, i] = True
                for e in range(axis):
                    nodes[0][new, i, e] = nodes[1][new, i, e] = place[i, e]
                if below:
                    nodes[1][new, i, axis] = at - 1
                else:
                    nodes[0][new, i, axis] = at + 1
        new = _child(node, nodes, counters)
        nodes[12][new, i] = True
        for axis in range(3):
            nodes[0][new, i, axis] = nodes[1][new, i, axis] = place[i, axis]
        return
