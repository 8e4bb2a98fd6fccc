"""Compiled: where a box with a given face up can be on a given base.

A place is a grid cell of the corner. On its base a box stands alone, on enough placed tops, or it
leans: other boxes of the look-ahead are under it, which is taken to go well wherever :mod:`.bounds`
lets it. Loops end early once ``stop`` is raised, see :mod:`pack_planner.joint.budget`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.bounds import NEVER
from pack_planner.joint.compiled import compiled, entry

#: Cell of a row or column without a place.
FAR = 1 << 14


class RefusalRange(NamedTuple):
    """How far around a refused position a box is not offered again, and the resolution.

    Attributes
    ----------
    radius, step : millimetres.
    """

    radius: float
    step: int


class PlaceProfile(NamedTuple):
    """The places of one shape on each of some bases.

    Attributes
    ----------
    by_x, by_y : least y at each x, least x at each y, (bases, cells); ``FAR`` for none.
    some : whether there is any.
    """

    by_x: NDArray[np.int16]
    by_y: NDArray[np.int16]
    some: NDArray[np.bool_]


@compiled
def _stands(x, y, land, weak, size, tops):  # type: ignore[no-untyped-def]
    """Whether a box stands alone on the highest top under it."""
    z = land[x, y]
    if z == 0:
        return True
    if len(weak) > 0 and weak[x, y] == z:
        return False
    held = 0
    for c in range(4):
        a = x if c % 2 == 0 else x + size[0] - 1
        b = y if c < 2 else y + size[1] - 1
        held += int(tops.height[a, b] > 0 and tops.height[a, b] >= z - tops.tolerance)
    return held >= tops.needed


@compiled
def _profiles(at, tops, weights, cap, levels, limit, alone, leaning, stop):  # type: ignore[no-untyped-def]
    """Least y at each x and least x at each y, of places on each of ``levels``.

    ``alone`` and ``leaning`` are filled.
    """
    land, low, weak, size, dz = at
    w1, w2, w3 = weights
    for profile in (alone, leaning):
        profile.by_x[:], profile.by_y[:], profile.some[:] = FAR, FAR, False
    count = len(levels)
    done_y = np.full(low.shape[1], count)
    for x in range(low.shape[0]):
        done_x = count
        if stop[0] or w2 * dz + w3 + w1 * x >= cap:
            break
        for y in range(low.shape[1]):
            own = w2 * dz + w3 + w1 * (x + y)
            if own >= cap:
                break
            if low[x, y] >= NEVER:
                continue
            z = land[x, y]
            at_z = np.searchsorted(levels, z)
            if at_z < count and levels[at_z] == z and own + w2 * z < cap:  # noqa: SIM102 - numba
                if _stands(x, y, land, weak, size, tops):
                    alone.by_x[at_z, x] = min(alone.by_x[at_z, x], y)
                    alone.by_y[at_z, y] = min(alone.by_y[at_z, y], x)
                    alone.some[at_z] = True
            first = np.searchsorted(levels, low[x, y])
            for n in range(first, max(done_x, done_y[y])):
                if own + w2 * levels[n] >= cap or levels[n] + dz > limit:
                    break
                leaning.some[n] = True
                if n < done_x:
                    leaning.by_x[n, x] = y
                if n < done_y[y]:
                    leaning.by_y[n, y] = x
            done_x, done_y[y] = min(done_x, first), min(done_y[y], first)


@entry
def list_rows(  # type: ignore[no-untyped-def]
    faces, shapes, land, low, weak, tops, weights, caps, levels, limit, may_lean, stop
):
    """All faces up on all bases, in each turn, that may cost less than the caps.

    Parameters
    ----------
    faces : rows (shape of one turn, of the other or -1).
    shapes : rows (box, orientation, wide, deep, dz), cells and millimetres.
    land, low, weak : highest tops, least bases and weak places of the shapes, (shapes, x, y); the
        last one (shapes, 0, 0) if there is none.
    tops : what boxes may stand on, see :class:`.group_problem.PlacedTops`.
    weights : per cell, per millimetre of height, value of the bin's index.
    caps : of the boxes.
    levels, limit : all bases, in increasing order; the height of the bin.
    may_lean : on which of them each box may lean, (boxes, levels).

    Returns
    -------
    rows (face, base, leans, shape), least y by x, least x by y.
    """
    listed = np.empty((64, 4), np.int64)
    by_x = np.empty((64, land.shape[1]), np.int16)
    by_y = np.empty((64, land.shape[2]), np.int16)
    count, bases = 0, len(levels)
    kinds = [
        [
            PlaceProfile(
                np.empty((bases, land.shape[1]), np.int16),
                np.empty((bases, land.shape[2]), np.int16),
                np.empty(bases, np.bool_),
            )
            for _ in range(2)
        ]
        for _ in range(2)
    ]
    for f in range(len(faces)):
        if stop[0]:
            break
        which = shapes[faces[f, 0], 0]
        for t in range(2):
            s = faces[f, t]
            if s >= 0:
                at = (land[s], low[s], weak[s], shapes[s, 2:4], shapes[s, 4])
                _profiles(at, tops, weights, caps[which], levels, limit, kinds[t][0], kinds[t][1],
                          stop)  # fmt: skip
        for n in range(bases):
            for kind in range(2):
                for t in range(2):
                    if faces[f, t] < 0 or not kinds[t][kind].some[n]:
                        continue
                    if kind == 1 and (levels[n] == 0 or not may_lean[which, n]):
                        continue
                    if count == len(listed):
                        listed = np.concatenate((listed, np.empty_like(listed)))
                        by_x = np.concatenate((by_x, np.empty_like(by_x)))
                        by_y = np.concatenate((by_y, np.empty_like(by_y)))
                    listed[count] = f, levels[n], kind, faces[f, t]
                    by_x[count], by_y[count] = kinds[t][kind].by_x[n], kinds[t][kind].by_y[n]
                    count += 1
    return listed[:count], by_x[:count], by_y[:count]


@compiled
def _refused(x, y, z, zones, refusal):  # type: ignore[no-untyped-def]
    """Whether (x, y, z) is near a refused position."""
    for zone in zones:
        if (
            zone[3] == z
            and abs(x * refusal.step - zone[1]) < refusal.radius
            and abs(y * refusal.step - zone[2]) < refusal.radius
        ):
            return True
    return False


@entry
def next_places(  # type: ignore[no-untyped-def]
    wanted, rows, shapes, land, low, weak, tops, zones, refusal, after, near, stop
):
    """For some rows, y and x the least y' >= y of a place, into ``after`` (rows, y + 1, x).

    The place x' >= x, y' >= y of least x' + y' goes into ``near`` (rows, y + 1, x + 1, 2). Here
    places near ``zones``, rows (shape, x, y, z) in millimetres, are none.
    """
    for r in wanted:
        if stop[0]:
            return
        _, z, kind, s = rows[r]
        own = zones[zones[:, 0] == s]
        after[r, after.shape[1] - 1] = FAR
        near[r, after.shape[1] - 1] = FAR
        near[r, :, after.shape[2]] = FAR
        for y in range(after.shape[1] - 2, -1, -1):
            for x in range(after.shape[2] - 1, -1, -1):
                good = low[s, x, y] <= z
                if good and kind == 0:
                    good = land[s, x, y] == z and _stands(
                        x, y, land[s], weak[s], shapes[s, 2:4], tops
                    )
                if good and len(own):
                    good = not _refused(x, y, z, own, refusal)
                after[r, y, x] = y if good else after[r, y + 1, x]
                here, along_x, along_y = near[r, y, x], near[r, y, x + 1], near[r, y + 1, x]
                far_x, far_y = np.int64(along_x[0]) + along_x[1], np.int64(along_y[0]) + along_y[1]
                if good:
                    here[0], here[1] = x, y
                elif far_x < far_y:
                    here[0], here[1] = along_x[0], along_x[1]
                else:
                    here[0], here[1] = along_y[0], along_y[1]
