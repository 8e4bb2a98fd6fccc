"""Compiled: what one placement wastes, and how little it could waste at best.

A *waste* is a weighted sum of terms; :class:`~pack_planner.algorithms.waste_weights.WasteWeights`
says what they are, the constants below where their weights lie.
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: Where the weights of the terms lie in an array of them.
LOST, TOUCHED, LEVEL, SPREAD, SNUG, NEAR_MM, LEVEL_MM = range(7)
HOLLOW, ABOVE, BESIDE, TALL, SLENDER, SHUT_OFF = range(7, 13)
WEIGHTS = 13


@njit(cache=True, nogil=True)
def steps_between(columns, rows, height):  # type: ignore[no-untyped-def]
    """Length up to each cell along which the height map steps up, for a box that begins there.

    Four arrays, seen from a box on the side that is lower: at its left, right, front and back. The
    entry [c, r] of the first is the length along y, from 0 to ``rows[r]``, on which the strip left
    of ``columns[c]`` is higher than that right of it; the walls count as higher. Of two entries
    the difference is the most that a side of a box may touch.
    """
    wide, deep = len(columns) - 1, len(rows) - 1
    left, right = np.zeros((wide + 1, deep + 1)), np.zeros((wide + 1, deep + 1))
    front, back = np.zeros((deep + 1, wide + 1)), np.zeros((deep + 1, wide + 1))
    for c in range(wide + 1):
        for r in range(deep):
            length = rows[r + 1] - rows[r]
            up = c == 0 or (c < wide and height[c - 1, r] > height[c, r])
            down = c == wide or (c > 0 and height[c, r] > height[c - 1, r])
            left[c, r + 1] = left[c, r] + (length if up else 0)
            right[c, r + 1] = right[c, r] + (length if down else 0)
    for r in range(deep + 1):
        for c in range(wide):
            length = columns[c + 1] - columns[c]
            up = r == 0 or (r < deep and height[c, r - 1] > height[c, r])
            down = r == deep or (r > 0 and height[c, r] > height[c, r - 1])
            front[r, c + 1] = front[r, c] + (length if up else 0)
            back[r, c + 1] = back[r, c] + (length if down else 0)
    return left, right, front, back


@njit(cache=True, nogil=True)
def waste_below(columns, rows, height, area, spans, z, top, limit, tolerance, unusable, weights):  # type: ignore[no-untyped-def]
    """What the room below and above a placement adds to its waste, times its volume.

    Parameters
    ----------
    columns, rows, height : the height map.
    area : base (x0, y0, x1, y1) of the placement.
    spans : strips (first column, end column, first row, end row) that it lies on.
    z, top, limit : heights of its base and its top, and that of the bin.
    tolerance : how far below the base a top may lie and still carry it.
    unusable : room of each height that stays empty on average, see :mod:`pack_planner.engine.room`.
    weights : see the module.
    """
    x0, y0, x1, y1 = area
    below = hollow = above = 0.0
    for c in range(spans[0], spans[1]):
        wide = min(columns[c + 1], x1) - max(columns[c], x0)
        for r in range(spans[2], spans[3]):
            cells = float(wide * (min(rows[r + 1], y1) - max(rows[r], y0)))
            below += cells * (z - height[c, r])
            if height[c, r] < z - tolerance:
                hollow += cells
            above -= cells * unusable[limit - height[c, r]]
    above += float((x1 - x0) * (y1 - y0)) * unusable[limit - top]
    return weights[LOST] * below + weights[HOLLOW] * hollow * (top - z) + weights[ABOVE] * above


@njit(cache=True, nogil=True)
def shut_off(columns, rows, height, area, spans, top):  # type: ignore[no-untyped-def]
    """Room behind a placement, towards y = 0, that cannot be seen from the front any more, mm^3.

    That is room above the height map and below ``top`` that was higher than all in front of it
    before, in the strips along y that the placement lies on; see :func:`waste_below`.
    """
    x0, y0, x1, _ = area
    room = 0.0
    for c in range(spans[0], spans[1]):
        wide = float(min(columns[c + 1], x1) - max(columns[c], x0))
        highest = 0
        for r in range(len(rows) - 2, -1, -1):
            deep = min(rows[r + 1], y0) - rows[r]
            hidden = top - max(highest, height[c, r])
            if deep > 0 and hidden > 0:
                room += wide * deep * hidden
            highest = max(highest, height[c, r])
    return room


@njit(cache=True, nogil=True)
def waste_beside(columns, rows, height, area, spans, z, top, unusable, weights):  # type: ignore[no-untyped-def]
    """What lies around a placement adds this to its waste; see :func:`waste_below`.

    Here ``unusable`` is of room of each width.
    """
    x0, y0, x1, y1 = area
    first_c, end_c, first_r, end_r = spans
    across, along = x1 - x0, y1 - y0
    touched = level = dead = 0.0
    tolerance = weights[LEVEL_MM]
    looks_far = weights[SNUG] != 0.0 or weights[BESIDE] != 0.0
    near = 0
    for axis in range(2):
        # the sides at the low and at the high end of this axis, strip by strip of the other one
        lines, others = (columns, rows) if axis == 0 else (rows, columns)
        low, high = (x0, x1) if axis == 0 else (y0, y1)
        start, end = (y0, y1) if axis == 0 else (x0, x1)
        first, last = (first_c, end_c) if axis == 0 else (first_r, end_r)
        least_low = least_high = lines[-1]
        for strip in range(
            first_r if axis == 0 else first_c, end_r if axis == 0 else end_c
        ):  # fmt: skip
            length = float(min(others[strip + 1], end) - max(others[strip], start))
            gap_low, gap_high = low, lines[-1] - high
            for i in range(first - 1, -1, -1):
                h = height[i, strip] if axis == 0 else height[strip, i]
                if h > z:
                    gap_low = low - lines[i + 1]
                    if gap_low == 0:
                        touched += length * (min(h, top) - z)
                        level += length if abs(h - top) <= tolerance else 0.0
                    break
                if not looks_far:
                    break
            for i in range(last, len(lines) - 1):
                h = height[i, strip] if axis == 0 else height[strip, i]
                if h > z:
                    gap_high = lines[i] - high
                    if gap_high == 0:
                        touched += length * (min(h, top) - z)
                        level += length if abs(h - top) <= tolerance else 0.0
                    break
                if not looks_far:
                    break
            least_low, least_high = min(least_low, gap_low), min(least_high, gap_high)
            if weights[BESIDE] != 0.0:
                dead += length * (
                    unusable[gap_low] + unusable[gap_high]
                    - unusable[gap_low + (high - low) + gap_high]
                )  # fmt: skip
        if low == 0:
            touched += (end - start) * (top - z)
        if high == lines[-1]:
            touched += (end - start) * (top - z)
        if 0 < least_low < weights[NEAR_MM]:
            near += 1
        if 0 < least_high < weights[NEAR_MM]:
            near += 1
    around = 2.0 * (across + along)
    return (
        -weights[TOUCHED] * touched / (around * (top - z))
        - weights[LEVEL] * level / around
        - weights[SNUG] * near / 4.0
        + weights[BESIDE] * dead / (float(across) * along)
    )
