"""One group: boxes with given faces up and bases in one bin, made ready for :mod:`.relations`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.joint.bin_by_bin.arrangement import DONE, FULL, PAUSED, SOLUTION, search
from pack_planner.joint.bin_by_bin.branching import EITHER, NONE, relate
from pack_planner.joint.bin_by_bin.held_places import ON_ANYTHING, ON_BOXES
from pack_planner.joint.bin_by_bin.places import FAR
from pack_planner.joint.bounds import UNBOUNDED

#: Rows of the stack of nodes; a search that needs more gives up.
_ROOM = 4096
#: Nodes between looks at the clock.
_CHUNK = 100
#: Nodes after which an arrangement is taken to be possible.
_ENOUGH = 20_000
#: Corners on one box that put the whole base on it.
_WHOLE_BASE = 3

Ints = NDArray[np.int64]
Nodes = tuple[NDArray[Any], ...]


@njit(cache=True, nogil=True)
def problem_of(  # type: ignore[no-untyped-def]
    own, options, row_sizes, row_range, after, near, beside, ground, w1, contact, elsewhere
):
    """What :func:`.relations.search` wants to know about the options ``own`` of a bin.

    Parameters
    ----------
    options : (rows, base and top, what it costs besides w1 (x + y), whether it leans, whether a
        placed top is level with its base, how many corners others may hold) of all options.
    row_sizes, row_range : x and y sizes of each row, its least and most x and y, cells.
    after, near : places of each row as from :func:`.places.next_places`.
    beside : where each row is beside a wall or placed box, (rows, axes, cells).
    ground : (height map, (tolerance, corners needed)).
    elsewhere : how many corners of each box other boxes than these may hold.

    Returns
    -------
    problem : next places of all rows; rows (boxes, turns); sizes (boxes, turns, axes), cells;
        number of turns; costs besides w1 (x + y); who leans; who may lie under whom
        [upper, lower]; where rows are beside something; height map; (tolerance, corners that each
        box needs here); w1; bases; who overlaps in height; whether contact is asked for; who rests
        wholly on each box, itself included, as bits; whose corners have to be looked at,
        ON_ANYTHING or ON_BOXES alone; nearest places of all rows.
    root : first ranges, least and most, (boxes, 2); relations that always hold, (axes, boxes,
        boxes).
    """
    rows, span, flat, leans, level, holds = options
    count = len(own)
    sizes = np.empty((count, 2, 2), np.int64)
    turns = np.ones(count, np.int64)
    low, high = np.empty((count, 2), np.int64), np.empty((count, 2), np.int64)
    apart = np.full((2, count, count), NONE, np.int64)
    under = np.zeros((count, count), np.bool_)
    meets = np.zeros((count, count), np.bool_)
    wholly = np.left_shift(1, np.arange(count))
    doubtful, on = np.zeros(count, np.int8), np.full(count, -1, np.int64)
    needed = ground[1][1] - elsewhere
    base = np.empty(count, np.int64)  # a slice of one row is of another type than one of two
    for i in range(count):
        o = own[i]
        if leans[o] and needed[i] > 0:
            only_boxes = not level[o] and needed[i] >= _WHOLE_BASE
            doubtful[i] = ON_BOXES if only_boxes else ON_ANYTHING
        first, last = rows[o]
        turns[i] += int(first != last)
        base[i] = span[o, 0]
        for axis in range(2):
            sizes[i, 0, axis], sizes[i, 1, axis] = row_sizes[first, axis], row_sizes[last, axis]
            low[i, axis] = min(row_range[first, axis, 0], row_range[last, axis, 0])
            high[i, axis] = max(row_range[first, axis, 1], row_range[last, axis, 1])
        for k in range(count):
            under[i, k] = holds[o, own[k]] > 0
            meets[i, k] = span[o, 0] < span[own[k], 1] and span[own[k], 0] < span[o, 1]
    for i in range(count):
        if doubtful[i] != ON_BOXES or under[i].sum() != 1:
            continue
        holder = np.argmax(under[i])
        doubtful[i], on[i] = 0, holder
        for axis in range(2):
            relate(apart, axis, i, holder, 0)
            gap = sizes[i, :, axis].min() - sizes[holder, :, axis].max()
            relate(apart, axis, holder, i, gap)
    for _ in range(count):
        for i in range(count):
            if on[i] >= 0:
                wholly[on[i]] |= wholly[i]
    problem = (
        after, rows[own], sizes, turns, flat[own], leans[own], under, beside, ground[0],
        (ground[1][0], needed), w1, base, meets, contact, wholly, doubtful, near,
    )  # fmt: skip
    return problem, (low, high, apart)


def empty_nodes(count: int) -> Nodes:
    """Arrays of the nodes of a search with ``count`` boxes, for :func:`.relations.search`.

    Least and most x, y of each box (cells); distances that relations ask for, by axis; pairs that
    are kept apart; states of the corners; turn, 2 for either; least cost and cheapest place
    (x, y, turn); bound; what a box touches along x and y: 0 not decided, 1 a wall or a placed box,
    2 another box; least cost by turn; whose place must be found anew.
    """
    n = _ROOM
    return (
        np.zeros((n, count, 2), np.int64), np.zeros((n, count, 2), np.int64),
        np.zeros((n, 2, count, count), np.int64), np.zeros((n, count, count), np.bool_),
        np.zeros((n, count, 4), np.int8), np.zeros((n, count), np.int8), np.zeros((n, count)),
        np.zeros((n, count, 3), np.int64), np.zeros((n, 1)), np.zeros((n, count, 2), np.int8),
        np.zeros((n, count, 2)), np.zeros((n, count), np.bool_),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _begin(problem, root, bound, nodes):  # type: ignore[no-untyped-def]
    """Put the whole group on the stack."""
    low, high, apart = root
    nodes[0][0], nodes[1][0], nodes[2][0], nodes[3][0], nodes[4][0] = low, high, apart, False, 0
    for i in range(len(low)):
        nodes[5][0, i] = EITHER if problem[3][i] > 1 else 0
    nodes[6][0], nodes[7][0], nodes[8][0], nodes[11][0] = 0.0, -1, bound, True
    nodes[9][0] = 1 if len(low) == 1 and problem[13] else 0


@njit(cache=True, nogil=True)
def close(groups, elsewhere, wanted, bounds, nodes, budget, tables):  # type: ignore[no-untyped-def]
    """Raise the bounds of groups by a short search.

    Parameters
    ----------
    groups, elsewhere : rows of options of one bin, as many in each; corners that others may hold.
    wanted, bounds : nothing that costs so much is wanted; nothing costs less.
    nodes : see :func:`empty_nodes`.
    budget : nodes to take for each group at most.
    tables : see :func:`problem_of`, without the boxes' own.

    Returns
    -------
    The nodes taken.
    """
    options, row_sizes, row_range, after, near, beside, ground, w1, contact = tables
    counters, taken = np.zeros(2, np.int64), 0
    rejected = bool(taken)  # a literal would compile the search once more
    for g in range(len(groups)):
        problem, root = problem_of(
            groups[g], options, row_sizes, row_range, after, near, beside, ground, w1, contact,
            elsewhere[g],
        )  # fmt: skip
        _begin(problem, root, bounds[g], nodes)
        counters[0], counters[1] = 1, 0
        least = wanted[g]
        if search(problem, nodes, counters, wanted[g], budget, rejected) == SOLUTION:
            least = nodes[6][-1].sum()
        for n in range(counters[0]):
            least = min(least, nodes[8][n, 0])
        bounds[g] = max(bounds[g], least)
        taken += counters[1]
    return taken


@dataclass
class Group:
    """Boxes with given faces up and bases in one bin.

    Attributes
    ----------
    problem, root : see :func:`problem_of`.
    bound : nothing in this group costs less.
    cost : of the best arrangement found, infinite without.
    places : that arrangement, rows (x, y, turn).
    """

    problem: tuple[Any, ...]
    root: tuple[Any, ...]
    bound: float
    cost: float = np.inf
    places: Ints = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    def improve(
        self, upper: float, valid: Callable[[Ints], bool], out_of_time: Callable[[], bool],
        nodes: Nodes,
    ) -> int:  # fmt: skip
        """Search for less than ``upper``; returns the nodes taken. Raises ``bound`` by what it saw.

        ``valid`` says whether places keep the rules that the search does not know.
        """
        _begin(self.problem, self.root, self.bound, nodes)
        counters = np.array([1, 0], np.int64)
        best, rejected = upper, False
        while True:
            why = search(self.problem, nodes, counters, best, _CHUNK, rejected)
            rejected = False
            if why == SOLUTION:
                places = nodes[7][-1].copy()
                if valid(places):
                    best = float(nodes[6][-1].sum())
                    self.cost, self.places = best, places
                else:
                    rejected = True
            if why == DONE:
                self.bound = max(self.bound, best)
                return int(counters[1])
            if why == FULL or out_of_time():
                open_bounds = nodes[8][: counters[0], 0]
                least = float(open_bounds.min(initial=best))
                if rejected:  # what is left of it is not on the stack
                    least = min(least, float(nodes[8][-1, 0]))
                self.bound = max(self.bound, min(best, least))
                return int(counters[1])

    def possible(self, nodes: Nodes, out_of_time: Callable[[], bool]) -> bool:
        """Whether there may be an arrangement: False if there is none, as far as is known here."""
        _begin(self.problem, self.root, self.bound, nodes)
        counters = np.array([1, 0], np.int64)
        why = PAUSED
        while why == PAUSED and counters[1] < _ENOUGH and not out_of_time():
            why = search(self.problem, nodes, counters, UNBOUNDED, _CHUNK, False)
        return why != DONE


@njit(cache=True, nogil=True)
def row_ranges(by_x, by_y):  # type: ignore[no-untyped-def]
    """Least and most x and y of the places of each row, (rows, axes, 2)."""
    found = np.empty((len(by_x), 2, 2), np.int64)
    for r in range(len(by_x)):
        xs, ys = np.flatnonzero(by_x[r] < FAR), np.flatnonzero(by_y[r] < FAR)
        found[r, 0, 0], found[r, 0, 1] = xs[0], xs[-1]
        found[r, 1, 0], found[r, 1, 1] = ys[0], ys[-1]
    return found
