"""One group: boxes with given faces up and bases in one bin, made ready for :mod:`.arrangement`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pack_planner.joint.bin_by_bin.arrangement import DONE, FULL, PAUSED, SOLUTION, search
from pack_planner.joint.bin_by_bin.branching import EITHER, NONE, relate
from pack_planner.joint.bin_by_bin.group_problem import (
    BinTables,
    Cells,
    GroupProblem,
    GroupRoot,
    Ints,
    SearchRoom,
)
from pack_planner.joint.bin_by_bin.held_places import ON_ANYTHING, ON_BOXES
from pack_planner.joint.bin_by_bin.places import FAR
from pack_planner.joint.bounds import UNBOUNDED
from pack_planner.joint.budget import Budget
from pack_planner.joint.compiled import compiled, entry

#: Nodes that are taken in one go.
_CHUNK = 1000
#: Nodes after which an arrangement is taken to be possible.
_ENOUGH = 20_000
#: Corners on one box that put the whole base on it.
_WHOLE_BASE = 3


@compiled
def problem_of(own, elsewhere, tables, contact):  # type: ignore[no-untyped-def]
    """What :func:`.arrangement.search` wants to know about the options ``own`` of a bin.

    Parameters
    ----------
    own : numbers of options, one of each box of the group.
    elsewhere : how many corners of each box other boxes than these may hold.
    tables : see :class:`.group_problem.BinTables`.
    contact : whether contact is asked for.

    Returns
    -------
    problem, root : see :mod:`.group_problem`.
    """
    rows, span, flat, leans, level, holds = tables.options
    row_sizes, row_range, tops = tables.sizes, tables.ranges, tables.tops
    count = len(own)
    sizes = np.empty((count, 2, 2), np.int64)
    turns = np.ones(count, np.int64)
    low, high = np.empty((count, 2), np.int64), np.empty((count, 2), np.int64)
    apart = np.full((2, count, count), NONE, np.int64)
    under = np.zeros((count, count), np.bool_)
    meets = np.zeros((count, count), np.bool_)
    wholly = np.left_shift(1, np.arange(count))
    doubtful, on = np.zeros(count, np.int8), np.full(count, -1, np.int64)
    needed = tops.needed - elsewhere
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
    problem = GroupProblem(
        tables.after, tables.near, rows[own], sizes, turns, flat[own], leans[own], under,
        tables.beside, tops.height, tops.tolerance, needed, tables.w1, base, meets, contact, wholly,
        doubtful,
    )  # fmt: skip
    return problem, GroupRoot(low, high, apart)


@compiled
def _begin(problem, root, bound, nodes):  # type: ignore[no-untyped-def]
    """Put the whole group on the stack."""
    nodes.low[0], nodes.high[0], nodes.apart[0] = root.low, root.high, root.apart
    nodes.clear[0], nodes.corner[0] = False, 0
    for i in range(len(root.low)):
        nodes.turn[0, i] = EITHER if problem.turns[i] > 1 else 0
    nodes.cost[0], nodes.place[0], nodes.bound[0], nodes.stale[0] = 0.0, -1, bound, True
    nodes.touch[0] = 1 if len(root.low) == 1 and problem.contact else 0


@entry
def explore(  # type: ignore[no-untyped-def]
    groups, elsewhere, tables, contact, wanted, bounds, room, counters, limits, fresh, rejected,
    stop,
):  # fmt: skip
    """Search groups one after another, each as far as the limits go, and raise their bounds.

    Parameters
    ----------
    groups, elsewhere : rows of options of one bin, as many in each; corners that others may hold.
    tables, contact : see :func:`problem_of`.
    wanted, bounds : nothing that costs so much is wanted; nothing costs less.
    room : for groups of this size.
    counters : [open nodes, nodes taken for the last group, nodes taken]; changed.
    limits : nodes to take for each group at most, and for all of them.
    fresh : whether to begin; else to go on with what ``room`` and ``counters`` hold.
    rejected : whether the solution last returned breaks a rule.
    stop : see :mod:`pack_planner.joint.budget`.

    Returns
    -------
    Why the search of the last group ended, see :func:`.arrangement.search`.
    """
    why = PAUSED
    for g in range(len(groups)):
        if stop[0] or counters[2] >= limits[1]:
            break
        problem, root = problem_of(groups[g], elsewhere[g], tables, contact)
        if fresh:
            _begin(problem, root, bounds[g], room.stack)
            counters[0] = 1
        counters[1] = 0
        budget = min(limits[0], limits[1] - counters[2])
        why = search(problem, room, counters, wanted[g], budget, rejected, stop)
        least = wanted[g]
        if why == SOLUTION:
            least = room.node.cost.sum()
        for n in range(counters[0]):
            least = min(least, room.stack.bound[n, 0])
        bounds[g] = max(bounds[g], least)
        counters[2] += counters[1]
    return why


@dataclass
class Group:
    """Boxes with given faces up and bases in one bin.

    Attributes
    ----------
    options : their numbers in the bin.
    elsewhere : how many corners of each box other boxes may hold.
    tables, contact : see :func:`problem_of`.
    bound : nothing in this group costs less.
    cost : of the best arrangement found, infinite without.
    places : that arrangement, rows (x, y, turn).
    """

    options: Ints
    elsewhere: Ints
    tables: BinTables
    contact: bool
    bound: float
    cost: float = np.inf
    places: Ints = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    def improve(
        self, upper: float, valid: Callable[[Ints], bool], budget: Budget, room: SearchRoom
    ) -> None:
        """Search for less than ``upper``, and raise ``bound`` by what was seen.

        ``valid`` says whether places keep the rules that the search does not know. The nodes are
        taken from ``budget``.
        """
        counters = np.zeros(3, np.int64)
        best, fresh, rejected = upper, True, False
        while True:
            why = self._go_on(best, room, counters, budget, fresh=fresh, rejected=rejected)
            fresh = rejected = False
            if why == SOLUTION:
                places = room.node.place.copy()
                if valid(places):
                    best = float(room.node.cost.sum())
                    self.cost, self.places = best, places
                else:
                    rejected = True
            if why == DONE:
                self.bound = max(self.bound, best)
                return
            if why == PAUSED and counters[0] == 0:
                return  # before it began
            if why == FULL or budget.is_out():
                open_bounds = room.stack.bound[: counters[0], 0]
                least = float(open_bounds.min(initial=best))
                if rejected:  # what is left of it is not on the stack
                    least = min(least, float(room.node.bound[0]))
                self.bound = max(self.bound, min(best, least))
                return

    def possible(self, budget: Budget, room: SearchRoom) -> bool:
        """Whether there may be an arrangement: False if there is none, as far as is known here."""
        counters = np.zeros(3, np.int64)
        why, fresh = PAUSED, True
        while why == PAUSED and counters[2] < _ENOUGH and not budget.is_out():
            why = self._go_on(UNBOUNDED, room, counters, budget, fresh=fresh, rejected=False)
            fresh = False
        return why != DONE

    def _go_on(
        self, upper: float, room: SearchRoom, counters: Ints, budget: Budget, *, fresh: bool,
        rejected: bool,
    ) -> int:  # fmt: skip
        """:func:`explore` for some nodes, as far as the budget goes."""
        before = int(counters[2])
        most = min(_CHUNK, budget.nodes_left)
        why = explore(
            self.options[None, :], self.elsewhere[None, :], self.tables, self.contact,
            np.array([upper]), np.array([self.bound]), room, counters, (most, before + most),
            fresh, rejected, budget.stop,
        )  # fmt: skip
        budget.take(int(counters[2]) - before)
        return int(why)


def row_ranges(by_x: Cells, by_y: Cells) -> Ints:
    """Least and most x and y of the places of each row, (rows, axes, 2)."""
    ends = []
    for profile in (by_x < FAR, by_y < FAR):
        first = profile.argmax(axis=1)
        last = profile.shape[1] - 1 - profile[:, ::-1].argmax(axis=1)
        ends.append(np.stack([first, last], axis=1))
    return np.stack(ends, axis=1).astype(np.int64)
