"""Compiled: what a box costs at least within the ranges of a node, where its base can be held up.

A box that leans needs corners on placed boxes or on other boxes of the group, wherever their ranges
let them be: optimistic, so that the least cost is a bound. Arrays as in :mod:`.group_problem`;
inner functions take them one by one, since a tuple of them is copied in each call.
"""

from __future__ import annotations

import numpy as np

from pack_planner.joint.bin_by_bin.branching import EITHER, HUGE, NOTHING, ON, PLACED, rests
from pack_planner.joint.bin_by_bin.places import FAR
from pack_planner.joint.bounds import NEVER
from pack_planner.joint.compiled import uncounted

#: What the corners of a doubtful box may lie on; at least three on boxes of the group.
ON_ANYTHING, ON_BOXES = 1, 2


@uncounted
def _held(  # type: ignore[no-untyped-def]
    i, wide, deep, x, y, under, corner, lo, far, height, base, tolerance, needed
):
    """Whether enough corners of box ``i`` can be held up at (x, y).

    ``far`` is where each box ends at most, ``under`` which may lie under this one.
    """
    held, helped = 0, False
    for c in range(4):
        what = corner[i, c]
        if what == NOTHING:
            continue
        a = x if c % 2 == 0 else x + wide - 1
        b = y if c < 2 else y + deep - 1
        if what < NOTHING and rests(a, b, height, base, tolerance):
            held += 1
            continue
        if what == PLACED:
            return False
        good = False
        for k in range(len(lo)):
            if (
                under[k]
                and (what < ON or what - ON == k)
                and lo[k, 0] <= a < far[k, 0]
                and lo[k, 1] <= b < far[k, 1]
            ):
                good = True
                break
        if good:
            held += 1
            helped = True
        elif what >= ON:
            return False
    if held < needed[i]:
        return False
    for k in range(len(lo)):
        helped = helped or (
            under[k]
            and lo[k, 0] < x + wide
            and lo[k, 1] < y + deep
            and x < far[k, 0]
            and y < far[k, 1]
        )
    return helped


@uncounted
def farthest(cap, flat, w1):  # type: ignore[no-untyped-def]
    """The most that x + y can be at a cost below ``cap``."""
    return np.int64(np.ceil((cap - flat) / w1)) - 1 if w1 > 0 else np.int64(NEVER)


@uncounted
def nearest(after, near, row, x0, x1, y0, y1, far, w1):  # type: ignore[no-untyped-def]
    """The (x, y) of least x + y in a window, at most ``far``, among the places of a row.

    (-1, -1) for none; any of them where position costs nothing.
    """
    best = (-1, -1)
    x, y = np.int64(near[row, y0, x0, 0]), np.int64(near[row, y0, x0, 1])
    if x == FAR or x + y > far:
        return best
    if x <= x1 and y <= y1:
        return x, y
    for x in range(x0, x1 + 1):
        last = min(y1, far - x)
        if last < y0:
            break
        y = np.int64(after[row, y0, x])
        if y <= last:
            best = (x, y)
            if w1 <= 0:
                break
            far = x + y - 1
    return best


@uncounted
def plain_cost(after, near, row, flat, w1, x0, x1, y0, y1, cap):  # type: ignore[no-untyped-def]
    """:func:`least_cost` of a box that needs neither a hold nor contact, without the tuples."""
    x, y = nearest(after, near, row, x0, x1, y0, y1, farthest(cap, flat, w1), w1)
    return flat + w1 * (x + y) if x >= 0 else cap


@uncounted
def is_plain(i, problem, node):  # type: ignore[no-untyped-def]
    """Whether any open place will do for box ``i``, held up and in contact as it is."""
    return not (problem.doubtful[i] or node.touch[i, 0] == 1 or node.touch[i, 1] == 1)


@uncounted
def _ends(sizes, hi, turn, farthest_ends):  # type: ignore[no-untyped-def]
    """Where each box ends at most, into ``farthest_ends``."""
    for k in range(len(hi)):
        for axis in range(2):
            size = sizes[k, 0 if turn[k] == EITHER else turn[k], axis]
            if turn[k] == EITHER:
                size = max(size, sizes[k, 1, axis])
            farthest_ends[k, axis] = hi[k, axis] + size


@uncounted
def stays(i, problem, node):  # type: ignore[no-untyped-def]
    """Whether the place found last for box ``i`` still is one."""
    lo, hi, turn = node.low, node.high, node.turn
    x, y, t = node.place[i, 0], node.place[i, 1], node.place[i, 2]
    if x < lo[i, 0] or x > hi[i, 0] or y < lo[i, 1] or y > hi[i, 1]:
        return False
    if turn[i] != EITHER and turn[i] != t:
        return False
    beside, row = problem.beside, problem.rows[i, t]
    for axis, at in ((0, x), (1, y)):
        if node.touch[i, axis] == 1 and not beside[row, axis, at]:
            return False
    if not problem.doubtful[i]:
        return True
    sizes, ends = problem.sizes, node.ends
    _ends(sizes, hi, turn, ends)
    return _held(
        i, sizes[i, t, 0], sizes[i, t, 1], x, y, problem.under[i], node.corner, lo, ends,
        problem.height, problem.base[i], problem.tolerance, problem.needed,
    )  # fmt: skip


@uncounted
def _nearest_held(i, t, problem, node, window, far):  # type: ignore[no-untyped-def]
    """:func:`nearest` among the places where box ``i`` can be held up and touches something."""
    after, near, row, sizes = problem.after, problem.near, problem.rows[i, t], problem.sizes
    under, beside, height = problem.under[i], problem.beside, problem.height
    tolerance, needed = problem.tolerance, problem.needed
    w1, base, doubtful = problem.w1, problem.base[i], problem.doubtful[i]
    lo, hi, corner, turn = node.low, node.high, node.corner, node.turn
    along_x, along_y = node.touch[i, 0] == 1, node.touch[i, 1] == 1
    wide, deep = sizes[i, t, 0], sizes[i, t, 1]
    x0, x1, y0, y1 = window
    ends = node.ends
    if doubtful:
        _ends(sizes, hi, turn, ends)
        first_x, first_y, last_x, last_y = NEVER, NEVER, -1, -1
        for k in range(len(hi)):
            if under[k]:
                first_x, last_x = min(first_x, lo[k, 0]), max(last_x, ends[k, 0])
                first_y, last_y = min(first_y, lo[k, 1]), max(last_y, ends[k, 1])
        in_x, in_y = (wide, deep) if doubtful == ON_BOXES else (1, 1)
        x0, x1 = max(x0, first_x + in_x - wide), min(x1, last_x - in_x)
        y0, y1 = max(y0, first_y + in_y - deep), min(y1, last_y - in_y)
    best = (-1, -1)
    if x0 > x1 or y0 > y1 or np.int64(near[row, y0, x0, 0]) + near[row, y0, x0, 1] > far:
        return best
    for x in range(x0, x1 + 1):
        last = min(y1, far - x)
        if last < y0:
            break
        if along_x and not beside[row, 0, x]:
            continue
        y = y0
        while y <= last:
            y = np.int64(after[row, y, x])
            if y > last:
                break
            good = not along_y or beside[row, 1, y]
            if good and doubtful:
                good = _held(
                    i, wide, deep, x, y, under, corner, lo, ends, height, base, tolerance, needed
                )
            if good:
                best = (x, y)
                break
            y += 1
        if best[0] == x:
            if w1 <= 0:
                break
            far = x + y - 1
    return best


@uncounted
def scan(i, problem, node, cap, spot):  # type: ignore[no-untyped-def]
    """Cost of the cheapest place of box ``i`` below ``cap``, 1e18 if there is none.

    The place (x, y, turn) goes into ``spot``. A turn without a place is struck off. The least
    costs of the turns go into the node; 1e18 stands for none below ``cap``.
    """
    turns, flat, w1 = problem.turns[i], problem.flat[i], problem.w1
    turn, least = node.turn, node.least[i]
    far = farthest(cap, flat, w1)
    window = (node.low[i, 0], node.high[i, 0], node.low[i, 1], node.high[i, 1])
    plain = is_plain(i, problem, node)
    best, possible = HUGE, 0
    for t in range(turns):
        least[t] = HUGE
        if turn[i] != EITHER and turn[i] != t:
            continue
        if plain:
            x0, x1, y0, y1 = window
            x, y = nearest(problem.after, problem.near, problem.rows[i, t], x0, x1, y0, y1, far, w1)
        else:
            x, y = _nearest_held(i, t, problem, node, window, far)
        if x < 0:
            continue
        possible += 1 + t
        least[t] = flat + w1 * (x + y)
        if least[t] < best:
            best = least[t]
            spot[0], spot[1], spot[2] = x, y, t
    if turn[i] == EITHER and 0 < possible < 3:
        turn[i] = possible - 1
    return best


@uncounted
def least_cost(i, t, problem, node, window, cap):  # type: ignore[no-untyped-def]
    """The least that box ``i``, turned ``t``, costs in a window (x0, x1, y0, y1).

    ``cap`` if nothing there costs less.
    """
    flat, w1 = problem.flat[i], problem.w1
    if is_plain(i, problem, node):
        x0, x1, y0, y1 = window
        return plain_cost(
            problem.after, problem.near, problem.rows[i, t], flat, w1, x0, x1, y0, y1, cap
        )
    x, y = _nearest_held(i, t, problem, node, window, farthest(cap, flat, w1))
    return flat + w1 * (x + y) if x >= 0 else cap
