"""Less jerk: the pace along a path averaged over a window of time, so that it has no steps.

A time-optimal motion jumps from one acceleration to the next. The mean of its path parameter over a
window of T seconds runs along the same path, takes T longer, and its acceleration along the path
changes by no more than a step in T. What the curves of the path themselves ask for is left, and
shrinks with the third power of how much slower all of it runs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Positions (n, 7) for parameters (n,), or a derivative of them by the parameter.
JointCurve = Callable[..., Array]

#: Windows that are tried, seconds.
_WINDOWS = (0.02, 0.04, 0.06, 0.08, 0.12, 0.16, 0.20, 0.25, 0.30, 0.40)
#: Spacing of the samples, seconds.
_FINE = 0.004


class Pace(Protocol):
    """When a path's parameter, 0 to 1, has which value."""

    @property
    def duration(self) -> float:
        """Seconds from 0 to 1."""

    def at(self, times: Array) -> tuple[Array, Array, Array]:
        """Parameter (n,) at ``times`` (n,), and its first and second derivative by time."""


@dataclass(frozen=True)
class SmoothPace:
    """Samples of a parameter and its derivatives by time, evenly spaced over ``duration``."""

    duration: float
    samples: tuple[Array, Array, Array]

    def at(self, times: Array) -> tuple[Array, Array, Array]:
        """See :class:`Pace`."""
        known = np.linspace(0.0, self.duration, len(self.samples[0]))
        s, speed, acceleration = (np.interp(times, known, column) for column in self.samples)
        return s, speed, acceleration


def joint_motion(path: JointCurve, pace: Pace, times: Array) -> tuple[Array, Array, Array]:
    """Positions, speeds and accelerations (n, 7) at ``times`` (n,) of ``path`` run at ``pace``."""
    s, speed, acceleration = (column[:, None] for column in pace.at(times))
    slope, bend = path(s[:, 0], 1), path(s[:, 0], 2)
    return path(s[:, 0]), slope * speed, slope * acceleration + bend * speed**2


def averaged(pace: Pace, window_s: float) -> SmoothPace:
    """``pace`` averaged over ``window_s``."""
    count = max(4, int(np.ceil((pace.duration + 2 * window_s) / _FINE)))
    times = np.linspace(-window_s, pace.duration + window_s, count)
    s, speed, _ = pace.at(np.clip(times, 0.0, pace.duration))
    speed = np.where((times < 0.0) | (times > pace.duration), 0.0, speed)
    area = np.r_[0.0, np.cumsum((s[1:] + s[:-1]) / 2 * np.diff(times))]
    middle = np.linspace(-window_s / 2, pace.duration + window_s / 2, count)

    def change(values: Array) -> Array:
        late, early = middle + window_s / 2, middle - window_s / 2
        gained: Array = np.interp(late, times, values) - np.interp(early, times, values)
        return gained / window_s

    mean = np.clip(change(area), 0.0, 1.0)
    mean[-1] = 1.0
    return SmoothPace(pace.duration + window_s, (mean, change(s), change(speed)))


def slower_for(path: JointCurve, pace: Pace, most: Array) -> float:
    """How much slower ``path`` must run at ``pace`` for jerks within ``most`` (7,), at least 1."""
    times = np.arange(0.0, pace.duration + 2 * _FINE, 2 * _FINE)
    _, _, acceleration = joint_motion(path, pace, np.minimum(times, pace.duration))
    still = np.zeros((1, acceleration.shape[1]))
    jerk = np.diff(np.vstack([still, acceleration, still]), axis=0) / (2 * _FINE)
    worst = float(np.abs(jerk / most).max())
    return float(np.cbrt(max(1.0, worst)))


def smoothed(path: JointCurve, pace: Pace, most: Array) -> tuple[Pace, float]:
    """The quickest of some averages of ``pace`` within jerks ``most`` (7,), and its stretch."""
    best: tuple[Pace, float] | None = None
    for window_s in _WINDOWS:
        tried = averaged(pace, window_s)
        if best is not None and tried.duration > best[0].duration * best[1]:
            break
        slower = slower_for(path, tried, most)
        if best is None or tried.duration * slower < best[0].duration * best[1]:
            best = tried, slower
    assert best is not None
    return best
