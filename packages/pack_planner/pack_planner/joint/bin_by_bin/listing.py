"""Options of all boxes in all bins, side by side, and what is known of pairs of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.values import Box
from pack_planner.engine import BinModel
from pack_planner.joint.bin_by_bin.group import close, problem_of, row_ranges
from pack_planner.joint.bin_by_bin.option_pairs import pair_costs
from pack_planner.joint.bin_by_bin.options import (
    BinPlaces,
    Corners,
    Flags,
    Ints,
    Options,
    corners_needed,
    holding,
    level_with_placed,
    list_options,
)
from pack_planner.joint.bin_by_bin.places import next_places

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
        caps: NDArray[np.float64], limits: NDArray[np.float64], *, cep: bool = False,
    ) -> None:  # fmt: skip
        """``caps`` of boxes and ``limits`` of pairs: the most that they may cost."""
        self._places, self._bins, self._cep = places, bins, cep
        self._options = [
            list_options(one, model.source.spec.size_mm[2], boxes, caps)
            for one, model in zip(places, bins, strict=True)
        ]
        box = np.concatenate([one.box for one in self._options])
        cost = np.concatenate([one.cost for one in self._options])
        order = np.lexsort((cost, box))
        counts = [len(one.box) for one in self._options]
        self.bin_of: Ints = np.repeat(np.arange(len(bins)), counts)[order]
        self._local: Ints = np.concatenate([np.arange(count) for count in counts])[order]
        self.cost, self.base = cost[order], self._of('base', order)
        self.top: Ints = self._of('top', order)
        self.leans: Flags = self._of('leans', order)
        self.starts: Ints = np.searchsorted(box[order], np.arange(len(boxes) + 1)).astype(np.int64)
        kinds = np.column_stack([self.bin_of, self._of('size', order), self.base, self.leans])
        self.rank: Ints = np.unique(kinds, axis=0, return_inverse=True)[1].ravel()
        self._limits = limits
        self.too_many = len(order) > MOST_OPTIONS
        if not self.too_many:
            self._hold()
        self._tables: dict[int, tuple[Any, ...]] = {}

    def _of(self, name: str, order: Ints) -> NDArray[Any]:
        return np.concatenate([getattr(one, name) for one in self._options])[order]

    def _numbers(self, j: int) -> Ints:
        """Numbers of the options in bin ``j``, in the order they have there."""
        here = np.flatnonzero(self.bin_of == j)
        return here[np.argsort(self._local[here])]

    def _hold(self) -> None:
        count = len(self.bin_of)
        self.holds: Corners = np.zeros((count, count), np.int8)
        self.needed = corners_needed(self._places[0].ground)
        self._under: list[Corners] = []
        for j, (one, places) in enumerate(zip(self._options, self._places, strict=True)):
            at = self._numbers(j)
            self._under.append(holding(one, places.ground))
            self.holds[np.ix_(at, at)] = self._under[j]
        self.held: Corners = np.ascontiguousarray(self.holds.T)

    def compare(self) -> None:
        """Find ``extra`` and ``behind``."""
        count = len(self.bin_of)
        self.extra, self.behind = np.zeros((count, count)), np.zeros((count, count))
        for j, (one, places) in enumerate(zip(self._options, self._places, strict=True)):
            pair_costs(
                one.rows, one.by_x, one.by_y, places.shapes[one.row[:, 3], 2:4],
                np.column_stack([one.base, one.top]), one.box, one.cost, one.flat,
                places.weights[0], self._limits, self._numbers(j), self.extra, self.behind,
            )  # fmt: skip

    def extents(self) -> Ints:
        """Least and most place and size of each option, cells: (options, turns, axes, 3)."""
        found = np.zeros((len(self.bin_of), 2, 2, 3), np.int64)
        for j, (one, places) in enumerate(zip(self._options, self._places, strict=True)):
            rows = np.concatenate(
                [row_ranges(one.by_x, one.by_y), places.shapes[one.row[:, 3], 2:4, None]], axis=2
            )
            found[self._numbers(j)] = rows[one.rows]
        return found

    def shape_of(self, option: int, turn: int) -> int:
        """Which shape of its bin an option in one of its turns is."""
        one = self._options[self.bin_of[option]]
        return int(one.row[one.rows[self._local[option], turn], 3])

    def problem_of(
        self, own: Ints, elsewhere: Ints | None = None
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Some options of one bin as :mod:`.relations` wants them.

        ``elsewhere`` : how many corners of each other boxes than these may hold; then contact is
        not asked for. None when these are all.
        """
        tables, elsewhere = self._tables_of(own, elsewhere)
        found: tuple[tuple[Any, ...], tuple[Any, ...]] = problem_of(
            self._local[own], *tables, elsewhere
        )
        return found

    def close(
        self, groups: Ints, wanted: NDArray[np.float64], bounds: NDArray[np.float64],
        nodes: tuple[NDArray[Any], ...], budget: int, elsewhere: Ints | None = None,
    ) -> int:  # fmt: skip
        """:func:`.groups.close` for options of one bin, all in one go."""
        tables, elsewhere = self._tables_of(groups, elsewhere)
        return int(close(self._local[groups], elsewhere, wanted, bounds, nodes, budget, tables))

    def _tables_of(self, own: Ints, elsewhere: Ints | None) -> tuple[tuple[Any, ...], Ints]:
        """What :func:`.groups.problem_of` asks for, ready for some options of one bin.

        ``elsewhere`` as in :meth:`problem_of`, and returned in full.
        """
        j = int(self.bin_of[own.flat[0]])
        places = self._places[j]
        if j not in self._tables:
            self._tables[j] = self._make_tables(j)
        options, sizes, ranges, after, near, filled, beside = self._tables[j]
        needed = np.unique(self._options[j].rows[self._local[own]])
        missing = needed[~filled[needed]]
        if len(missing):
            one = self._options[j]
            next_places(
                missing, one.row, places.shapes, places.land, places.low, places.weak,
                places.ground, places.zones, places.refusal, after, near,
            )  # fmt: skip
            filled[missing] = True
        tables = (
            options, sizes, ranges, after, near, beside, places.ground, places.weights[0],
            self._cep and elsewhere is None,
        )  # fmt: skip
        return tables, np.zeros(own.shape, np.int64) if elsewhere is None else elsewhere

    def _make_tables(self, j: int) -> tuple[Any, ...]:
        one, places = self._options[j], self._places[j]
        ranges = row_ranges(one.by_x, one.by_y)
        x, y = (int(ranges[:, axis, 1].max(initial=0)) + 1 for axis in (0, 1))
        after = np.empty((len(one.row), y + 1, x), np.int16)
        near = np.empty((len(one.row), y + 1, x + 1, 2), np.int16)
        options = (
            one.rows, np.column_stack([one.base, one.top]), one.flat, one.leans,
            level_with_placed(one.base, places.ground), self._under[j],
        )  # fmt: skip
        sizes = places.shapes[one.row[:, 3], 2:4]
        filled = np.zeros(len(one.row), np.bool_)
        return options, sizes, ranges, after, near, filled, self._beside(j, one, sizes)

    def _beside(self, j: int, one: Options, sizes: Ints) -> Flags:
        """Where each row is beside a wall or placed box along x and y, (rows, axes, cells)."""
        if not self._cep:
            return np.zeros((1, 2, 1), np.bool_)
        source, step = self._bins[j].source, int(self._places[j].refusal[1])
        cells = max(self._places[j].ground[0].shape)
        found = np.zeros((len(one.row), 2, cells), np.bool_)
        low = np.arange(cells) * step
        for axis in (0, 1):
            for wide in np.unique(sizes[:, axis]):
                high = low + wide * step
                good = (low < step) | (source.spec.size_mm[axis] - high < step)
                for box in source.boxes:
                    after, before = low - box.far_mm[axis], box.corner_mm[axis] - high
                    good |= ((after >= 0) & (after < step)) | ((before >= 0) & (before < step))
                found[sizes[:, axis] == wide, axis] = good
        return found
