"""Compiled: best-first branch and bound over what the boxes of a look-ahead must avoid.

A node restricts each box: volumes it must not meet, what it may rest on, or a fixed position. Its
bound is the sum over the boxes of the cheapest entry they are still allowed, each on its own.
The cheapest open node is taken first.

``overlap``
    Two boxes of the node meet. No two boxes can both contain a point they share, so either the
    one or the other must leave it out: two children, each dearer by up to the depth of the overlap
    (the point is chosen at its far upper end). This is conflict-based search (Sharon, Stern,
    Felner, Sturtevant 2015) with boxes for agents and points for crossings.
``nothing under it``
    A box leans on air. Either it stands on placed and fixed boxes, or it depends on free ones.
    Then some free box carries a dependent one; take the lowest such carrier k and a box j on it:
    k stands on placed and fixed boxes alone, since all that carries it is lower. One child for
    each pair (k, j), which is split further over every position of k. Carriers are fixed
    lowest first, so no set of them comes up in two orders.
``neither``
    The node is a joint solution, and as the cheapest open node an optimal one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.cheapest import next_height, rests_on

EPS = 1e-6

#: Kinds of node: evaluated, pair still to be split, carrier fixed but the others not evaluated.
OPEN, PAIR, FIXED = 0, 1, 2
#: Kinds of restriction that a node adds to its parent's.
NOTHING, AVOID, RAISE = 0, 1, 2
#: Why the search returns.
PROVEN, PAUSED, SOLUTION, FULL = 0, 1, 2, 3

_MAX_AVOID = 256


@njit(cache=True, nogil=True)
def _before(lb, a, b):  # type: ignore[no-untyped-def]
    return lb[a] < lb[b] or (lb[a] == lb[b] and a > b)


@njit(cache=True, nogil=True)
def push(heap, size, lb, node):  # type: ignore[no-untyped-def]
    """Add ``node``; returns the new size."""
    at = size
    heap[at] = node
    while at > 0:
        up = (at - 1) // 2
        if not _before(lb, heap[at], heap[up]):
            break
        heap[at], heap[up] = heap[up], heap[at]
        at = up
    return size + 1


@njit(cache=True, nogil=True)
def pop(heap, size, lb):  # type: ignore[no-untyped-def]
    """Move the cheapest node to ``heap[size - 1]``; returns the new size."""
    size -= 1
    heap[0], heap[size] = heap[size], heap[0]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            return size
        if child + 1 < size and _before(lb, heap[child + 1], heap[child]):
            child += 1
        if not _before(lb, heap[child], heap[at]):
            return size
        heap[at], heap[child] = heap[child], heap[at]
        at = child


@njit(cache=True, nogil=True)
def volume_of(entry, z, out):  # type: ignore[no-untyped-def]
    """Write (bin, x0, y0, z0, x1, y1, z1) of a box at ``entry``, base at ``z``."""
    out[0], out[1], out[2], out[3] = entry[0], entry[1], entry[2], z
    out[4], out[5], out[6] = entry[1] + entry[4], entry[2] + entry[5], z + entry[6]


@njit(cache=True, nogil=True)
def _restrictions(node, box, tree, problem, avoid, fixed):  # type: ignore[no-untyped-def]
    """Gather what ``box`` must avoid and the fixed boxes; returns (avoided, fixed count)."""
    parent, restriction, pick, height, order, fixes = (
        tree[1], tree[2], tree[3], tree[4], tree[8], tree[9],
    )  # fmt: skip
    entries = problem[0]
    count = fixes[node]
    for k in range(count):
        which = order[node, k]
        volume_of(entries[pick[node, which]], height[node, which], fixed[k])
        avoid[k] = fixed[k]
    avoided = count
    at = node
    while at >= 0 and avoided < _MAX_AVOID:
        if restriction[at, 0] == AVOID and restriction[at, 1] == box:
            avoid[avoided] = restriction[at, 2:9]
            avoided += 1
        at = parent[at]
    return avoided, count


@njit(cache=True, nogil=True)
def _least_height(node, box, entry, tree):  # type: ignore[no-untyped-def]
    """How high RAISE restrictions of the node's ancestors force this entry of ``box``."""
    parent, restriction = tree[1], tree[2]
    least = -1
    at = node
    while at >= 0:
        if (
            restriction[at, 0] == RAISE
            and restriction[at, 1] == box
            and restriction[at, 2] == entry
        ):
            least = max(least, restriction[at, 3])
        at = parent[at]
    return least


@njit(cache=True, nogil=True)
def evaluate(node, box, tree, problem, avoid, fixed, limit):  # type: ignore[no-untyped-def]
    """Find the cheapest allowed entry of ``box`` and write it into the node; False if none."""
    pick, height, cost, alone, on, order = tree[3], tree[4], tree[5], tree[6], tree[7], tree[8]
    leaning, raised = tree[10], tree[11]
    (entries, costs, starts, centres, boxes, spans, heights, bin_sizes, rule, min_vertices,
     zones, zone_spans, radius, weights) = problem  # fmt: skip
    avoided, count = _restrictions(node, box, tree, problem, avoid, fixed)
    row = -1
    for k in range(count):
        if order[node, k] == on[node, box]:
            row = k
    own_zones = zones[zone_spans[box] : zone_spans[box + 1]]
    best = limit
    found = -1
    for index in range(starts[box], starts[box + 1]):
        if costs[index] >= best - EPS:
            break
        entry = entries[index]
        least = -1
        if raised[node]:
            least = _least_height(node, box, index, tree)
        z = next_height(
            entry, centres[box, entry[8]], least, alone[node, box], fixed, row,
            leaning[node, box], avoid, avoided, own_zones, radius,
            boxes, spans, heights, bin_sizes, rule, min_vertices,
        )  # fmt: skip
        if z < 0:
            continue
        value = costs[index] + weights[1] * (z - entry[3])
        if value < best - EPS:
            best = value
            found = index
            height[node, box] = z
    if found < 0:
        return False
    pick[node, box] = found
    cost[node, box] = best
    return True


@njit(cache=True, nogil=True)
def _copy(tree, source, target):  # type: ignore[no-untyped-def]
    lb, parent, restriction, pick, height, cost, alone, on, order, fixes, leaning, raised, _ = tree
    lb[target] = lb[source]
    parent[target] = source
    restriction[target, 0] = NOTHING
    pick[target] = pick[source]
    height[target] = height[source]
    cost[target] = cost[source]
    alone[target] = alone[source]
    on[target] = on[source]
    order[target] = order[source]
    fixes[target] = fixes[source]
    leaning[target] = leaning[source]
    raised[target] = raised[source]


@njit(cache=True, nogil=True)
def _is_fixed(tree, node, box):  # type: ignore[no-untyped-def]
    for k in range(tree[9][node]):
        if tree[8][node, k] == box:
            return True
    return False


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
def _sum(values):  # type: ignore[no-untyped-def]
    total = 0.0
    for value in values:
        total += value
    return total


@njit(cache=True, nogil=True)
def _worst_overlap(node, count, volumes, tree, point):  # type: ignore[no-untyped-def]
    """The pair of boxes that overlap most deeply, (-1, -1) if none do; its far point."""
    trial = np.empty(4, np.int64)
    deepest, one, two = 0, -1, -1
    for i in range(count):
        for k in range(i + 1, count):
            depth = _depth(volumes[i], volumes[k], trial)
            if depth > deepest:
                deepest, one, two = depth, i, k
                point[:] = trial
    return one, two


@njit(cache=True, nogil=True)
def _split_pair(node, tree, problem, state, bound, avoid, fixed):  # type: ignore[no-untyped-def]
    """Push one node for each position that the carrier of a pair can have."""
    lb, parent, restriction, pick, height, cost, alone, on, order, fixes, leaning, raised, kind = (
        tree
    )
    (entries, costs, starts, centres, boxes, spans, heights, bin_sizes, rule, min_vertices,
     zones, zone_spans, radius, weights) = problem  # fmt: skip
    heap = state[0]
    size, used = state[1][0], state[1][1]
    carrier, upper = restriction[node, 1], restriction[node, 2]
    count_boxes = len(starts) - 1
    avoided, count = _restrictions(node, carrier, tree, problem, avoid, fixed)
    own_zones = zones[zone_spans[carrier] : zone_spans[carrier + 1]]
    others = 0.0
    for i in range(count_boxes):
        if i != carrier and i != upper:
            others += cost[node, i]
    last_z, last_box = -1, -1
    if count > 0 and not raised[node]:
        last_box = order[node, count - 1]
        last_z = height[node, last_box]
    step = rule[0]
    shapes = _shapes(entries, starts, upper)
    for index in range(starts[carrier], starts[carrier + 1]):
        if others + costs[index] + cost[node, upper] >= bound - EPS:
            break
        entry = entries[index]
        least = -1
        if raised[node]:
            least = _least_height(node, carrier, index, tree)
        z = next_height(
            entry, centres[carrier, entry[8]], least, np.int64(count), fixed, -1,
            leaning[node, carrier], avoid, avoided, own_zones, radius,
            boxes, spans, heights, bin_sizes, rule, min_vertices,
        )  # fmt: skip
        if z < 0 or z < last_z or (z == last_z and carrier < last_box):
            continue
        top = z + entry[6]
        least_on = np.inf
        for shape in shapes:
            if shape[0] != entry[0] or top + shape[3] > bin_sizes[entry[0], 2]:
                continue
            x = max(0, entry[1] - shape[1] + step)
            y = max(0, entry[2] - shape[2] + step)
            least_on = min(
                least_on, weights[0] * (x + y) + weights[1] * (top + shape[3])
            )
        least_on += weights[2] * (entry[0] + 1)
        total = (
            others + costs[index] + weights[1] * (z - entry[3]) + max(least_on, cost[node, upper])
        )
        if total >= bound - EPS:
            continue
        child = used
        used += 1
        _copy(tree, node, child)
        kind[child] = FIXED
        restriction[child, 1] = carrier
        restriction[child, 2] = upper
        pick[child, carrier] = index
        height[child, carrier] = z
        cost[child, carrier] = costs[index] + weights[1] * (z - entry[3])
        order[child, count] = carrier
        fixes[child] = count + 1
        on[child, upper] = carrier
        leaning[child, upper] = 1
        lb[child] = max(lb[node], total)
        size = push(heap, size, lb, child)
        state[1][0], state[1][1] = size, used


@njit(cache=True, nogil=True)
def _shapes(entries, starts, box):  # type: ignore[no-untyped-def]
    """The different (bin, dx, dy, dz) among the leaning entries of ``box``."""
    found = np.empty((64, 4), np.int64)
    count = 0
    for index in range(starts[box], starts[box + 1]):
        entry = entries[index]
        if entry[7] == 0:
            continue
        known = False
        for k in range(count):
            if (
                found[k, 0] == entry[0]
                and found[k, 1] == entry[4]
                and found[k, 2] == entry[5]
                and found[k, 3] == entry[6]
            ):
                known = True
                break
        if not known and count < 64:
            found[count, 0], found[count, 1] = entry[0], entry[4]
            found[count, 2], found[count, 3] = entry[5], entry[6]
            count += 1
    return found[:count]


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
    lb, parent, restriction, pick, height, cost, alone, on, order, fixes, leaning, raised, kind = (
        tree
    )
    (entries, costs, starts, centres, boxes, spans, heights, bin_sizes, rule, min_vertices,
     zones, zone_spans, radius, weights) = problem  # fmt: skip
    heap, counters = state
    count = len(starts) - 1
    avoid = np.empty((_MAX_AVOID, 7), np.int64)
    fixed = np.empty((count + 1, 7), np.int64)
    volumes = np.empty((count, 7), np.int64)
    point = np.empty(4, np.int64)
    room = count * count + 4
    while counters[0] > 0 or rejected >= 0:
        if counters[1] + room > len(lb):
            return FULL, -1
        if budget <= 0 and rejected < 0:
            return PAUSED, -1
        if rejected >= 0:
            node = rejected
        else:
            node = heap[0]
            if lb[node] >= bound - EPS:
                counters[0] = 0
                return PROVEN, -1
            if kind[node] == PAIR:
                carrier, upper = restriction[node, 1], restriction[node, 2]
                limit = bound - (_sum(cost[node]) - cost[node, carrier])
                own = costs[starts[carrier] : starts[carrier + 1]]
                if counters[1] + np.searchsorted(own, limit) > len(lb):
                    return FULL, -1
            counters[0] = pop(heap, counters[0], lb)
            budget -= 1
            counters[2] += 1
        if kind[node] == PAIR:
            _split_pair(node, tree, problem, state, bound, avoid, fixed)
            continue
        if kind[node] == FIXED:
            kind[node] = OPEN
            carrier, upper = restriction[node, 1], restriction[node, 2]
            volume_of(entries[pick[node, carrier]], height[node, carrier], volumes[carrier])
            possible = True
            for turn in range(count):
                # the box on the carrier first: it is the likeliest to have no place
                i = upper if turn == 0 else (turn - 1 if turn <= upper else turn)
                if not possible or _is_fixed(tree, node, i):
                    continue
                volume_of(entries[pick[node, i]], height[node, i], volumes[i])
                if i != upper and _depth(volumes[i], volumes[carrier], point) == 0:
                    continue
                limit = bound - (_sum(cost[node]) - cost[node, i])
                possible = evaluate(node, i, tree, problem, avoid, fixed, limit)
            if possible:
                lb[node] = max(lb[node], _sum(cost[node]))
                if lb[node] < bound - EPS:
                    counters[0] = push(heap, counters[0], lb, node)
            continue
        for i in range(count):
            volume_of(entries[pick[node, i]], height[node, i], volumes[i])
        one, two = _worst_overlap(node, count, volumes, tree, point)
        if one >= 0:
            for i in (one, two):
                if _is_fixed(tree, node, i):
                    continue
                child = counters[1]
                _copy(tree, node, child)
                kind[child] = OPEN
                restriction[child, 0], restriction[child, 1] = AVOID, i
                restriction[child, 2] = point[0]
                restriction[child, 3] = point[1] - rule[0]
                restriction[child, 4] = point[2] - rule[0]
                restriction[child, 5] = point[3] - 1
                restriction[child, 6] = point[1]
                restriction[child, 7] = point[2]
                restriction[child, 8] = point[3]
                limit = bound - (_sum(cost[node]) - cost[node, i])
                if evaluate(child, i, tree, problem, avoid, fixed, limit):
                    lb[child] = max(lb[node], _sum(cost[child]))
                    counters[1] += 1
                    counters[0] = push(heap, counters[0], lb, child)
            continue
        floating = -1
        for i in range(count):
            entry = entries[pick[node, i]]
            if entry[7] == 0:
                continue
            number = entry[0]
            if not rests_on(
                entry, height[node, i], centres[i, entry[8]], volumes, count, boxes,
                spans[number], spans[number + 1], heights, bin_sizes[number], rule, min_vertices,
            ):  # fmt: skip
                floating = i
                break
        if floating < 0 and rejected < 0:
            return SOLUTION, node
        if floating < 0 or _is_fixed(tree, node, floating) or alone[node, floating] >= 0:
            # a rule on the whole stack is broken: fix a box here, or not here
            rejected = -1
            free = -1
            for i in range(count):
                if free < 0 and not _is_fixed(tree, node, i):
                    free = i
            if free < 0:
                continue
            child = counters[1]
            _copy(tree, node, child)
            kind[child] = OPEN
            order[child, fixes[node]] = free
            fixes[child] = fixes[node] + 1
            raised[child] = 1
            counters[1] += 1
            counters[0] = push(heap, counters[0], lb, child)
            child = counters[1]
            _copy(tree, node, child)
            kind[child] = OPEN
            restriction[child, 0], restriction[child, 1] = RAISE, free
            restriction[child, 2] = pick[node, free]
            restriction[child, 3] = height[node, free] + 1
            raised[child] = 1
            limit = bound - (_sum(cost[node]) - cost[node, free])
            if evaluate(child, free, tree, problem, avoid, fixed, limit):
                lb[child] = max(lb[node], _sum(cost[child]))
                counters[1] += 1
                counters[0] = push(heap, counters[0], lb, child)
            continue
        rejected = -1
        child = counters[1]
        _copy(tree, node, child)
        kind[child] = OPEN
        alone[child, floating] = fixes[node]
        limit = bound - (_sum(cost[node]) - cost[node, floating])
        if evaluate(child, floating, tree, problem, avoid, fixed, limit):
            lb[child] = max(lb[node], _sum(cost[child]))
            counters[1] += 1
            counters[0] = push(heap, counters[0], lb, child)
        for carrier in range(count):
            if carrier == floating or _is_fixed(tree, node, carrier):
                continue
            for upper in range(count):
                if upper == carrier or _is_fixed(tree, node, upper) or alone[node, upper] >= 0:
                    continue
                child = counters[1]
                _copy(tree, node, child)
                kind[child] = PAIR
                restriction[child, 1], restriction[child, 2] = carrier, upper
                leaning[child, floating] = 1
                counters[1] += 1
                counters[0] = push(heap, counters[0], lb, child)
    return PROVEN, -1
