"""How fast a path can be travelled, as machine code.

Time-optimal path parametrisation by reachability analysis (Pham and Pham, 2018) on a coarse grid:
from the end backwards, how fast the path may be travelled at each point so that the rest of it can
be; then forwards as fast as that allows. Nothing here calls another file, so that Numba's cache is
never older than its source.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

_HALVINGS = 22


@njit(cache=True, nogil=True, error_model='numpy')
def derivatives(values):  # type: ignore[no-untyped-def]
    """First and second derivatives (n, k) of ``values`` (n, k), evenly spaced over 0 to 1."""
    count, width = values.shape
    step = 1.0 / (count - 1)
    first, second = np.empty((count, width)), np.empty((count, width))
    for k in range(width):
        for i in range(1, count - 1):
            before, at, after = values[i - 1, k], values[i, k], values[i + 1, k]
            first[i, k] = (after - before) / (2 * step)
            second[i, k] = (after - 2 * at + before) / (step * step)
        second[0, k], second[-1, k] = second[1, k], second[-2, k]
        first[0, k] = (values[1, k] - values[0, k]) / step - second[0, k] * step / 2
        first[-1, k] = (values[-1, k] - values[-2, k]) / step + second[-1, k] * step / 2
    return first, second


@njit(cache=True, nogil=True, error_model='numpy')
def times_along(  # type: ignore[no-untyped-def]
    slope, bend, max_speed, max_acceleration, tool_slope, tool_bend, directions, bounds,
    torque_slope, torque_bend, torque_hold, max_torque,
):  # fmt: skip
    """When each of n evenly spaced points of a path is passed, (n,) seconds; empty when it cannot.

    The path's parameter s runs from 0 to 1. With x the square of its speed and u its acceleration,
    each limit is linear in both.

    Parameters
    ----------
    slope, bend : (n, j) first and second derivatives of the joints by s.
    max_speed, max_acceleration : (j,) limits of the joints.
    tool_slope, tool_bend : (n, 3) the same derivatives of the pad's position.
    directions, bounds : (k, 3), (k,) limits of the pad's acceleration.
    torque_slope, torque_bend, torque_hold : (n, j) torques are slope u + bend x + hold.
    max_torque : (j,) their limits.
    """
    count, joints = slope.shape
    step = 1.0 / (count - 1)
    rows = 4 * joints + len(directions)
    limits = np.empty((count, rows, 3))
    fastest = np.empty(count)
    for i in range(count):
        fastest[i] = np.inf
        for j in range(joints):
            if abs(slope[i, j]) > 1e-9:
                fastest[i] = min(fastest[i], (max_speed[j] / slope[i, j]) ** 2)
            for side in range(2):
                sign = 1.0 - 2.0 * side
                row = 2 * j + side
                limits[i, row, 0] = sign * slope[i, j]
                limits[i, row, 1] = sign * bend[i, j]
                limits[i, row, 2] = max_acceleration[j]
                row += 2 * joints
                limits[i, row, 0] = sign * torque_slope[i, j]
                limits[i, row, 1] = sign * torque_bend[i, j]
                limits[i, row, 2] = max_torque[j] - sign * torque_hold[i, j]
        for k in range(len(directions)):
            row = 4 * joints + k
            along, across = 0.0, 0.0
            for axis in range(3):
                along += directions[k, axis] * tool_slope[i, axis]
                across += directions[k, axis] * tool_bend[i, axis]
            limits[i, row, 0], limits[i, row, 1], limits[i, row, 2] = along, across, bounds[k]
    # Backwards: the greatest x from which the next point can be reached within its own.
    greatest = np.zeros(count)
    for i in range(count - 2, -1, -1):
        low, high = 0.0, min(fastest[i], 1e6)
        for turn in range(_HALVINGS + 2):
            x = high if turn == 0 else (low + high) / 2
            least_u, most_u = _accelerations(limits[i], x)
            most_u = min(most_u, (greatest[i + 1] - x) / (2 * step))
            least_u = max(least_u, -x / (2 * step))
            if least_u <= most_u:
                low = x
                if turn == 0:
                    break
            else:
                high = x
        greatest[i] = low
    times = np.empty(count)
    times[0] = x = 0.0
    for i in range(count - 1):
        _, most_u = _accelerations(limits[i], x)
        following = min(greatest[i + 1], x + 2 * step * most_u)
        pace = math.sqrt(x) + math.sqrt(max(0.0, following))
        if pace <= 1e-9:
            return np.empty(0)
        times[i + 1] = times[i] + 2 * step / pace
        x = following
    return times


@njit(cache=True, nogil=True, error_model='numpy')
def _accelerations(limits, x):  # type: ignore[no-untyped-def]
    """Least and most u for which ``limits`` (r, 3) hold at ``x``; the least is above if none."""
    least, most = -np.inf, np.inf
    for row in range(len(limits)):
        by_u, left = limits[row, 0], limits[row, 2] - limits[row, 1] * x
        if by_u > 1e-9:
            most = min(most, left / by_u)
        elif by_u < -1e-9:
            least = max(least, left / by_u)
        elif left < 0:
            return np.inf, -np.inf
    return least, most
