"""How high the pad goes on its way: a string pulled taut over what really stands below.

The way across is given as samples seen from above. At each of them something may stand below the
footprint of what the pad carries; the string runs from the first height to the last one above all
of it. Metres and radians, frame `cell`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.path import Waypoint, positions

Array = NDArray[np.float64]

#: Air under the box, and under the empty pad, above what they swing over; and beside them.
CLEAR, BESIDE = 0.05, 0.02
#: A corner rounded within 1 m is straight to 3 mm beyond this distance, see `path.rounded`.
_ROUND = 0.55
#: The air grows from this much next to a place around which nothing stands higher.
_LIFT = 0.02


@dataclass(frozen=True)
class Carried:
    """What hangs on the pad, the pad itself included: half extents, height, yaw less the pad's."""

    half: tuple[float, float]
    height: float
    yaw: float = 0.0

    def footprint(self, yaw: Array) -> Array:
        """Half extents (n, 2) along x and y of `cell` for yaws (n,) of the pad."""
        cosine, sine = np.abs(np.cos(yaw + self.yaw)), np.abs(np.sin(yaw + self.yaw))
        ex, ey = self.half
        return np.stack([cosine * ex + sine * ey, sine * ex + cosine * ey], axis=1)


@dataclass(frozen=True)
class Obstacles:
    """Axis-aligned extents of everything that stands in the cell, ``low`` and ``high`` (m, 3)."""

    low: Array
    high: Array

    def tops(self, xy: Array, half: Array, beside: Array) -> Array:
        """Highest top (n,) under footprints around ``xy`` (n, 2), grown by ``beside`` (n,)."""
        reach = half + beside[:, None]
        under = (
            (self.low[None, :, :2] < (xy + reach)[:, None])
            & (self.high[None, :, :2] > (xy - reach)[:, None])
        ).all(axis=2)
        highest: Array = np.where(under, self.high[None, :, 2], 0.0).max(axis=1, initial=0.0)
        return highest


def taut(
    across: Array, ends: tuple[float, float], what: Carried, obstacles: Obstacles, corner: float
) -> list[Waypoint]:
    """Waypoints along ``across`` (n, 5), heights filled in.

    Parameters
    ----------
    ends : heights of the pad at the first and the last sample; it leaves and reaches them straight
        up and down.
    what : what the pad carries.
    obstacles : what it must pass over.
    corner : distance within which corners will be rounded: beside something higher than the box is
        low, the round needs more room.
    """
    pads = positions(across)[:, :2]
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(pads, axis=0), axis=1))]
    half = what.footprint(across[:, 4])
    begin, end = ends
    near = np.minimum(way, way[-1] - way)
    # A rounded corner comes nearer to what it goes round.
    wider = np.clip(near, BESIDE, BESIDE + corner / 10)
    tops = obstacles.tops(pads, half, wider)
    room = max(CLEAR, _ROUND * corner)
    exits = []
    for index, height in ((0, begin), (-1, end)):
        beside = tops[index] > height - what.height + 0.005
        exits.append(max(height, tops[index] + what.height + room if beside else 0.0))
    middle = (near > BESIDE) & (np.arange(len(way)) > 0) & (np.arange(len(way)) < len(way) - 1)
    air = np.minimum(max(CLEAR, corner / 4), _LIFT + near / 2)
    along = np.r_[0.0, way[middle], way[-1]]
    heights = np.r_[exits[0], (tops + air)[middle] + what.height, exits[1]]
    rows = np.r_[0, np.nonzero(middle)[0], len(way) - 1]
    hull = _upper_hull(along, heights)
    string = np.interp(way, along[hull], heights[hull])
    kept = rows[hull] if _straight(across) else np.arange(len(way))
    inner = [_at(across[row], float(string[row])) for row in kept]
    return [_at(across[0], begin), *inner, _at(across[-1], end)]


def _upper_hull(x: Array, y: Array) -> list[int]:
    """Indices of the points (x ascending) on the upper convex hull, both ends included."""
    hull: list[int] = []
    for i in range(len(x)):
        while len(hull) >= 2:
            a, b = hull[-2:]
            if (y[b] - y[a]) * (x[i] - x[a]) > (y[i] - y[a]) * (x[b] - x[a]):
                break
            hull.pop()
        hull.append(i)
    return hull


def _straight(across: Array) -> bool:
    """Whether the samples lie on one line, so that its ends stand for all of them."""
    share = np.linspace(0.0, 1.0, len(across))[:, None]
    line = across[0] + (across[-1] - across[0]) * share
    return bool(np.abs(line - across).max() < 1e-9)


def _at(point: Array, height: float) -> Waypoint:
    rail, theta, radius, _, yaw = point.tolist()
    return (rail, theta, radius, height, yaw)
