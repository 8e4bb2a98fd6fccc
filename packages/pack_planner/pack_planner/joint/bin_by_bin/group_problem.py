"""What the search of one group works on, by name: the problem, a node of it, the stack of nodes.

Compiled code takes named tuples as it takes plain ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.bin_by_bin.who_goes_behind import BehindRoom, room_for

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Bytes = NDArray[np.int8]
Cells = NDArray[np.int16]


class GroupProblem(NamedTuple):
    """Boxes with given faces up and bases in one bin; lengths along x and y in cells.

    Attributes
    ----------
    after, near : next and nearest places of all rows, see :func:`.places.next_places`.
    rows : of each box in each turn, (boxes, turns).
    sizes : along x and y, (boxes, turns, axes).
    turns : how many turns each box has, 1 or 2.
    flat : what each costs besides w1 (x + y).
    leans : which of them need others under them.
    under : who may lie under whom, [upper, lower].
    beside : where rows are beside a wall or placed box, (rows, axes, cells).
    height : height map, millimetres.
    tolerance : of support, millimetres.
    needed : corners of each box that must be held here.
    w1 : cost of a cell.
    base : of each box, millimetres.
    meets : who overlaps with whom in height.
    contact : whether contact is asked for.
    wholly : who rests wholly on each box, itself included, as bits.
    doubtful : whose corners have to be looked at, ON_ANYTHING or ON_BOXES alone.
    """

    after: Cells
    near: Cells
    rows: Ints
    sizes: Ints
    turns: Ints
    flat: Floats
    leans: Flags
    under: Flags
    beside: Flags
    height: NDArray[np.int32]
    tolerance: int
    needed: Ints
    w1: float
    base: Ints
    meets: Flags
    contact: bool
    wholly: Ints
    doubtful: Bytes


class GroupRoot(NamedTuple):
    """Where the search of a group begins.

    Attributes
    ----------
    low, high : least and most x and y of each box, (boxes, 2).
    apart : relations that always hold, (axes, boxes, boxes).
    """

    low: Ints
    high: Ints
    apart: Ints


class NodeStack(NamedTuple):
    """Nodes of the search of a group; the last row is the one that is looked at.

    Attributes
    ----------
    low, high : least and most x, y of each box, (nodes, boxes, 2), cells.
    apart : distances that relations ask for, (nodes, axes, boxes, boxes).
    clear : pairs that are kept apart, (nodes, boxes, boxes).
    corner : states of the corners, (nodes, boxes, 4), see :mod:`.branching`.
    turn : of each box, 2 for either, (nodes, boxes).
    cost : the least of each box.
    place : its cheapest place (x, y, turn), (nodes, boxes, 3).
    bound : of the node, (nodes, 1).
    touch : what a box touches along x and y: 0 not decided, 1 a wall or a placed box, 2 another
        box, (nodes, boxes, 2).
    least : least cost by turn, (nodes, boxes, 2).
    stale : whose place must be found anew.
    """

    low: Ints
    high: Ints
    apart: Ints
    clear: Flags
    corner: Bytes
    turn: Bytes
    cost: Floats
    place: Ints
    bound: Floats
    touch: Bytes
    least: Floats
    stale: Flags


class Node(NamedTuple):
    """The node that is looked at: rows of :class:`NodeStack`, and room to work in.

    Attributes
    ----------
    ends : where each box ends at most, (boxes, 2).
    spot : a place (x, y, turn).
    loads : what each box that rests on another one costs.
    """

    low: Ints
    high: Ints
    apart: Ints
    clear: Flags
    corner: Bytes
    turn: Bytes
    cost: Floats
    place: Ints
    bound: Floats
    touch: Bytes
    least: Floats
    stale: Flags
    ends: Ints
    spot: Ints
    loads: Floats


class SearchRoom(NamedTuple):
    """Where the groups of so many boxes are searched.

    Attributes
    ----------
    stack, node : see there.
    sides, parted : what two boxes cost beside each other, (turns, turns, sides): of the pair that
        is looked at and of the best one so far.
    extra : what two boxes must pay on top, (boxes, boxes).
    matched : for each set of boxes what disjoint pairs in it pay, see :mod:`.disjoint_pairs`.
    behind : see :class:`.who_goes_behind.BehindRoom`.
    """

    stack: NodeStack
    node: Node
    sides: Floats
    parted: Floats
    extra: Floats
    matched: Floats
    behind: BehindRoom


class BinOptions(NamedTuple):
    """The options of a bin as groups are made of them.

    Attributes
    ----------
    rows : of each option in each turn, (options, 2).
    span : base and top, (options, 2), millimetres.
    flat : what it costs besides w1 (x + y).
    leans : whether it needs others under it.
    level : whether a placed top is level with its base.
    holds : how many corners of one another may hold, [upper, lower].
    """

    rows: Ints
    span: Ints
    flat: Floats
    leans: Flags
    level: Flags
    holds: Bytes


class PlacedTops(NamedTuple):
    """What boxes of the look-ahead may stand on, and when they do.

    Attributes
    ----------
    height : highest top over each cell, millimetres.
    tolerance : how far below a base it may lie, millimetres.
    needed : corners of a base that must be held.
    """

    height: NDArray[np.int32]
    tolerance: int
    needed: int


class BinTables(NamedTuple):
    """All that groups in one bin have in common.

    Attributes
    ----------
    options : see :class:`BinOptions`.
    sizes : along x and y, of each row, (rows, 2), cells.
    ranges : least and most x and y of its places, (rows, axes, 2).
    after, near, beside : see :class:`GroupProblem`.
    filled : which rows ``after`` and ``near`` are there for.
    tops : see :class:`.options.PlacedTops`.
    w1 : cost of a cell.
    """

    options: BinOptions
    sizes: Ints
    ranges: Ints
    after: Cells
    near: Cells
    beside: Flags
    filled: Flags
    tops: PlacedTops
    w1: float


#: Rows of the stack of nodes; a search that needs more gives up.
_MOST_OPEN = 4096


def search_room(count: int) -> SearchRoom:
    """Room to search groups of ``count`` boxes."""
    n = _MOST_OPEN
    stack = NodeStack(
        low=np.zeros((n, count, 2), np.int64),
        high=np.zeros((n, count, 2), np.int64),
        apart=np.zeros((n, 2, count, count), np.int64),
        clear=np.zeros((n, count, count), np.bool_),
        corner=np.zeros((n, count, 4), np.int8),
        turn=np.zeros((n, count), np.int8),
        cost=np.zeros((n, count)),
        place=np.zeros((n, count, 3), np.int64),
        bound=np.zeros((n, 1)),
        touch=np.zeros((n, count, 2), np.int8),
        least=np.zeros((n, count, 2)),
        stale=np.zeros((n, count), np.bool_),
    )
    last = NodeStack(*(rows[-1] for rows in stack))
    node = Node(
        last.low, last.high, last.apart, last.clear, last.corner, last.turn, last.cost, last.place,
        last.bound, last.touch, last.least, last.stale, np.zeros((count, 2), np.int64),
        np.zeros(3, np.int64), np.zeros(count),
    )  # fmt: skip
    sides = np.zeros((2, 2, 2, 4))
    return SearchRoom(
        stack, node, sides[0], sides[1], np.zeros((count, count)), np.zeros(1 << count),
        room_for(count),
    )  # fmt: skip
