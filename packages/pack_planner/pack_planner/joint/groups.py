"""One group: boxes with given faces up in one bin, made ready for :mod:`.relations`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.joint.bounds import NEVER
from pack_planner.joint.branching import EITHER, NONE
from pack_planner.joint.relations import FULL, PAUSED, SOLUTION, search

#: Rows of the stack of nodes; a search that needs more gives up.
_ROOM = 4096
#: Nodes between looks at the clock.
_CHUNK = 100

Ints = NDArray[np.int64]


@njit(cache=True, nogil=True)
def levels_of(tops, heights, highest):  # type: ignore[no-untyped-def]
    """The least base that each box can have at or above each height, (boxes, highest + 2).

    A base is the floor, a placed top, or the top of another box.
    """
    count = len(heights)
    found = np.full((count, highest + 2), NEVER, np.int32)
    for i in range(count):
        can = np.zeros(highest + 1, np.bool_)
        can[0] = True
        for top in tops:
            if top <= highest:
                can[top] = True
        for k in range(count):
            if k == i:
                continue
            for z in range(highest, heights[k] - 1, -1):
                if can[z - heights[k]]:
                    can[z] = True
        following = NEVER
        for z in range(highest, -1, -1):
            if can[z]:
                following = z
            found[i, z] = following
    return found


def empty_nodes(count: int) -> tuple[NDArray[Any], ...]:
    """Arrays of the nodes of a search with ``count`` boxes, for :func:`.relations.search`.

    Least and most x, y, z of each box (cells, cells, millimetres); distances that relations ask
    for, by axis; pairs that are kept apart; which box may lie under which; states of the corners;
    turn, 2 for either; least cost and cheapest place (x, y, z, turn); bound; what a box touches
    along x and y: 0 not decided, 1 a wall or a placed box, 2 another box; least cost by turn;
    whose place must be found anew.
    """
    n = _ROOM
    return (
        np.zeros((n, count, 3), np.int64), np.zeros((n, count, 3), np.int64),
        np.zeros((n, 3, count, count), np.int64), np.zeros((n, count, count), np.bool_),
        np.zeros((n, count, count), np.bool_), np.zeros((n, count, 4), np.int8),
        np.zeros((n, count), np.int8), np.zeros((n, count)), np.zeros((n, count, 4), np.int64),
        np.zeros((n, 1)), np.zeros((n, count, 2), np.int8),
        np.zeros((n, count, 2)), np.zeros((n, count), np.bool_),
    )  # fmt: skip


@dataclass
class Group:
    """Boxes with given faces up in one bin.

    Attributes
    ----------
    problem : arrays for :func:`.relations.search`: bases (boxes, turns, cells, cells), cost
        besides that of position and base, sizes (boxes, turns, 3), turns, height map, levels,
        refused positions, places beside a wall or placed box, whether contact is asked for,
        (tolerance, corners needed), weights, (radius of refusal, resolution), weak places.
    low, high : first ranges, (boxes, 3).
    bound : nothing in this group costs less.
    cost : of the best arrangement found, infinite without.
    places : that arrangement, rows (x, y, z, turn).
    """

    problem: tuple[Any, ...]
    low: Ints
    high: Ints
    bound: float
    cost: float = np.inf
    places: Ints = field(default_factory=lambda: np.zeros((0, 4), np.int64))

    def improve(
        self, upper: float, node_limit: int, valid: Callable[[Ints], bool],
        out_of_time: Callable[[], bool], nodes: tuple[NDArray[Any], ...],
    ) -> int:  # fmt: skip
        """Search for less than ``upper``; returns the nodes taken. Raises ``bound`` by what it saw.

        ``valid`` says whether places keep the rules that the search does not know.
        """
        count = len(self.low)
        lo, hi, apart, known, may, corner, turn, cost, _, bound, touch, _, stale = nodes
        lo[0], hi[0], apart[0], known[0], may[0], corner[0] = self.low, self.high, NONE, 0, 1, 0
        turn[0] = np.where(self.problem[3] > 1, EITHER, 0)
        cost[0], bound[0], stale[0] = 0.0, self.bound, True
        touch[0] = 1 if count == 1 and self.problem[8] else 0
        counters = np.array([1, 0], np.int64)
        best, rejected = upper, False
        while True:
            left = min(_CHUNK, node_limit - int(counters[1]))
            why = search(self.problem, nodes, counters, best, left, rejected)
            rejected = False
            if why == SOLUTION:
                places = nodes[8][-1].copy()
                if valid(places):
                    best = float(nodes[7][-1].sum())
                    self.cost, self.places = best, places
                else:
                    rejected = True
            elif why == FULL or (why == PAUSED and (counters[1] >= node_limit or out_of_time())):
                open_bounds = bound[: counters[0], 0]
                self.bound = max(self.bound, min(best, float(open_bounds.min(initial=best))))
                return int(counters[1])
            elif why != PAUSED:
                self.bound = max(self.bound, best)
                return int(counters[1])
