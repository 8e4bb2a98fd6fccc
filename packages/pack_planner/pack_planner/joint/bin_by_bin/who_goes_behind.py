"""Compiled: what boxes must pay at least when of any two that meet one goes behind the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.compiled import uncounted


class BehindRoom(NamedTuple):
    """Room for :func:`least_behind`.

    Attributes
    ----------
    pays : what each box pays at least when the second box of a pair goes behind the first, and the
        other way round, (pairs, 2, boxes); much where that is impossible.
    paid, way : what they pay with the pairs so far, and which way these go.
    """

    pays: NDArray[np.float64]
    paid: NDArray[np.float64]
    way: NDArray[np.int64]


def room_for(count: int) -> BehindRoom:
    """Room for ``count`` boxes."""
    pairs = count * (count - 1) // 2 + 1
    return BehindRoom(
        np.zeros((pairs, 2, count)), np.zeros((pairs, count)), np.zeros(pairs, np.int64)
    )


@uncounted
def least_behind(count, pairs, most, room):  # type: ignore[no-untyped-def]
    """The least that ``count`` boxes pay, ``most`` if it is not less.

    For each of ``pairs`` it is tried which of the two goes behind; a box pays once for all that it
    goes behind, the most that any of them asks for. ``room`` is from :func:`room_for`.
    """
    pays, paid, way = room
    if pairs == 0:
        return min(most, 0.0)
    level = 0
    for m in range(count):
        paid[0, m] = 0.0
    way[0] = -1
    while level >= 0:
        way[level] += 1
        if way[level] > 1:
            level -= 1
            continue
        total = 0.0
        for m in range(count):
            one = max(paid[level, m], pays[level, way[level], m])
            paid[level + 1, m] = one
            total += one
        if total >= most:
            continue
        if level == pairs - 1:
            most = total
            continue
        level += 1
        way[level] = -1
    return most
