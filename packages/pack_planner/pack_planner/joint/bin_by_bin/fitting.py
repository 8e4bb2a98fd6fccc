"""Whether boxes can be placed together at all, and one way to do it.

Boxes get their options (:mod:`.options`) one by one. What too few others are left to hold up goes
first, and then its holders: a large box that lies on small ones of the look-ahead is what does not
fit, if anything. The boxes of each bin that have an option are arranged at once
(:mod:`.arrangement`), with the corners given that other boxes may still hold, so that most ways end
after two or three boxes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pack_planner.joint.bin_by_bin.group_problem import Flags, Ints, SearchRoom
from pack_planner.joint.bin_by_bin.listing import Listing
from pack_planner.joint.bin_by_bin.options import Corners
from pack_planner.joint.budget import Budget
from pack_planner.joint.compiled import entry, uncounted


class Holders(NamedTuple):
    """What may hold up options that lean.

    Attributes
    ----------
    option, corners : the options under each one, one after another, and how much of it they hold.
    begin : where those of each option begin.
    """

    option: Ints
    corners: Corners
    begin: Ints


def _holders(leans: Flags, holds: Corners) -> Holders:
    upper, lower = np.nonzero(holds * leans[:, None])
    begin = np.searchsorted(upper, np.arange(len(leans) + 1)).astype(np.int64)
    return Holders(np.ascontiguousarray(lower), holds[upper, lower], begin)


@uncounted
def _held(o, left, enough, box, holders, most):  # type: ignore[no-untyped-def]
    """How many corners of option ``o`` what is left may hold, or ``enough``; by box in ``most``."""
    corners, total = holders.corners, 0
    for k in range(len(most)):
        most[k] = 0
    for at in range(holders.begin[o], holders.begin[o + 1]):
        h = holders.option[at]
        if left[h] and corners[at] > most[box[h]]:
            total += corners[at] - most[box[h]]
            most[box[h]] = corners[at]
            if total >= enough:
                break
    return total


@uncounted
def _apart(o, p, extents, spans):  # type: ignore[no-untyped-def]
    """Whether two options may stand clear of each other."""
    if spans[o, 0] != spans[p, 0] or spans[o, 1] >= spans[p, 2] or spans[p, 1] >= spans[o, 2]:
        return True
    for axis in range(2):
        for t in range(2):
            for u in range(2):
                one, other = extents[o, t, axis], extents[p, u, axis]
                if one[0] + one[2] <= other[1] or other[0] + other[2] <= one[1]:
                    return True
    return False


@entry
def _narrow(  # type: ignore[no-untyped-def]
    pick, new, left, most, starts, box, extents, spans, rank, twin, leans, needed, holders,
    stop,
):  # fmt: skip
    """Strike off options that have become impossible; False if a box has none left.

    Parameters
    ----------
    pick : option of each box, -1 for none yet.
    new : box that got its option last, -1 for none.
    left : whether each option is left; of a box that has one only that.
    most : room for a number for each box.
    extents, spans : see :meth:`.listing.Listing.extents`; bin, base and top of each option.
    stop : what it says once this is raised is not to be used, see :mod:`.budget`.
    """
    if new >= 0:
        for o in range(len(left)):
            if box[o] != new and not _apart(pick[new], o, extents, spans):
                left[o] = False
            if twin[new] == box[o] and rank[o] > rank[pick[new]]:
                left[o] = False
            if twin[box[o]] == new and rank[o] < rank[pick[new]]:
                left[o] = False
    again = True
    while again:
        again = False
        for o in range(len(left)):
            if stop[0]:
                return False
            few = left[o] and leans[o]
            if few and _held(o, left, needed, box, holders, most) < needed:
                left[o] = False
                again = True
        for i in range(len(pick)):
            some = False
            for o in range(starts[i], starts[i + 1]):
                some = some or left[o]
            if not some:
                return False
    return True


@entry
def _elsewhere(pick, left, box, leans, holders):  # type: ignore[no-untyped-def]
    """How many corners of each box that has an option those may hold that have none yet."""
    given, most = np.zeros(len(pick), np.int64), np.zeros(len(pick), np.int64)
    for i in range(len(pick)):
        if pick[i] >= 0 and leans[pick[i]]:
            _held(pick[i], left, 4 * len(pick), box, holders, most)
            for k in range(len(pick)):
                given[i] += most[k] if pick[k] < 0 else 0
    return given


class Fitting:
    """Search for any way to place all boxes."""

    def __init__(
        self, listing: Listing, twins: Ints, arrange: Callable[[Ints], bool],
        room: Callable[[int], SearchRoom], budget: Budget,
    ) -> None:  # fmt: skip
        """``arrange`` is given an option for each box and says whether that is a solution."""
        self._listing, self._arrange, self._room = listing, arrange, room
        self._budget = budget
        self._box: Ints = np.repeat(np.arange(len(twins)), np.diff(listing.starts))
        spans = np.column_stack([listing.bin_of, listing.base, listing.top])
        self._rules = (
            listing.starts, self._box, listing.extents(), spans, listing.rank, twins,
            listing.leans, listing.needed, _holders(listing.leans, listing.holds),
        )  # fmt: skip
        self._most = np.zeros(len(twins), np.int64)
        self._possible: dict[tuple[bytes, bytes], bool] = {}

    def run(self) -> None:
        """Search until ``arrange`` says yes, or it is sure that it never will, or time is out."""
        pick = np.full(len(self._listing.starts) - 1, -1, np.int64)
        self._search(pick, -1, np.ones(len(self._box), np.bool_))

    def _search(self, pick: Ints, new: int, left: Flags) -> bool:
        """Give the other boxes options too; True once that is done, or time is out."""
        self._budget.take(1)
        if self._budget.is_out():
            return True
        possible = _narrow(pick, new, left, self._most, *self._rules, self._budget.stop)
        if self._budget.is_out():
            return True
        if not possible:
            return False
        others = np.flatnonzero(pick < 0)
        if len(others) == 0:
            return self._arrange(pick)
        if not self._fits(pick, left):
            return False
        held, lacks = self._to_hold_up(pick, left)
        if held < 0:
            fewest = others[np.argmin(self._counts(left)[others])]
            return self._give(fewest, left, pick, left)
        under = (self._listing.holds[held] > 0) & (pick < 0)[self._box]
        if not lacks and self._search(pick, -1, left & ~under):
            return True
        for i in others:
            if self._give(int(i), left & under, pick, left):
                return True
            left &= ~(under & (self._box == i))
        return False

    def _give(self, i: int, choice: Flags, pick: Ints, left: Flags) -> bool:
        """Try ``choice`` of the options of box ``i``; see :meth:`_search`."""
        own = slice(self._listing.starts[i], self._listing.starts[i + 1])
        for o in np.flatnonzero(choice[own]) + own.start:
            more, rest = pick.copy(), left.copy()
            more[i], rest[own] = o, False
            rest[o] = True
            if self._search(more, i, rest):
                return True
        return False

    def _counts(self, left: Flags) -> Ints:
        counts: Ints = np.add.reduceat(left, self._listing.starts[:-1], dtype=np.int64)
        return counts

    def _to_hold_up(self, pick: Ints, left: Flags) -> tuple[int, bool]:
        """An option picked that others may hold up too, and whether it lacks one; -1 for none.

        One that lacks a corner first, and of these the one that the fewest may hold up.
        """
        listing, picked = self._listing, pick[pick >= 0]
        open_to = left & (pick < 0)[self._box]
        chosen, order = (-1, False), (2, 0)
        for o in picked[listing.leans[picked]].tolist():
            lacks = bool(listing.holds[o, picked].sum() < listing.needed)
            holders = int((listing.holds[o] > 0)[open_to].sum())
            if holders and (not lacks, holders) < order:
                chosen, order = (o, lacks), (not lacks, holders)
        return chosen

    def _fits(self, pick: Ints, left: Flags) -> bool:
        """Whether what is picked for each bin may have a place; others may hold it up."""
        listing = self._listing
        elsewhere = _elsewhere(pick, left, self._box, listing.leans, self._rules[-1])
        picked = pick >= 0
        for j in np.unique(listing.bin_of[pick[picked]]):
            here = picked & (listing.bin_of[pick] == j)
            own, given = pick[here], elsewhere[here]
            if len(own) == 1:
                continue  # an option has a place
            key = (own.tobytes(), given.tobytes())
            if key not in self._possible:
                group = listing.group(own, 0.0, given)
                self._possible[key] = group.possible(self._budget, self._room(len(own)))
            if not self._possible[key]:
                return False
        return True
