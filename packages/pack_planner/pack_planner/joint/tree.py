"""Compiled: best-first branch and bound over what the boxes of a look-ahead must avoid.

A node restricts each box to some of its entries. Its bound is the sum over the boxes of the
cheapest entry they are still allowed, each on its own. The cheapest open node is taken first.

``overlap``
    Two boxes of the node meet. No two boxes can both contain a point they share, so either the
    one or the other must leave it out: two children, each dearer by up to the depth of the overlap
    (the point is chosen at its far upper end). This is conflict-based search (Sharon, Stern,
    Felner, Sturtevant 2015) with boxes for agents and points for crossings.
``nothing under it``
    A box leans on air at height z of a bin. Either it does not lean at z there, or it does, and
    then some other box has its top there: one child for each. When such a carrier is known and
    still not under the box, one child for each entry of the carrier.
    Once its known carriers are fixed, it stands on them, or yet another box carries it too.
``neither``
    The node is a joint solution, and as the cheapest open node an optimal one.

Entries of a box are sorted by cost, and restrictions only grow from a node to its children, so the
cheapest allowed entry is looked for from the parent's on.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.cheapest import lies_on, rests_on
from pack_planner.joint.nodes import (
    AVOID,
    EPS,
    FIXED,
    LEVEL,
    MAX_AVOID,
    NOT_AT,
    OPEN,
    WITHOUT,
    child_of,
    evaluate,
    is_fixed,
    keep,
    next_entry,
    pop,
    push,
    total,
    volume_of,
)  # fmt: skip

#: Why the search returns.
PROVEN, PAUSED, SOLUTION, FULL = 0, 1, 2, 3

#: How many entries of a carrier are looked at in one go.
_SPREAD = 256


@njit(cache=True, nogil=True)
def _depth(a, b, out):  # type: ignore[no-untyped-def]
    """Least extent of the space two volumes share (0 if none); its far upper point into ``out``."""
    if a[0] != b[0]:
        return 0
    least = np.int64(1 << 40)
    for axis in range(1, 4):
        high = min(a[axis + 3], b[axis + 3])
        extent = high - max(a[axis], b[axis])
        if extent <= 0:
            return 0
        least = min(least, extent)
        out[axis] = high
    out[0] = a[0]
    return least


@njit(cache=True, nogil=True)
def _leave_out(node, box, point, tree, problem, space, counters, bound):  # type: ignore[no-untyped-def]
    """A child in which ``box`` leaves out the cell before ``point``, not yet kept; -1: hopeless."""
    if is_fixed(tree, node, box):
        return np.int64(-1)
    step = problem[7][0]
    child = child_of(tree, node, counters)
    row = tree[2][child]
    row[0], row[1], row[2] = AVOID, box, point[0]
    row[3], row[4], row[5] = point[1] - step, point[2] - step, point[3] - 1
    row[6:9] = point[1:4]
    if evaluate(child, box, tree, problem, space, bound):
        return child
    return np.int64(-1)


@njit(cache=True, nogil=True)
def _part(node, volumes, tree, problem, space, state, bound):  # type: ignore[no-untyped-def]
    """Split on two boxes that meet: either leaves out the far upper cell of what they share.

    Of all such pairs, the one whose cheaper child is dearest, then whose other child is.
    False if no boxes meet.
    """
    heap, counters = state
    lb = tree[0]
    point, best_point = np.empty(4, np.int64), np.empty(4, np.int64)
    # plain numbers here would be constants, for which all that is called is compiled once more
    one, two = np.int64(-1), np.int64(-1)
    best, best_other = -1.0, -1.0
    for i in range(len(volumes)):
        for k in range(i + 1, len(volumes)):
            if _depth(volumes[i], volumes[k], point) == 0:
                continue
            child = _leave_out(node, i, point, tree, problem, space, counters, bound)
            low = bound if child < 0 else lb[child]
            child = _leave_out(node, k, point, tree, problem, space, counters, bound)
            high = bound if child < 0 else lb[child]
            low, high = min(low, high), max(low, high)
            if low > best + EPS or (low > best - EPS and high > best_other + EPS):
                best, best_other, one, two = low, high, i, k
                best_point[:] = point
    if one < 0:
        return False
    for i in (one, two):
        child = _leave_out(node, i, best_point, tree, problem, space, counters, bound)
        if child >= 0:
            keep(child, tree, heap, counters)
    return True


@njit(cache=True, nogil=True)
def _spread(node, carrier, upper, tree, problem, space, state, bound):  # type: ignore[no-untyped-def]
    """One child for each entry of ``carrier``, fixed there, with ``upper`` on it."""
    restriction, pick, cost, on = tree[2], tree[3], tree[4], tree[6]
    order, fixes, kind = tree[7], tree[8], tree[11]
    entries, costs = problem[0], problem[1]
    rule = problem[7]
    heap, counters = state
    others = total(cost[node]) - cost[node, carrier]
    index = pick[node, carrier]
    upper_fixed = is_fixed(tree, node, upper)
    volume = np.empty(7, np.int64)
    for made in range(_SPREAD + 1):
        index = next_entry(node, carrier, index, tree, problem, space, bound - others)
        if index < 0:
            return
        if made == _SPREAD:
            # the rest later, when it is the cheapest
            pick[node, carrier] = index
            cost[node, carrier] = costs[index]
            tree[0][node] = max(tree[0][node], others + costs[index])
            counters[0] = push(heap, counters[0], tree[0], node)
            return
        volume_of(entries[index], volume)
        if not upper_fixed or lies_on(entries[pick[node, upper]], volume, rule[1]):
            child = child_of(tree, node, counters)
            kind[child] = FIXED
            restriction[child, 2] = carrier
            restriction[child, 3] = upper
            pick[child, carrier] = index
            cost[child, carrier] = costs[index]
            order[child, fixes[node]] = carrier
            fixes[child] = fixes[node] + 1
            on[child, upper] = carrier
            tree[0][child] = max(tree[0][node], others + costs[index])
            keep(child, tree, heap, counters)
        index += 1


@njit(cache=True, nogil=True)
def _settle(node, volumes, tree, problem, space, bound):  # type: ignore[no-untyped-def]
    """Evaluate the other boxes of a node in which one was just fixed; False if hopeless."""
    entries = problem[0]
    carrier, upper = tree[2][node, 2], tree[2][node, 3]
    tree[11][node] = OPEN
    point = np.empty(4, np.int64)
    volume_of(entries[tree[3][node, carrier]], volumes[carrier])
    count = len(volumes)
    for turn in range(count):
        # the box on the carrier first: it is the likeliest to have no place
        i = upper if turn == 0 else (turn - 1 if turn <= upper else turn)
        if is_fixed(tree, node, i):
            continue
        volume_of(entries[tree[3][node, i]], volumes[i])
        if i != upper and _depth(volumes[i], volumes[carrier], point) == 0:
            continue
        if not evaluate(node, i, tree, problem, space, bound):
            return False
    return True


@njit(cache=True, nogil=True)
def _carry(node, box, tree, problem, space, state, bound):  # type: ignore[no-untyped-def]
    """Split on what is under ``box``, which leans on air; see the top of this file."""
    restriction, pick, alone, on, fixes = tree[2], tree[3], tree[5], tree[6], tree[8]
    carriers, level, top = tree[9], tree[12], tree[13]
    entries, tolerance = problem[0], problem[7][1]
    heap, counters = state
    count = len(problem[2]) - 1
    entry = entries[pick[node, box]]
    here = entry[0] * LEVEL + entry[3]
    settled = level[node, box] >= 0 or is_fixed(tree, node, box)
    for m in range(count):
        if carriers[node, box] >> m & 1 and not is_fixed(tree, node, m):
            _spread(node, m, box, tree, problem, space, state, bound)
            return
    if not settled or not is_fixed(tree, node, box):
        child = child_of(tree, node, counters)
        if not settled:
            restriction[child, 0], restriction[child, 1] = NOT_AT, box
            restriction[child, 2] = here
        else:
            alone[child, box] = fixes[node]
        if evaluate(child, box, tree, problem, space, bound):
            keep(child, tree, heap, counters)
    for m in range(count):
        if m == box or carriers[node, box] >> m & 1:
            continue
        below = entries[pick[node, m]]
        gap = entry[3] - below[3] - below[6]
        child = child_of(tree, node, counters)
        level[child, box] = here
        carriers[child, box] |= 1 << m
        if is_fixed(tree, node, m):
            if below[0] != entry[0] or gap < 0 or gap > tolerance:
                continue
            on[child, box] = m
            if not is_fixed(tree, node, box) and not evaluate(
                child, box, tree, problem, space, bound
            ):
                continue
        else:
            if top[node, m] >= 0 and tolerance > 0:
                if top[node, m] // LEVEL != here // LEVEL:
                    continue
                # the windows of both must meet; the lower of the two is the stricter from above
                if abs(top[node, m] - here) > tolerance:
                    continue
                top[child, m] = top[node, m]
            elif top[node, m] >= 0 and top[node, m] != here:
                continue
            else:
                top[child, m] = here
            if not evaluate(child, m, tree, problem, space, bound):
                continue
        keep(child, tree, heap, counters)


@njit(cache=True, nogil=True)
def _fix_one(node, tree, problem, space, state, bound):  # type: ignore[no-untyped-def]
    """A rule about the whole stack is broken: some free box is fixed where it is, or not there."""
    restriction, order, fixes, raised = tree[2], tree[7], tree[8], tree[10]
    heap, counters = state
    for i in range(len(problem[2]) - 1):
        if is_fixed(tree, node, i):
            continue
        child = child_of(tree, node, counters)
        order[child, fixes[node]] = i
        fixes[child] = fixes[node] + 1
        keep(child, tree, heap, counters)
        child = child_of(tree, node, counters)
        restriction[child, 0], restriction[child, 1] = WITHOUT, i
        restriction[child, 2] = tree[3][node, i]
        raised[child] = 1
        if evaluate(child, i, tree, problem, space, bound):
            keep(child, tree, heap, counters)
        return


@njit(cache=True, nogil=True)
def grow(tree, problem, state, bound, budget, rejected):  # type: ignore[no-untyped-def]
    """Search on until something happens.

    Parameters
    ----------
    tree : arrays of the nodes, see :mod:`pack_planner.joint.solve`.
    state : heap and [size of the heap, nodes used, nodes taken].
    bound : objective of the best known solution.
    budget : how many nodes to take at most.
    rejected : a node that SOLUTION was returned for, but which breaks a rule; else -1.

    Returns
    -------
    why, node : one of PROVEN, PAUSED, SOLUTION, FULL, and the node of a SOLUTION.
    """
    lb, pick, kind = tree[0], tree[3], tree[11]
    entries, _, starts, centres, boxes, spans, heights, rule, min_vertices = problem
    heap, counters = state
    count = len(starts) - 1
    space = (
        np.empty((MAX_AVOID + count, 7), np.int64), np.empty(MAX_AVOID, np.int64),
        np.empty((count + 1, 7), np.int64),
    )  # fmt: skip
    volumes = np.empty((count, 7), np.int64)
    room = max(count, _SPREAD) + 4
    while counters[0] > 0 or rejected >= 0:
        if counters[1] + room > len(lb):
            return FULL, -1
        if rejected >= 0:
            _fix_one(rejected, tree, problem, space, state, bound)
            rejected = -1
            continue
        if budget <= 0:
            return PAUSED, -1
        node = heap[0]
        if lb[node] >= bound - EPS:
            counters[0] = 0
            return PROVEN, -1
        counters[0] = pop(heap, counters[0], lb)
        counters[2] += 1
        budget -= 1
        if kind[node] == FIXED:
            if _settle(node, volumes, tree, problem, space, bound):
                counters[0] = push(heap, counters[0], lb, node)
            continue
        for i in range(count):
            volume_of(entries[pick[node, i]], volumes[i])
        if _part(node, volumes, tree, problem, space, state, bound):
            continue
        floating = -1
        for i in range(count):
            entry = entries[pick[node, i]]
            number = entry[0]
            if entry[7] == 1 and not rests_on(
                entry, centres[i, entry[8]], volumes, count, boxes,
                spans[number], spans[number + 1], heights, rule, min_vertices,
            ):  # fmt: skip
                floating = i
                break
        if floating < 0:
            return SOLUTION, node
        _carry(node, floating, tree, problem, space, state, bound)
    return PROVEN, -1
