"""Compiled: which option for each box, bounded and listed.

An option is a bin, a face up and a base of one box, in its one or two turns. What two boxes with
given options cost at least when they stand clear of each other, and what that gives for all pairs,
bounds an assignment of options to all boxes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.bin_by_bin.branching import EPS
from pack_planner.joint.bin_by_bin.disjoint_pairs import matched
from pack_planner.joint.bin_by_bin.who_goes_behind import least_behind
from pack_planner.joint.compiled import compiled, entry

#: Options that are looked at in the time in which one is looked at more closely.
_DEAR = 16


@compiled
def _match_with(o, depth, pick, extra, pays, matches):  # type: ignore[no-untyped-def]
    """What the boxes up to ``depth`` must pay with option ``o`` for this one.

    ``matches`` becomes :func:`.disjoint_pairs.matched` of every set of boxes that has this one.
    """
    for i in range(depth):
        pays[i, depth] = pays[depth, i] = extra[pick[i], o]
    last = 1 << depth
    for rest in range(last):
        best = matches[rest]
        for i in range(depth):
            if rest >> i & 1:
                others = rest & ~(1 << i)
                best = max(best, pays[i, depth] + matches[others])
                for k in range(i + 1, depth):
                    if others >> k & 1:
                        three = pays[i, depth] + pays[k, depth] + pays[i, k]
                        best = max(best, 0.5 * three + matches[others & ~(1 << k)])
        matches[last | rest] = best
    return matches[(last << 1) - 1]


@compiled
def _behind(pick, behind, most, room):  # type: ignore[no-untyped-def]
    """What those picked must pay at least, see :func:`.who_goes_behind.least_behind`.

    See :class:`.who_goes_behind.BehindRoom` for ``room``.
    """
    pays, count, pairs = room.pays, len(pick), 0
    for i in range(count):
        for k in range(i):
            one, other = behind[pick[i], pick[k]], behind[pick[k], pick[i]]
            if one > 0.0 and other > 0.0:
                pays[pairs, :, :count] = 0.0
                pays[pairs, 0, i], pays[pairs, 1, k] = one, other
                pairs += 1
    return least_behind(count, pairs, most, room)


@entry
def holders(starts, costs, leans, holds, needed, stop):  # type: ignore[no-untyped-def]
    """What boxes from number i on pay at least, beyond their own least, to hold up an option.

    Returns
    -------
    (boxes + 1, corners still needed + 1, options); nothing for options that need no other, infinite
    where too few are left.
    """
    count = len(starts) - 1
    pays_later = np.zeros((count + 1, needed + 1, len(costs)))
    for o in range(len(costs)):
        if stop[0]:
            break
        if not leans[o]:
            continue
        pays_later[count, 1:, o] = np.inf
        for i in range(count - 1, -1, -1):
            pays_later[i, 1:, o] = pays_later[i + 1, 1:, o]
            most = 0
            for h in range(starts[i], starts[i + 1]):
                if holds[o, h] <= most:
                    continue
                most = holds[o, h]
                for lack in range(1, needed + 1):
                    pays = costs[h] - costs[starts[i]] + pays_later[i + 1, max(lack - most, 0), o]
                    pays_later[i, lack, o] = min(pays_later[i, lack, o], pays)
                if most >= needed:
                    break
    return pays_later


class Later(NamedTuple):
    """What boxes still to come can do for options that lean.

    Attributes
    ----------
    pays : from :func:`holders`.
    holders : options of the last box that hold up each option that leans, one after another.
    begin : where those of each option begin.
    """

    pays: NDArray[np.float64]
    holders: NDArray[np.int64]
    begin: NDArray[np.int64]


def later(
    starts: NDArray[np.int64], costs: NDArray[np.float64], leans: NDArray[np.bool_],
    holds: NDArray[np.int8], needed: int, stop: NDArray[np.bool_],
) -> Later:  # fmt: skip
    """See :class:`Later` and, for the arguments, :func:`assignments`."""
    first, last = starts[-2], starts[-1]
    held, by = np.nonzero(holds[:first, first:last] * leans[:first, None])
    begin = np.searchsorted(held, np.arange(first + 1)).astype(np.int64)
    return Later(holders(starts, costs, leans, holds, needed, stop), first + by, begin)


@compiled
def _lack(o, pick, holds, needed):  # type: ignore[no-untyped-def]
    """How many corners of an option that leans are on nothing picked."""
    for h in pick:
        needed -= holds[o, h]
    return max(needed, 0)


@compiled
def _in_the_air(pick, leans, holds, needed):  # type: ignore[no-untyped-def]
    """A pick that needs others under it and has not enough, -1 for none."""
    for o in pick:
        if leans[o] and _lack(o, pick, holds, needed) > 0:
            return o
    return -1


@compiled
def _end_with(  # type: ignore[no-untyped-def]
    holders_of_it,
    room,
    pick,
    costs,
    extra,
    behind,
    rank,
    twin,
    leans,
    holds,
    needed,
    pays,
    matches,
    room_behind,
    listed,
):
    """Write down the picks with each of ``holders_of_it`` for the last box; how many there are.

    Of these it is not said whether they are held, nor what they must pay; ``room`` is what they
    may cost, see :func:`assignments` for the rest.
    """
    last, count = len(pick) - 1, 0
    for o in holders_of_it:
        if costs[o] + matches[(1 << last) - 1] >= room:
            break
        pick[last] = o
        if _in_the_air(pick, leans, holds, needed) >= 0:
            continue
        if twin >= 0 and rank[pick[twin]] > rank[o]:
            continue
        if costs[o] + _match_with(o, last, pick, extra, pays, matches) >= room:
            continue
        left = room - costs[o]
        if _behind(pick, behind, left, room_behind) < left:
            listed[count] = pick
            count += 1
    return count


@compiled
def _look(first, last, pick, extra, matches, holds, held, needed, later, lack, pay, need):  # type: ignore[no-untyped-def]
    """What the options from ``first`` to ``last`` add to those picked for other boxes.

    Row by row, for the compiler to make vectors of: this is where the time goes. ``pay`` becomes
    what disjoint pairs pay at least, ``need`` what boxes still to come (``later``, see
    :func:`holders`) pay to hold up one that too little holds then.
    """
    count, picked = last - first, len(pick)
    everyone = (1 << picked) - 1
    for o in range(count):
        pay[o], need[o], lack[o] = matches[everyone], 0.0, needed
    for i in range(picked):
        row, rest = extra[pick[i], first:last], matches[everyone & ~(1 << i)]
        over = held[pick[i], first:last]
        for o in range(count):
            pays = row[o] + rest
            pay[o] = pays if pays > pay[o] else pay[o]
            lack[o] -= over[o]
    for still in range(1, needed + 1):
        row = later[still, first:last]
        for o in range(count):
            need[o] = row[o] if lack[o] >= still else need[o]
    for i in range(picked):
        still = _lack(pick[i], pick, holds, needed)
        if later[still, pick[i]] > 0.0:
            under = holds[pick[i], first:last]
            most = later[still, pick[i]]
            one, two = later[max(still - 1, 0), pick[i]], later[max(still - 2, 0), pick[i]]
            all_four = later[max(still - 4, 0), pick[i]]
            for o in range(count):
                least = most if under[o] == 0 else one if under[o] == 1 else two
                least = all_four if under[o] > 2 else least
                need[o] = need[o] if need[o] > least else least


@entry
def assignments(  # type: ignore[no-untyped-def]
    starts, costs, extra, behind, rank, twin, leans, holds, held, needed, later, room_behind,
    upper, most, visits, stop,
):  # fmt: skip
    """All ways to give each box an option that may cost less than ``upper`` together.

    Parameters
    ----------
    starts : options of box i are those from starts[i] to starts[i + 1], the cheapest first.
    costs, extra : least cost of each option, what two of them must pay on top; infinite: never.
    behind : what one must pay when it goes behind another one, [behind, in front].
    rank, twin : a box has no option of lower rank than box twin[i], which is the same but for its
        id; -1 for none.
    leans, holds, held : whether an option needs others under it, and how many of its corners each
        may hold, 0, 1, 2 or all, [upper, lower] and [lower, upper].
    needed : how many corners must be held.
    later : see :class:`Later`.
    room_behind : see :class:`.who_goes_behind.BehindRoom`.
    upper : what they may cost.
    most : how many at most.
    visits : how many options to look at, at most; a closer look counts as :data:`_DEAR`.
    stop : see :mod:`.budget`.

    Returns
    -------
    picks : options, (picked, boxes); one more than ``most`` rows if there are more, or if there are
        too many options to look at, or no time.
    """
    count = len(starts) - 1
    rest = np.zeros(count + 1)
    for i in range(count - 1, -1, -1):
        rest[i] = rest[i + 1] + costs[starts[i]]
    picks = np.empty((64, count), np.int64)
    pick, at, end = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64)
    pays, matches = np.zeros((count, count)), np.zeros(1 << count)
    widest = np.diff(starts).max()
    pay, need = np.zeros((count, widest)), np.zeros((count, widest))
    lack = np.zeros(widest, np.int8)
    spent = np.zeros(count + 1)
    picked, depth, new = 0, 0, True
    while depth >= 0:
        if stop[0]:
            return np.empty((most + 1, count), np.int64)
        first, room = starts[depth], upper - EPS - spent[depth] - rest[depth + 1]
        alone = -1
        if new and depth == count - 1:
            alone = _in_the_air(pick[:depth], leans, holds, needed)
        if alone >= 0:
            # only what holds this one up may be the last, and that is little
            holders = later.holders[later.begin[alone] : later.begin[alone + 1]]
            visits -= _DEAR * len(holders)
            while picked + len(holders) > len(picks):
                picks = np.concatenate((picks, np.empty_like(picks)))
            picked += _end_with(
                holders, room, pick, costs, extra, behind, rank, twin[depth], leans, holds, needed,
                pays, matches, room_behind, picks[picked:],
            )  # fmt: skip
            if picked > most or visits < 0:
                return np.empty((most + 1, count), np.int64)
            depth, new = depth - 1, False
            continue
        if new:
            at[depth] = first
            end[depth] = first + np.searchsorted(costs[first : starts[depth + 1]], room)
            visits -= end[depth] - first
            if visits < 0:
                return np.empty((most + 1, count), np.int64)
            _look(
                first, end[depth], pick[:depth], extra, matches, holds, held, needed,
                later.pays[depth + 1], lack, pay[depth], need[depth],
            )  # fmt: skip
            new = False
        o = at[depth]
        while o < end[depth] and costs[o] + pay[depth, o - first] + need[depth, o - first] >= room:
            o += 1
        at[depth] = o + 1
        if o == end[depth]:
            depth -= 1
            continue
        if twin[depth] >= 0 and rank[pick[twin[depth]]] > rank[o]:
            continue
        visits -= _DEAR
        must_pay = _match_with(o, depth, pick, extra, pays, matches)
        if costs[o] + need[depth, o - first] + must_pay >= room:
            continue
        pick[depth] = o
        if depth > 1:
            left = room - costs[o]
            if _behind(pick[: depth + 1], behind, left, room_behind) >= left:
                continue
        if depth < count - 1:
            spent[depth + 1] = spent[depth] + costs[o]
            depth += 1
            new = True
            continue
        if picked == len(picks):
            picks = np.concatenate((picks, np.empty_like(picks)))
        picks[picked] = pick
        picked += 1
        if picked > most:
            break
    return picks[:picked]


@entry
def group_bounds(groups, costs, extra, behind, room_behind, stop):  # type: ignore[no-untyped-def]
    """The least that each group costs; rows of ``groups`` are options, -1 for none.

    0 for those that are not reached before ``stop`` is raised.
    """
    sums = np.zeros(len(groups))
    pick = np.zeros(groups.shape[1], np.int64)
    pays = np.zeros((groups.shape[1], groups.shape[1]))
    for g in range(len(groups)):
        if stop[0]:
            break
        size = 0
        for i in range(groups.shape[1]):
            if groups[g, i] >= 0:
                sums[g] += costs[groups[g, i]]
                pick[size] = groups[g, i]
                size += 1
                other = 0
                for k in range(i):
                    if groups[g, k] >= 0:
                        pays[other, size - 1] = pays[size - 1, other] = extra[
                            groups[g, k], groups[g, i]
                        ]
                        other += 1
        in_front = _behind(pick[:size], behind, np.inf, room_behind)
        sums[g] += max(matched(size, pays), in_front)
    return sums


@entry
def next_open(parts, bounds, first, upper):  # type: ignore[no-untyped-def]
    """The first assignment from ``first`` on whose groups cost less than ``upper``; -1 for none."""
    for a in range(first, len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        if total < upper - EPS:
            return a
    return -1


@entry
def least_open(parts, bounds):  # type: ignore[no-untyped-def]
    """The least that any assignment costs."""
    best = np.inf
    for a in range(len(parts)):
        total = 0.0
        for g in parts[a]:
            total += bounds[g]
        best = min(best, total)
    return best
