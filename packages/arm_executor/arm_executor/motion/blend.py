"""Joint paths straight between configurations, with their corners rounded.

A cubic B-spline kernel smooths the polyline within a distance of its corners and leaves the rest as
it is, so that what was straight in space away from a corner stays so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A radian of each joint, and a metre of the rail, as path length in metres.
_WEIGHTS = np.array([0.8, 0.9, 0.9, 0.7, 0.4, 0.4, 0.25])
#: Spacing of the curve before it is sampled, and of the samples.
_FINE, _STEP = 0.004, 0.02
#: Beyond this share of the rounding distance the curve goes over into the polyline.
_FADE = 1.6


def blended(points: Sequence[Array], corner: float, corners: Sequence[int] = (1,)) -> Array:
    """Samples (n, 7) through ``points`` (7,), rounded about those with indices ``corners``."""
    table = np.array(points)
    steps = np.linalg.norm(np.diff(table * _WEIGHTS, axis=0), axis=1)
    along = np.r_[0.0, np.cumsum(np.maximum(steps, 1e-9))]
    total = float(along[-1])
    fine = np.linspace(0.0, total, math.ceil(total / _FINE) + 1)
    line = _interpolated(fine, along, table)
    spots = along[list(corners)]
    reach = corner
    half = max(1, round(reach / _FINE / 4))
    smooth = _smoothed(line, half)
    away = np.abs(fine[:, None] - spots[None, :]).min(axis=1)
    share = np.clip((_FADE * reach - away) / ((_FADE - 1) * reach), 0.0, 1.0)
    weight = share**3 * (share * (6 * share - 15) + 10)
    curve = line + weight[:, None] * (smooth - line)
    at = np.linspace(0.0, total, max(8, math.ceil(total / _STEP) + 1))
    return _interpolated(at, fine, curve)


def _interpolated(at: Array, along: Array, table: Array) -> Array:
    return np.stack([np.interp(at, along, column) for column in table.T], axis=1)


def _smoothed(line: Array, half: int) -> Array:
    """``line`` (n, 7) after the kernel, mirrored about its ends so that these stay."""
    half = min(half, max(1, (len(line) - 1) // 4))
    pad = 4 * half
    box = np.ones(2 * half + 1) / (2 * half + 1)
    kernel = np.convolve(np.convolve(box, box), np.convolve(box, box))
    before = 2 * line[0] - line[pad:0:-1]
    after = 2 * line[-1] - line[-2 : -pad - 2 : -1]
    whole = np.vstack([before, line, after])
    return np.stack([np.convolve(column, kernel, mode='valid') for column in whole.T], axis=1)
