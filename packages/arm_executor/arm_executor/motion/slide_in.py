"""Coming in beside the place: down in the middle of the gap, and aside into the place at the end.

A box that goes straight down a few millimetres beside a neighbour catches on its rim when one of
them is a little larger, or stands a little askew, and is torn off the pad. Coming down in the
middle of what is free it meets no rim; near the bottom it slides aside, face along face, where a
few millimetres too many only press it on its neighbour. Metres, frame `cell`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.path import positions
from arm_executor.motion.task import Site, Task, half_extent
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.values import Walls

Array = NDArray[np.float64]

#: Not beside the place at all.
STRAIGHT = (0.0, 0.0)
#: A gap wider than this counts as so wide: nobody comes in more than half of it beside a place.
_WIDE = 0.02
#: What is no higher than this above the base of the box stands under it, or is passed over.
_LOW = 0.005
#: The box moves aside over the last so many metres of its way, but for the last few millimetres:
#: what is higher than it was scanned is met straight from above, or it would be dragged along.
_OVER = 0.05


def beside(site: Site, task: Task) -> tuple[float, float]:
    """How far beside its place the box of ``task`` is to come down into ``site``, (x, y), metres.

    Nothing behind an open front, where a box comes in from before its place anyway.
    """
    if task.front is not None:
        return STRAIGHT
    base = task.place[2] - task.size[2]
    low = np.array([box.low for box in site.boxes]).reshape(-1, 3)
    high = np.array([box.high for box in site.boxes]).reshape(-1, 3)
    tall = high[:, 2] > base + _LOW
    low, high = low[tall, :2], high[tall, :2]
    half = np.array(half_extent(task.size, task.pick_yaw + task.turn))
    here = np.array(task.place[:2]) + np.stack([-half, half])
    inside = _inside(site)
    aside = [0.0, 0.0]
    for axis in (0, 1):
        aside[axis] = _middle(here, low, high, inside, axis)
        here[:, axis] += aside[axis]
    return (aside[0], aside[1])


def slid_in(samples: Array, aside: tuple[float, float]) -> Array:
    """``samples`` (n, 5) of a carry, waypoints, that come to their end from ``aside`` of it.

    The shift is full above the last 5 cm, and gone at the end; it begins with the way down, in the
    second half of the way.
    """
    if aside == STRAIGHT:
        return samples
    pads = positions(samples)
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(pads, axis=0), axis=1))]
    left = way[-1] - way
    share = _smooth(left / _OVER) * _smooth(2.0 * (1.0 - left / way[-1]))
    pads[:, :2] += share[:, None] * np.array(aside)
    moved: Array = samples.copy()
    x, y = pads[:, 0] - samples[:, 0], pads[:, 1]
    turn = np.arctan2(y, x) - samples[:, 1]
    moved[:, 1] += (turn + np.pi) % (2 * np.pi) - np.pi
    moved[:, 2] = np.hypot(x, y)
    return moved


def _smooth(share: Array) -> Array:
    """From 0 at 0 to 1 at 1, level at both."""
    at = np.clip(share, 0.0, 1.0)
    eased: Array = at * at * (3.0 - 2.0 * at)
    return eased


def _middle(
    here: Array, low: Array, high: Array, inside: tuple[Array, Array] | None, axis: int
) -> float:
    """How far along ``axis`` the middle of the gap is in which ``here`` (2, 2) lies."""
    other = 1 - axis
    level = (low[:, other] < here[1, other]) & (high[:, other] > here[0, other])
    before = here[0, axis] - high[level, axis]
    behind = low[level, axis] - here[1, axis]
    length = here[1, axis] - here[0, axis]
    gaps = []
    for gap in (before, behind):
        # What lies across the middle of the box is under it, not beside it.
        facing = gap[gap > -length / 2]
        gaps.append(float(facing.min(initial=_WIDE)))
    if inside is not None:
        gaps[0] = min(gaps[0], here[0, axis] - inside[0][axis])
        gaps[1] = min(gaps[1], inside[1][axis] - here[1, axis])
    nearer, further = (max(0.0, gap) for gap in gaps)
    return float(further - nearer) / 2


def _inside(site: Site) -> tuple[Array, Array] | None:
    """Inner faces of the bin's walls, ``None`` where it has none."""
    if site.spec.walls is Walls.NONE:
        return None
    length, breadth, _ = metres(site.spec.size_mm)
    ends = [site.frame.to_cell(Pose((x, y, 0.0))) for x, y in ((0.0, 0.0), (length, breadth))]
    corners = np.array([end.position[:2] for end in ends])
    return corners.min(axis=0), corners.max(axis=0)
