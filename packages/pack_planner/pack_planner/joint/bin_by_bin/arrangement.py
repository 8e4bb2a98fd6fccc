"""Compiled: the cheapest way to put some boxes, each with given face up and base, into one bin.

Depth-first branch and bound. A node keeps, for every box, ranges of x and y, which of its two turns
are left, and relations between boxes: one is wholly beside another, a corner of one lies on
another, two faces lie in one plane. Every relation is a difference of two coordinates, so ranges
follow from each other as lengths of longest paths, and what a box costs at least is the least over
the places in its ranges where its base can be held up. The bound of a node is the sum of that, and
what boxes must pay to stay clear of each other, with all that rests wholly on them: over the best
set of pairs and triples that share no box, or over who goes behind whom (:mod:`.who_goes_behind`).

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

from pack_planner.joint.bin_by_bin.branching import (
    EPS,
    HUGE,
    NONE,
    around,
    attach,
    broken,
    copy,
    hanging,
    hold,
    loose,
    part,
)
from pack_planner.joint.bin_by_bin.disjoint_pairs import matched_wholes
from pack_planner.joint.bin_by_bin.held_places import farthest, scan, stays
from pack_planner.joint.bin_by_bin.pair_costs import meet, sides
from pack_planner.joint.bin_by_bin.who_goes_behind import least_behind
from pack_planner.joint.compiled import uncounted

#: Why the search returns.
DONE, PAUSED, SOLUTION, FULL = 0, 1, 2, 3


@uncounted
def _follow(lo, hi, apart, stale):  # type: ignore[no-untyped-def]
    """Narrow ranges by the relations, and mark them as ``stale``; False if one is empty."""
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
                        again = stale[i] = True
                    if hi[i, axis] - d < hi[k, axis]:
                        hi[k, axis] = hi[i, axis] - d
                        again = stale[k] = True
        for i in range(count):
            if lo[i, 0] > hi[i, 0] or lo[i, 1] > hi[i, 1]:
                return False
        if not again:
            return True
    return False  # relations that chase each other


@uncounted
def _settle(problem, node, upper):  # type: ignore[no-untyped-def]
    """Narrow ranges of a node and find the cheapest place of each box; False if hopeless.

    Boxes keep the places that stay possible: ranges only become narrower.
    """
    lo, hi, cost, place, stale = node.low, node.high, node.cost, node.place, node.stale
    flat, w1, doubtful = problem.flat, problem.w1, problem.doubtful
    count, spot = len(lo), node.spot
    narrowed = False
    for _ in range(40):
        if not _follow(lo, hi, node.apart, stale):
            return False
        unsettled = narrowed
        for i in range(count):
            unsettled = unsettled or stale[i]
        if not unsettled:
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
            if not stays(i, problem, node):
                least = scan(i, problem, node, cap, spot)
                if least >= HUGE:
                    return False
                place[i, 0], place[i, 1], place[i, 2] = spot[0], spot[1], spot[2]
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


@uncounted
def search(problem, room, counters, upper, budget, rejected, stop):  # type: ignore[no-untyped-def]
    """Search on until something happens.

    Parameters
    ----------
    problem, room : see :mod:`.group_problem`; the open nodes are a stack.
    counters : [open nodes, nodes taken].
    upper : nothing that costs so much is wanted.
    budget : how many nodes to take at most.
    rejected : whether the solution last returned breaks a rule.
    stop : once this is raised it pauses, see :mod:`pack_planner.joint.budget`.

    Returns
    -------
    One of DONE, PAUSED, SOLUTION and FULL; a SOLUTION is in ``room.node``.
    """
    nodes, node, extra, behind = room.stack, room.node, room.extra, room.behind
    costs, chosen, pays = room.sides, room.parted, room.behind.pays
    sizes, contact, meets, wholly = problem.sizes, problem.contact, problem.meets, problem.wholly
    here, count = len(nodes.low) - 1, len(sizes)
    children = 12 * count + 24
    if rejected:
        around(node, nodes, counters)
    while counters[0] > 0:
        if counters[0] + children > here:
            return FULL
        if budget <= 0 or stop[0]:
            return PAUSED
        counters[0] -= 1
        top = counters[0]
        if nodes.bound[top, 0] >= upper - EPS:
            continue
        counters[1] += 1
        budget -= 1
        copy(nodes, top, here)
        if not _settle(problem, node, upper):
            continue
        cost, place = node.cost, node.place
        total = 0.0
        for i in range(count):
            total += cost[i]
        extra[:] = 0.0
        one, two, least_work, own = np.int64(-1), np.int64(-1), HUGE, 0.0
        hopeless = False
        pairs, seen = 0, 0
        for i in range(count):
            if pairs > max(seen, 1):
                seen = pairs
                most = upper - total
                hopeless = hopeless or least_behind(count, pairs, most, behind) >= most - EPS
            for k in range(i + 1, count):
                if hopeless or not meets[i, k] or node.clear[i, k] or not meet(i, k, place, sizes):
                    continue
                pair = 0.0
                for m in range(count):
                    pair += cost[m] if (wholly[i] | wholly[k]) >> m & 1 else 0.0
                limit = upper - (total - pair)
                least = sides(i, k, problem, node, limit, costs, pays[pairs])
                if least >= HUGE:
                    hopeless = True
                    continue
                extra[i, k] = extra[k, i] = least - pair
                free = False
                for turned in range(2):
                    asked = 0.0
                    for m in range(count):
                        asked += pays[pairs, turned, m]
                    free = free or asked <= 0.0
                pairs += 0 if free else 1
                work = 0.0
                for p in range(2):
                    for q in range(2):
                        for side in range(4):
                            left = max(limit - costs[p, q, side], 0.0)
                            work += left * left
                work /= (limit - pair) ** 2
                if work < least_work:
                    one, two, least_work, own = i, k, work, pair
                    costs, chosen = chosen, costs
        if hopeless:
            continue
        if one >= 0:
            node.bound[0] = max(
                node.bound[0], total + matched_wholes(count, extra, wholly, room.matched)
            )
            if node.bound[0] < upper - EPS:
                most = upper - total
                most = least_behind(count, pairs, most, behind)
                node.bound[0] = max(node.bound[0], total + most)
            if node.bound[0] < upper - EPS:
                part(one, two, chosen, total - own, problem, node, nodes, counters, upper)
            continue
        node.bound[0] = max(node.bound[0], total)
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
