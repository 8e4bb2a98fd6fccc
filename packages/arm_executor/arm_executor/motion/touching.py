"""What round links and boxes touch along a path, as machine code.

The arm is bars with round ends, everything else upright boxes, what is carried a box at any turn.
Nothing here calls another file, so that Numba's cache is never older than its source. Metres,
frame `cell`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: What the first number of an answer means: nothing; a bar and an obstacle; the pad and an
#: obstacle; what is carried and an obstacle; a bar and what is carried; two bars.
NOTHING, BAR_OBSTACLE, PAD_OBSTACLE, HELD_OBSTACLE, BAR_HELD, BARS = range(6)


@njit(cache=True, nogil=True, error_model='numpy')
def first_touch(  # type: ignore[no-untyped-def]
    q, joints, rolls, base_height, links, ends, reaches, pairs, pad_link, pad_centre, pad_half,
    low, high, which, centres, turns, halves,
):  # fmt: skip
    """What touches first along configurations ``q`` (n, 7): (what, number, number).

    Parameters
    ----------
    q : configurations, rail first.
    joints, rolls : (6, 3) offset, and (6, 2) cosine and sine of the roll, of each joint's frame.
    base_height : of the arm's base.
    links : (k,) the link of each bar, 0 the base, 7 the carriage, which does not turn.
    ends : (k, 2, 3) of the bars, in the frames of their links.
    reaches : (k, 3) how near a bar's middle line may come: to an obstacle, to what is carried, to
        the middle line of another bar less that one's; negative where that is not looked at.
    pairs : (m, 2) bars that must not touch each other.
    pad_link, pad_centre, pad_half : the pad as a box.
    low, high : (b, 3) obstacles.
    which : (n,) the size of what is carried, -1 where nothing is.
    centres, turns : (n, 3) and (n, 3, 3) of what is carried.
    halves : (s, 3) half edges by size.
    """
    count = len(links)
    line = np.empty((count, 2, 3))
    frame, turned = np.empty((3, 3)), np.empty((3, 3))
    at, local = np.empty(3), np.empty((2, 3))
    pad_turn, pad_at = np.empty((3, 3)), np.empty(3)
    for i in range(len(q)):
        # Where the bars are.
        frame[:] = 0.0
        frame[0, 0] = frame[1, 1] = frame[2, 2] = 1.0
        at[0], at[1], at[2] = q[i, 0], 0.0, base_height
        for link in range(8):
            if 0 < link < 7:
                x, y, z = joints[link - 1]
                for row in range(3):
                    at[row] += frame[row, 0] * x + frame[row, 1] * y + frame[row, 2] * z
                roll_c, roll_s = rolls[link - 1]
                c, s = math.cos(q[i, link]), math.sin(q[i, link])
                for row in range(3):
                    fx, fy, fz = frame[row]
                    my, mz = fy * roll_c + fz * roll_s, fz * roll_c - fy * roll_s
                    turned[row, 0] = fx * c + my * s
                    turned[row, 1] = my * c - fx * s
                    turned[row, 2] = mz
                frame[:] = turned
                if link == pad_link:
                    pad_turn[:] = frame
                    for row in range(3):
                        pad_at[row] = at[row] + frame[row, 2] * pad_centre
            elif link == 7:
                frame[:] = 0.0
                frame[0, 0] = frame[1, 1] = frame[2, 2] = 1.0
                at[0], at[1], at[2] = q[i, 0], 0.0, 0.0
            for k in range(count):
                if links[k] != link:
                    continue
                for end in range(2):
                    x, y, z = ends[k, end]
                    for row in range(3):
                        line[k, end, row] = (
                            at[row] + frame[row, 0] * x + frame[row, 1] * y + frame[row, 2] * z
                        )
        held = which[i]
        for k in range(count):
            reach = reaches[k, 0]
            if reach >= 0:
                for b in range(len(low)):
                    if _bar_meets(line[k, 0], line[k, 1], low[b], high[b], reach):
                        return BAR_OBSTACLE, k, b
            if held >= 0 and reaches[k, 1] >= 0:
                for end in range(2):
                    for axis in range(3):
                        along = 0.0
                        for row in range(3):
                            gap = line[k, end, row] - centres[i, row]
                            along += gap * turns[i, row, axis]
                        local[end, axis] = along
                half = halves[held]
                if _bar_meets(local[0], local[1], -half, half, reaches[k, 1]):
                    return BAR_HELD, k, 0
        for b in range(len(low)):
            if _boxes_meet(pad_at, pad_turn, pad_half, low[b], high[b]):
                return PAD_OBSTACLE, 0, b
            if held >= 0 and _boxes_meet(centres[i], turns[i], halves[held], low[b], high[b]):
                return HELD_OBSTACLE, 0, b
        for pair in range(len(pairs)):
            k, other = pairs[pair]
            near = reaches[k, 2] + reaches[other, 2]
            apart = _lines_apart(line[k, 0], line[k, 1], line[other, 0], line[other, 1])
            if apart < near * near:
                return BARS, k, other
    return NOTHING, 0, 0


@njit(cache=True, nogil=True, error_model='numpy')
def _bar_meets(start, end, low, high, reach):  # type: ignore[no-untyped-def]
    """Whether the line from ``start`` to ``end`` comes nearer than ``reach`` to a box."""
    for axis in range(3):
        if min(start[axis], end[axis]) - reach >= high[axis]:
            return False
        if max(start[axis], end[axis]) + reach <= low[axis]:
            return False
    # The squared distance is convex along the line: halve where its slope changes sign.
    least, most = 0.0, 1.0
    for _ in range(18):
        share = (least + most) / 2
        apart, slope = 0.0, 0.0
        for axis in range(3):
            step = end[axis] - start[axis]
            value = start[axis] + share * step
            gap = 0.0
            if value < low[axis]:
                gap = value - low[axis]
            elif value > high[axis]:
                gap = value - high[axis]
            apart += gap * gap
            slope += gap * step
        if apart < reach * reach:
            return True
        if slope > 0:
            most = share
        else:
            least = share
    return False


@njit(cache=True, nogil=True, error_model='numpy')
def _boxes_meet(centre, turn, half, low, high):  # type: ignore[no-untyped-def]
    """Whether a turned box and an upright one overlap, by separating axes (Gottschalk 1996)."""
    for axis in range(3):
        span = 0.0
        for k in range(3):
            span += abs(turn[axis, k]) * half[k]
        if centre[axis] - span >= high[axis] or centre[axis] + span <= low[axis]:
            return False
    a0, a1, a2 = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2
    t0 = centre[0] - (high[0] + low[0]) / 2
    t1 = centre[1] - (high[1] + low[1]) / 2
    t2 = centre[2] - (high[2] + low[2]) / 2
    for k in range(3):
        x, y, z = turn[0, k], turn[1, k], turn[2, k]
        if abs(t0 * x + t1 * y + t2 * z) >= half[k] + a0 * abs(x) + a1 * abs(y) + a2 * abs(z):
            return False
    for k in range(3):
        n, m = (k + 1) % 3, (k + 2) % 3
        # x, y and z crossed with axis k of the turned box
        span = a1 * abs(turn[2, k]) + a2 * abs(turn[1, k])
        span += half[n] * abs(turn[0, m]) + half[m] * abs(turn[0, n])
        if abs(t2 * turn[1, k] - t1 * turn[2, k]) >= span + 1e-12:
            return False
        span = a0 * abs(turn[2, k]) + a2 * abs(turn[0, k])
        span += half[n] * abs(turn[1, m]) + half[m] * abs(turn[1, n])
        if abs(t0 * turn[2, k] - t2 * turn[0, k]) >= span + 1e-12:
            return False
        span = a0 * abs(turn[1, k]) + a1 * abs(turn[0, k])
        span += half[n] * abs(turn[2, m]) + half[m] * abs(turn[2, n])
        if abs(t1 * turn[0, k] - t0 * turn[1, k]) >= span + 1e-12:
            return False
    return True


@njit(cache=True, nogil=True, error_model='numpy')
def _lines_apart(p, p_end, r, r_end):  # type: ignore[no-untyped-def]
    """Least squared distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9)."""
    aa = ee = f = c = b = 0.0
    for axis in range(3):
        u, v, w = p_end[axis] - p[axis], r_end[axis] - r[axis], p[axis] - r[axis]
        aa += u * u
        ee += v * v
        f += v * w
        c += u * w
        b += u * v
    denominator = aa * ee - b * b
    s = 0.0
    if denominator > 1e-12:
        s = min(1.0, max(0.0, (b * f - c * ee) / denominator))
    t = (b * s + f) / ee if ee > 1e-12 else 0.0
    if t < 0 or ee <= 1e-12:
        t = 0.0
        s = min(1.0, max(0.0, -c / aa)) if aa > 1e-12 else 0.0
    elif t > 1:
        t = 1.0
        s = min(1.0, max(0.0, (b - c) / aa)) if aa > 1e-12 else 0.0
    apart = 0.0
    for axis in range(3):
        gap = p[axis] + s * (p_end[axis] - p[axis]) - r[axis] - t * (r_end[axis] - r[axis])
        apart += gap * gap
    return apart
