"""Compiled: nodes of the joint search, the heap of the open ones, the cheapest entry of a box."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.joint.cheapest import allowed

EPS = 1e-6

#: Kinds of node: evaluated, or a box was fixed and the others are not evaluated yet.
OPEN, FIXED = 0, 1
#: Kinds of restriction that a node adds to its parent's.
NOTHING, AVOID, WITHOUT, NOT_AT = 0, 1, 2, 3

MAX_AVOID = 256
#: Bin and height in one number.
LEVEL = 100_000


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
def volume_of(entry, out):  # type: ignore[no-untyped-def]
    """Write (bin, x0, y0, z0, x1, y1, z1) of a box at ``entry``."""
    out[:4] = entry[:4]
    out[4:] = entry[1:4] + entry[4:7]


@njit(cache=True, nogil=True)
def _restrictions(node, box, tree, entries, avoid, levels, fixed):  # type: ignore[no-untyped-def]
    """Gather what ``box`` must avoid and the fixed boxes; returns how many of each."""
    parent, restriction, pick, order, fixes = tree[1], tree[2], tree[3], tree[7], tree[8]
    count = np.int64(fixes[node])
    for k in range(count):
        volume_of(entries[pick[node, order[node, k]]], fixed[k])
        avoid[k] = fixed[k]
    avoided, leveled = count, 0
    at = node
    while at >= 0 and max(avoided, leveled) < MAX_AVOID:
        if restriction[at, 1] == box:
            if restriction[at, 0] == AVOID:
                avoid[avoided] = restriction[at, 2:9]
                avoided += 1
            elif restriction[at, 0] == NOT_AT:
                levels[leveled] = restriction[at, 2]
                leveled += 1
        at = parent[at]
    return avoided, leveled, count


@njit(cache=True, nogil=True)
def _left_out(node, box, index, tree):  # type: ignore[no-untyped-def]
    """Whether an ancestor leaves this entry of ``box`` out."""
    parent, restriction = tree[1], tree[2]
    at = node
    while at >= 0:
        if (
            restriction[at, 0] == WITHOUT
            and restriction[at, 1] == box
            and restriction[at, 2] == index
        ):
            return True
        at = parent[at]
    return False


@njit(cache=True, nogil=True)
def next_entry(node, box, first, tree, problem, space, limit):  # type: ignore[no-untyped-def]
    """Number of the cheapest entry from ``first`` on that the node allows ``box``; -1 if none.

    None that costs ``limit`` or more is wanted.
    """
    alone, on, order, raised, level, top = (
        tree[5], tree[6], tree[7], tree[10], tree[12], tree[13],
    )  # fmt: skip
    entries, costs, starts, centres, boxes, spans, heights, rule, min_vertices = problem
    avoid, levels, fixed = space
    avoided, leveled, count = _restrictions(node, box, tree, entries, avoid, levels, fixed)
    row = -1
    for k in range(count):
        if order[node, k] == on[node, box]:
            row = k
    at, own_top = level[node, box], top[node, box]
    for index in range(first, starts[box + 1]):
        if costs[index] >= limit - EPS:
            return -1
        entry = entries[index]
        if at >= 0 and (entry[7] == 0 or entry[3] != at % LEVEL or entry[0] != at // LEVEL):
            continue
        if own_top >= 0:
            below = own_top % LEVEL - entry[3] - entry[6]
            if below < 0 or below > rule[1] or entry[0] != own_top // LEVEL:
                continue
        if entry[7] == 1:
            good = True
            for k in range(leveled):
                if levels[k] == entry[0] * LEVEL + entry[3]:
                    good = False
                    break
            if not good:
                continue
        if not allowed(
            entry, centres[box, entry[8]], np.int64(alone[node, box]), fixed, row, avoid, avoided,
            boxes, spans, heights, rule, min_vertices,
        ):  # fmt: skip
            continue
        if raised[node] and _left_out(node, box, index, tree):
            continue
        return index
    return -1


@njit(cache=True, nogil=True)
def evaluate(node, box, tree, problem, space, bound):  # type: ignore[no-untyped-def]
    """Move ``box`` to its cheapest allowed entry and raise the node's bound; False if hopeless."""
    lb, pick, cost = tree[0], tree[3], tree[4]
    others = total(cost[node]) - cost[node, box]
    found = next_entry(node, box, pick[node, box], tree, problem, space, bound - others)
    if found < 0:
        return False
    pick[node, box] = found
    cost[node, box] = problem[1][found]
    lb[node] = max(lb[node], others + cost[node, box])
    return lb[node] < bound - EPS


@njit(cache=True, nogil=True)
def total(values):  # type: ignore[no-untyped-def]
    """Sum of ``values``, always in the same order."""
    found = 0.0
    for value in values:
        found += value
    return found


@njit(cache=True, nogil=True)
def child_of(tree, source, counters):  # type: ignore[no-untyped-def]
    """Copy ``source`` to the next free place; it is kept once ``counters[1]`` has moved on."""
    target = counters[1]
    tree[0][target] = tree[0][source]
    tree[1][target] = source
    tree[2][target, 0] = NOTHING
    tree[3][target] = tree[3][source]
    tree[4][target] = tree[4][source]
    tree[5][target] = tree[5][source]
    tree[6][target] = tree[6][source]
    tree[7][target] = tree[7][source]
    tree[8][target] = tree[8][source]
    tree[9][target] = tree[9][source]
    tree[10][target] = tree[10][source]
    tree[11][target] = OPEN
    tree[12][target] = tree[12][source]
    tree[13][target] = tree[13][source]
    return target


@njit(cache=True, nogil=True)
def keep(child, tree, heap, counters):  # type: ignore[no-untyped-def]
    """Take the new node ``child`` in, and open it."""
    counters[1] = child + 1
    counters[0] = push(heap, counters[0], tree[0], child)


@njit(cache=True, nogil=True)
def is_fixed(tree, node, box):  # type: ignore[no-untyped-def]
    """Whether ``box`` can no longer move in ``node``."""
    for k in range(tree[8][node]):  # noqa: SIM110 - numba knows no any() of a generator
        if tree[7][node, k] == box:
            return True
    return False


def empty_tree(room: int, count: int) -> tuple[NDArray[np.generic], ...]:
    """Arrays of the nodes.

    Bound, parent, restriction, and per box the entry, its cost, how many fixed boxes it may stand
    on (-1: it may lean), the box it must rest on; the fixed boxes in order, their number; which
    boxes (bits) carry each box; whether an ancestor left an entry out; kind; per box the level at
    which it must lean and the one at which its top must be (bin and height in one number, -1: any).
    """
    wide = (room, count)
    return (
        np.zeros(room), np.full(room, -1, np.int64), np.zeros((room, 9), np.int64),
        np.zeros(wide, np.int64), np.zeros(wide), np.full(wide, -1, np.int8),
        np.full(wide, -1, np.int8), np.full(wide, -1, np.int8), np.zeros(room, np.int8),
        np.zeros(wide, np.int64), np.zeros(room, np.int8), np.zeros(room, np.int8),
        np.full(wide, -1, np.int64), np.full(wide, -1, np.int64),
    )  # fmt: skip
