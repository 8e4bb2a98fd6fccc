"""Bounds of many groups of boxes in one go, before any of them is searched alone.

The same large boxes are in many groups, that differ in where the small ones are. So a group's
largest boxes are searched first; if they alone cost too much, so do all groups that they are in.
Most of the others are shown by a node or two to cost too much, in less time than it takes to begin
with one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.bin_by_bin.group_problem import Ints, SearchRoom
from pack_planner.joint.bin_by_bin.listing import Listing
from pack_planner.joint.budget import Budget

#: Nodes for a whole group, and for some boxes of many groups.
_FEW_NODES, _MORE_NODES = 5, 2000
#: Boxes that are left out of a group, and boxes that must be left.
_LEFT_OUT, _FEWEST = (2, 1), 3
#: Corners that others may hold when any of them may.
_ALL_CORNERS = 4
_EPS = 1e-6

Floats = NDArray[np.float64]


class Closing:
    """Raises the bounds of groups of one listing."""

    def __init__(
        self, listing: Listing, largest_first: Ints, room: Callable[[int], SearchRoom],
        budget: Budget,
    ) -> None:  # fmt: skip
        """``largest_first`` is the order of the boxes."""
        self._listing, self._order, self._room = listing, largest_first, room
        self._budget = budget
        #: Bound of some boxes with given options, and what they were tried for.
        self._parts: dict[bytes, tuple[float, float]] = {}
        self._rows: Ints = np.zeros((0, len(largest_first)), np.int64)
        self._tried = np.zeros(0, np.bool_)

    def begin(self, rows: Ints) -> None:
        """Take new groups: rows of options, -1 for none."""
        self._rows = rows
        self._tried = (rows >= 0).sum(axis=1) < 2

    def close(self, parts: Ints, bounds: Floats, upper: float) -> None:
        """Raise ``bounds`` of the groups of assignments that may cost less than ``upper``.

        Each group once.
        """
        left_open = parts[bounds[parts].sum(axis=1) < upper - _EPS]
        wanted = np.full(len(bounds), -math.inf)
        room = upper - bounds[left_open].sum(axis=1)[:, None] + bounds[left_open]
        np.maximum.at(wanted, left_open.ravel(), room.ravel())
        which = np.flatnonzero((wanted > bounds) & ~self._tried)
        self._tried[which] = True
        sizes = (self._rows[which] >= 0).sum(axis=1)
        in_bin = self._listing.bin_of[self._rows[which].max(axis=1)]
        for j, size in np.unique(np.column_stack([in_bin, sizes]), axis=0).tolist():
            own = which[(in_bin == j) & (sizes == size)]
            groups = self._rows[own][:, self._order]
            groups = groups[groups >= 0].reshape(-1, size)
            better = bounds[own]
            for left_out in _LEFT_OUT:
                left = np.flatnonzero(better < wanted[own] - _EPS)
                if len(left) and size - left_out >= _FEWEST:
                    self._by_part(groups[left], size - left_out, wanted[own[left]], better, left)
            left = np.flatnonzero(better < wanted[own] - _EPS)
            if len(left):
                whole = better[left]
                self._listing.close(
                    groups[left], wanted[own[left]], whole, self._room(size), _FEW_NODES,
                    self._budget,
                )  # fmt: skip
                better[left] = whole
            bounds[own] = better

    def _by_part(
        self, groups: Ints, count: int, wanted: Floats, bounds: Floats, which: Ints
    ) -> None:
        """Raise the bounds of ``which`` by those of their first ``count`` boxes."""
        listing = self._listing
        part, rest = groups[:, :count], groups[:, count:]
        beside = listing.cost[rest].sum(axis=1)
        held = listing.holds[part[:, :, None], rest[:, None, :]].max(axis=2) > 0
        rows, inverse = np.unique(
            np.hstack([part, _ALL_CORNERS * held]), axis=0, return_inverse=True
        )
        inverse = inverse.ravel()
        upper = np.full(len(rows), -math.inf)
        np.maximum.at(upper, inverse, wanted - beside)
        keys = [row.tobytes() for row in rows]
        known = np.array([self._parts.get(key, (0.0, 0.0)) for key in keys])
        lower = known[:, 0]
        new = np.flatnonzero(known.max(axis=1) < upper - _EPS)
        better = lower[new]
        listing.close(
            np.ascontiguousarray(rows[new, :count]), upper[new], better, self._room(count),
            _MORE_NODES, self._budget, np.ascontiguousarray(rows[new, count:]),
        )  # fmt: skip
        lower[new] = better
        for n in new.tolist():
            self._parts[keys[n]] = (float(lower[n]), float(upper[n]))
        bounds[which] = np.maximum(bounds[which], lower[inverse] + beside)
