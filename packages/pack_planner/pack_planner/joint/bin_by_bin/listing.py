"""Options of all boxes in all bins, side by side, and what is known of pairs of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.values import Box
from pack_planner.engine import BinModel
from pack_planner.joint.bin_by_bin.assignments import assignments, later
from pack_planner.joint.bin_by_bin.group import Group, explore, row_ranges
from pack_planner.joint.bin_by_bin.group_problem import (
    BinOptions,
    BinTables,
    Flags,
    Ints,
    SearchRoom,
)
from pack_planner.joint.bin_by_bin.option_pairs import pair_costs
from pack_planner.joint.bin_by_bin.options import (
    BinPlaces,
    BoxOptions,
    Corners,
    corners_needed,
    holding,
    level_with_placed,
    list_options,
)
from pack_planner.joint.bin_by_bin.places import next_places
from pack_planner.joint.bin_by_bin.who_goes_behind import room_for
from pack_planner.joint.budget import Budget

#: Options that are compared in pairs at most.
MOST_OPTIONS = 4000


class Listing:
    """What a joint solution below a known cost chooses from.

    Attributes
    ----------
    starts : options of box i are those from starts[i] to starts[i + 1], the cheapest first.
    bin_of, base, top, leans, cost : of each option: its bin, its base and top in millimetres,
        whether it needs another option under it, the least that it costs.
    extra : what two options must pay on top, infinite where they cannot be had together.
    behind : what one must pay when it goes behind another one, [behind, in front]; these two are
        there after :meth:`compare`.
    holds, held : how many corners of one option another one under it may hold at most, [upper,
        lower] and [lower, upper].
    needed : corners that must be held.
    rank : equal for the same option of another box, and in one order for all boxes.
    """

    def __init__(
        self, places: Sequence[BinPlaces], boxes: Sequence[Box], bins: Sequence[BinModel],
        caps: NDArray[np.float64], limits: NDArray[np.float64], stop: Flags, *, cep: bool = False,
    ) -> None:  # fmt: skip
        """``caps`` of boxes and ``limits`` of pairs: the most that they may cost.

        Not complete, and not to be used, once ``stop`` is raised.
        """
        self._stop = stop
        self._places, self._bins, self._cep = places, bins, cep
        self._options = [
            list_options(own, model.source.spec.size_mm[2], boxes, caps, stop)
            for own, model in zip(places, bins, strict=True)
        ]
        box = np.concatenate([options.box for options in self._options])
        cost = np.concatenate([options.cost for options in self._options])
        order = np.lexsort((cost, box))
        counts = [len(options.box) for options in self._options]
        self.too_many = len(order) > MOST_OPTIONS
        self.bin_of: Ints = np.repeat(np.arange(len(bins)), counts)[order]
        self._local: Ints = np.concatenate([np.arange(count) for count in counts])[order]
        self.cost, self.base = cost[order], self._of('base', order)
        self.top: Ints = self._of('top', order)
        self.leans: Flags = self._of('leans', order)
        self.starts: Ints = np.searchsorted(box[order], np.arange(len(boxes) + 1)).astype(np.int64)
        self._limits = limits
        self._tables: dict[int, BinTables] = {}
        if self.too_many or stop[0]:
            return
        kinds = np.column_stack([self.bin_of, self._of('size', order), self.base, self.leans])
        self.rank: Ints = np.unique(kinds, axis=0, return_inverse=True)[1].ravel()
        self._hold()

    def _of(self, name: str, order: Ints) -> NDArray[Any]:
        return np.concatenate([getattr(options, name) for options in self._options])[order]

    def _numbers(self, j: int) -> Ints:
        """Numbers of the options in bin ``j``, in the order they have there."""
        here = np.flatnonzero(self.bin_of == j)
        return here[np.argsort(self._local[here])]

    def _hold(self) -> None:
        count = len(self.bin_of)
        self.holds: Corners = np.zeros((count, count), np.int8)
        self.needed = corners_needed(self._places[0].tops)
        self._under: list[Corners] = []
        for j, (options, places) in enumerate(zip(self._options, self._places, strict=True)):
            at = self._numbers(j)
            if self._stop[0]:
                return
            self._under.append(holding(options, places.tops, self._stop))
            self.holds[np.ix_(at, at)] = self._under[j]
        if not self._stop[0]:
            self.held: Corners = np.ascontiguousarray(self.holds.T)

    def compare(self) -> None:
        """Find ``extra``, ``behind`` and what :func:`.assignments.assignments` asks for."""
        count = len(self.bin_of)
        self.extra, self.behind = np.zeros((count, count)), np.zeros((count, count))
        self._later = later(self.starts, self.cost, self.leans, self.holds, self.needed, self._stop)
        for j, (options, places) in enumerate(zip(self._options, self._places, strict=True)):
            sizes = np.ascontiguousarray(places.shapes[options.row[:, 3], 2:4])
            pair_costs(
                options.rows, options.by_x, options.by_y, sizes,
                np.column_stack([options.base, options.top]), options.box, options.cost,
                options.flat,
                places.weights.position, self._limits, self._numbers(j), self.extra, self.behind,
                self._stop,
            )  # fmt: skip

    def assignments(self, twins: Ints, goal: float, most: int, visits: int) -> Ints | None:
        """The assignments that may cost less than ``goal``, None for too many or no time."""
        picks: Ints = assignments(
            self.starts, self.cost, self.extra, self.behind, self.rank, twins, self.leans,
            self.holds, self.held, self.needed, self._later,
            room_for(len(twins)), goal, most, visits, self._stop,
        )  # fmt: skip
        return picks if len(picks) <= most else None

    def extents(self) -> Ints:
        """Least and most place and size of each option, cells: (options, turns, axes, 3)."""
        extents = np.zeros((len(self.bin_of), 2, 2, 3), np.int64)
        for j, (options, places) in enumerate(zip(self._options, self._places, strict=True)):
            rows = np.concatenate(
                [
                    row_ranges(options.by_x, options.by_y),
                    places.shapes[options.row[:, 3], 2:4, None],
                ],
                axis=2,
            )
            extents[self._numbers(j)] = rows[options.rows]
        return extents

    def shape_of(self, option: int, turn: int) -> int:
        """Which shape of its bin an option in one of its turns is."""
        options = self._options[self.bin_of[option]]
        return int(options.row[options.rows[self._local[option], turn], 3])

    def group(self, own: Ints, bound: float, elsewhere: Ints | None = None) -> Group:
        """Some options of one bin, of which nothing is known but that they cost ``bound``.

        ``elsewhere`` : how many corners of each other boxes than these may hold; then contact is
        not asked for. None when these are all.
        """
        contact = self._cep and elsewhere is None
        given = np.zeros(own.shape, np.int64) if elsewhere is None else elsewhere
        return Group(self._local[own], given, self._tables_of(own), contact, bound)

    def close(
        self, groups: Ints, wanted: NDArray[np.float64], bounds: NDArray[np.float64],
        room: SearchRoom, most_nodes: int, budget: Budget,
        elsewhere: Ints | None = None,
    ) -> None:  # fmt: skip
        """:func:`.group.explore` for options of one bin, all in one go.

        Parameters
        ----------
        groups : rows of options, as many in each.
        wanted, bounds : of each group, see there.
        room : for groups of this size.
        most_nodes : to take for each group.
        budget : the nodes are taken from it.
        elsewhere : see :meth:`group`.
        """
        if len(groups) == 0 or budget.is_out():
            return
        contact = self._cep and elsewhere is None
        given = np.zeros(groups.shape, np.int64) if elsewhere is None else elsewhere
        counters = np.zeros(3, np.int64)
        explore(
            self._local[groups], given, self._tables_of(groups), contact, wanted, bounds, room,
            counters, (most_nodes, budget.nodes_left), True, False, budget.stop,
        )  # fmt: skip
        budget.take(int(counters[2]))

    def _tables_of(self, own: Ints) -> BinTables:
        """The tables of a bin, ready for some of its options."""
        j = int(self.bin_of[own.flat[0]])
        if j not in self._tables:
            self._tables[j] = self._make_tables(j)
        options, places, tables = self._options[j], self._places[j], self._tables[j]
        needed = np.unique(options.rows[self._local[own]])
        missing = needed[~tables.filled[needed]]
        if len(missing):
            next_places(
                missing, options.row, places.shapes, places.land, places.low, places.weak,
                places.tops, places.zones, places.refusal, tables.after, tables.near, self._stop,
            )  # fmt: skip
            tables.filled[missing] = not self._stop[0]
        return tables

    def _make_tables(self, j: int) -> BinTables:
        options, places = self._options[j], self._places[j]
        ranges = row_ranges(options.by_x, options.by_y)
        x, y = (int(ranges[:, axis, 1].max(initial=0)) + 1 for axis in (0, 1))
        sizes = np.ascontiguousarray(places.shapes[options.row[:, 3], 2:4])
        return BinTables(
            options=BinOptions(
                rows=options.rows,
                span=np.column_stack([options.base, options.top]),
                flat=options.flat,
                leans=options.leans,
                level=level_with_placed(options.base, places.tops),
                holds=self._under[j],
            ),
            sizes=sizes,
            ranges=ranges,
            after=np.empty((len(options.row), y + 1, x), np.int16),
            near=np.empty((len(options.row), y + 1, x + 1, 2), np.int16),
            beside=self._beside(j, options, sizes),
            filled=np.zeros(len(options.row), np.bool_),
            tops=places.tops,
            w1=places.weights.position,
        )

    def _beside(self, j: int, options: BoxOptions, sizes: Ints) -> Flags:
        """Where each row is beside a wall or placed box along x and y, (rows, axes, cells)."""
        if not self._cep:
            return np.zeros((1, 2, 1), np.bool_)
        source, step = self._bins[j].source, int(self._places[j].refusal.step)
        cells = max(self._places[j].tops.height.shape)
        beside = np.zeros((len(options.row), 2, cells), np.bool_)
        low = np.arange(cells) * step
        for axis in (0, 1):
            for wide in np.unique(sizes[:, axis]):
                high = low + wide * step
                good = (low < step) | (source.spec.size_mm[axis] - high < step)
                for box in source.boxes:
                    after, before = low - box.far_mm[axis], box.corner_mm[axis] - high
                    good |= ((after >= 0) & (after < step)) | ((before >= 0) & (before < step))
                beside[sizes[:, axis] == wide, axis] = good
        return beside
