"""The way back: from wherever a motion ended early to where it began, in the free.

The legs of a motion were checked, so their samples are free both ways as long as nothing else has
moved. Radians, metres.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.path import JointPath
from arm_executor.motion.planned import PlannedMotion

Array = NDArray[np.float64]

#: A held box goes back at this share of the pace that it could: nobody waits for it, and it meets
#: the belt from above, which turns a box that comes too hard off its pad.
WITH_CARE = 0.5
#: A held box is let go this far above what it stood on, metres.
_ABOVE = 0.001
#: Spacing of the samples of a leg that is travelled again, radians and metres of the joints.
_SPACING = 0.03


class Leg(Enum):
    """Where in its motion the arm is."""

    APPROACH = 'approach'
    CARRY = 'carry'
    RETREAT = 'retreat'


def reversed_path(path: JointPath, q: Array) -> Array:
    """The part of ``path`` travelled so far at ``q`` (7,), from there back to its start (n, 7).

    It ends a little before, above what the box stood on, unless it is there already.
    """
    back = _from(q, path.q[::-1])
    risen = float(path.tcp[1, 2] - path.tcp[0, 2])
    if len(back) > 1 and risen > _ABOVE:
        back[-1] += (path.q[1] - path.q[0]) * (_ABOVE / risen)
    return back


def ways_out(motion: PlannedMotion, leg: Leg, q: Array) -> list[list[Array]]:
    """Ways (n, 7) from ``q`` (7,) on ``leg`` to where the arm waits, each from rest to rest.

    The first is the better one: after the release that is the rest of the retreat, else the way
    that the arm came.
    """
    approach = _even(motion.approach.q)[::-1]
    if leg is Leg.APPROACH:
        return [[_from(q, approach)]]
    carry = motion.carry_path.q[::-1]
    if leg is Leg.CARRY:
        return [[_from(q, carry), approach]]
    retreat = _even(motion.retreat.q)
    return [[_from(q, retreat)], [_from(q, retreat[::-1]), carry, approach]]


def _from(q: Array, way: Array) -> Array:
    """What is left of ``way`` (n, 7) at ``q`` (7,), which is near it."""
    at = int(np.abs(way - q).sum(axis=1).argmin())
    rest = way[min(at + 1, len(way) - 1) :]
    return np.vstack([q, rest]) if np.abs(rest[0] - q).max() > 1e-6 else rest


def _even(q: Array) -> Array:
    """Samples evenly spaced along ``q`` (n, 7), which may rest here and there."""
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))]
    keep = np.r_[True, np.diff(along) > 1e-9]
    count = max(8, int(along[-1] / _SPACING) + 1)
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along[keep], column) for column in q[keep].T], axis=1)
