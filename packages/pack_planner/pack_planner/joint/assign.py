"""Compiled: which option for each box, bounded and listed.

An option is a bin, a face up and a base of one box, in its one or two turns. What two boxes with
given options cost at least when they stand clear of each other, and what that gives for all pairs,
bounds an assignment of options to all boxes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.bounds import NEVER
from pack_planner.joint.branching import EPS
from pack_planner.joint.places import FAR
from pack_planner.joint.relations import matched


@njit(cache=True, nogil=True)
def suffix_least(profile):  # type: ignore[no-untyped-def]
    """The least of a + profile[a] from each cell a on, per row; one more column, ``NEVER``."""
    found = np.full((profile.shape[0], profile.shape[1] + 1), NEVER)
    for r in range(len(profile)):
        for a in range(profile.shape[1] - 1, -1, -1):
            found[r, a] = found[r, a + 1]
            if profile[r, a] < FAR:
                found[r, a] = min(found[r, a], a + profile[r, a])
    return found


@njit(cache=True, nogil=True)
def _beside(first, after, wide, best):  # type: ignore[no-untyped-def]
    """The least x + y of two rows in sum, less than ``best``, the second ``wide`` cells on."""
    for a in range(len(first)):
        if a >= best:
            break
        if first[a] < FAR and a + wide < len(after):
            best = min(best, a + first[a] + after[a + wide])
    return best


@njit(cache=True, nogil=True)
def pair_costs(rows, by_x, by_y, sizes, span, box, cost, flat, w1, limits):  # type: ignore[no-untyped-def]
    """What two options in one bin must pay on top of their least costs, (options, options).

    Parameters
    ----------
    rows : the turns of each option, numbers of rows, (options, 2).
    by_x, by_y : least y at each x, least x at each y of the places of each row.
    sizes : of each row along x and y, cells.
    span : base and top of each option.
    box, cost, flat : of each option: its box, its least cost, what of it is not w1 (x + y).
    limits : for two boxes, the most that both may cost together; infinite stands for more.
    """
    count = len(rows)
    after_x, after_y = suffix_least(by_x), suffix_least(by_y)
    found = np.zeros((count, count))
    for i in range(count):
        for k in range(i + 1, count):
            if box[i] == box[k]:
                continue
            least = cost[i] + cost[k]
            limit = limits[box[i], box[k]]
            if least < limit and span[i, 0] < span[k, 1] and span[k, 0] < span[i, 1]:
                best = NEVER
                if w1 > 0:
                    best = int(min(NEVER, np.ceil((limit - flat[i] - flat[k]) / w1)))
                worst = best
                for p in range(2):
                    for q in range(2):
                        r, s = rows[i, p], rows[k, q]
                        if (p == 1 and r == rows[i, 0]) or (q == 1 and s == rows[k, 0]):
                            continue
                        best = _beside(by_x[r], after_x[s], sizes[r, 0], best)
                        best = _beside(by_x[s], after_x[r], sizes[s, 0], best)
                        best = _beside(by_y[r], after_y[s], sizes[r, 1], best)
                        best = _beside(by_y[s], after_y[r], sizes[s, 1], best)
                least = max(least, flat[i] + flat[k] + w1 * best) if best < worst else np.inf
            pays = least - cost[i] - cost[k] if least < limit else np.inf
            found[i, k] = found[k, i] = max(0.0, pays)
    return found


@njit(cache=True, nogil=True)
def _all_matched(depth, pays, found):  # type: ignore[no-untyped-def]
    """:func:`.relations.matched` of every set of boxes up to ``depth`` that has this one."""
    last = 1 << depth
    for rest in range(last):
        best = found[rest]
        for i in range(depth):
            if rest >> i & 1:
                others = rest & ~(1 << i)
                best = max(best, pays[i, depth] + found[others])
                for k in range(i + 1, depth):
                    if others >> k & 1:
                        three = pays[i, depth] + pays[k, depth] + pays[i, k]
                        best = max(best, 0.5 * three + found[others & ~(1 << k)])
        found[last | rest] = best


@njit(cache=True, nogil=True)
def _holders(starts, costs, leans, holds):  # type: ignore[no-untyped-def]
    """What each box must pay at least, beyond its own least, to hold up an option that leans."""
    count = len(starts) - 1
    found = np.full((len(costs), count), np.inf)
    for o in range(len(costs)):
        for i in range(count):
            for h in range(starts[i], starts[i + 1] if leans[o] else starts[i]):
                if holds[o, h]:
                    found[o, i] = costs[h] - costs[starts[i]]
                    break
    return found


@njit(cache=True, nogil=True)
def assignments(starts, costs, extra, rank, twin, leans, holds, upper, most, visits):  # type: ignore[no-untyped-def]
    """All ways to give each box an option that may cost less than ``upper`` together.

    Parameters
    ----------
    starts : options of box i are those from starts[i] to starts[i + 1], the cheapest first.
    costs, extra : least cost of each option, what two of them must pay on top; infinite: never.
    rank, twin : a box has no option of lower rank than box twin[i], which is the same but for its
        id; -1 for none.
    leans, holds : whether an option needs another one under it, and whether it may be this one.
    most : how many at most.
    visits : how many options to look at, at most.

    Returns
    -------
    picks : options, (found, boxes); one more than ``most`` rows if there are more, or if there are
        too many options to look at.
    """
    count = len(starts) - 1
    rest = np.zeros(count + 1)
    for i in range(count - 1, -1, -1):
        rest[i] = rest[i + 1] + costs[starts[i] : starts[i + 1]].min()
    holders = _holders(starts, costs, leans, holds)
    picks = np.empty((64, count), np.int64)
    pick, at = np.zeros(count, np.int64), np.zeros(count, np.int64)
    pays = np.zeros((count, count))
    matches = np.zeros(1 << count)
    spent = np.zeros(count + 1)
    found, depth = 0, 0
    at[0] = starts[0]
    while depth >= 0:
        o = at[depth]
        if o >= starts[depth + 1] or spent[depth] + costs[o] + rest[depth + 1] >= upper - EPS:
            depth -= 1
            if depth >= 0:
                at[depth] += 1
            continue
        visits -= 1
        if visits < 0:
            return np.empty((most + 1, count), np.int64)
        total = spent[depth] + costs[o] + rest[depth + 1]
        hold = 0.0
        good = twin[depth] < 0 or rank[pick[twin[depth]]] <= rank[o]
        for i in range(depth):
            if not good:
                break
            pays[i, depth] = pays[depth, i] = extra[pick[i], o]
            good = total + pays[i, depth] < upper - EPS
        if good:
            pick[depth] = o
            # some box still to come must hold up what nothing holds yet, and pay for it
            for i in range(depth + 1):
                if leans[pick[i]]:
                    need = np.inf
                    for k in range(depth + 1):
                        need = 0.0 if holds[pick[i], pick[k]] else need
                    for k in range(depth + 1, count):
                        need = min(need, holders[pick[i], k])
                    hold = max(hold, need)
            good = total + hold < upper - EPS
        if good:
            _all_matched(depth, pays, matches)
            good = total + hold + matches[(2 << depth) - 1] < upper - EPS
        if not good:
            at[depth] += 1
        elif depth < count - 1:
            spent[depth + 1] = spent[depth] + costs[o]
            depth += 1
            at[depth] = starts[depth]
        else:
            if found == len(picks):
                picks = np.concatenate((picks, np.empty_like(picks)))
            picks[found] = pick
            found += 1
            at[depth] += 1
            if found > most:
                break
    return picks[:found]


@njit(cache=True, nogil=True)
def group_bounds(groups, costs, extra):  # type: ignore[no-untyped-def]
    """The least that each group costs; rows of ``groups`` are options, -1 for none."""
    found = np.zeros(len(groups))
    pays = np.zeros((groups.shape[1], groups.shape[1]))
    for g in range(len(groups)):
        size = 0
        for i in range(groups.shape[1]):
            if groups[g, i] >= 0:
                found[g] += costs[groups[g, i]]
                size += 1
                other = 0
                for k in range(i):
                    if groups[g, k] >= 0:
                        pays[other, size - 1] = pays[size - 1, other] = extra[
                            groups[g, k], groups[g, i]
                        ]
                        other += 1
        found[g] += matched(size, pays)
    return found


@njit(cache=True, nogil=True)
def next_open(parts, bounds, first, upper):  # type: ignore[no-untyped-def]
    """The first assignment from ``first`` on whose groups cost less than ``upper``; -1 for none."""
    for a in range(first, len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        if total < upper - EPS:
            return a
    return -1


@njit(cache=True, nogil=True)
def least_open(parts, bounds):  # type: ignore[no-untyped-def]
    """The least that any assignment costs."""
    best = np.inf
    for a in range(len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        best = min(best, total)
    return best
