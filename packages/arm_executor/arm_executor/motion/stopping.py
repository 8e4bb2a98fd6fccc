"""Stopping: from anywhere on a trajectory to rest, along its path, as fast as the load bears.

The time along the trajectory runs slower and slower. With r = 1 at full pace and r = 0 at rest,
what the arm does is q(s(t)) with ds/dt = r, so that every acceleration is r^2 times the planned
one plus dr/dt times the planned speed. Each limit is linear in dr/dt, and dr/dt = 0 breaks none
that the plan kept: in each step r falls as fast as all of them allow.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio
from numpy.typing import NDArray

from arm_executor.motion.timing import Load, Timing, Trajectory

Array = NDArray[np.float64]

#: Of what planning allows, a stop uses this share: it is steep, and the joints follow it less well.
_SHARE = 0.9
#: A pace below this is rest.
_AT_REST = 1e-3


def stopped(
    timing: Timing, timed: Trajectory, at_s: float, load: Load | None, *, pace: float = 1.0
) -> Trajectory:
    """The trajectory from ``at_s`` seconds on ``timed`` to rest on its path.

    Its samples are as far apart as those of ``timed``. ``load`` is what hangs on the pad: its
    limits of suction hold as they do in planning. A robot that runs trajectories at a ``pace``
    below 1 bears a steeper stop: its accelerations shrink with the square.
    """
    period = float(timed.times[1] - timed.times[0])
    limits = _Limits(timing, load, pace)
    at, rate, change = at_s, 1.0, 0.0
    rows = [(at, rate, change)]
    while rate > _AT_REST and at < timed.duration:
        # The plan may turn from gaining speed to losing it within the step: both ends must bear it.
        ahead = min(at + rate * period, timed.duration)
        change = max(limits.steepest(*_sampled(timed, point), rate) for point in (at, ahead))
        change = max(change, -rate / period)
        at = min(at + (rate + change * period / 2) * period, timed.duration)
        rate += change * period
        rows.append((at, rate, change))
    q, qd, qdd = (
        np.array(column) for column in zip(*(_sampled(timed, row[0]) for row in rows), strict=True)
    )
    rates, changes = np.array([row[1:] for row in rows]).T[:, :, None]
    speed, acceleration = qd * rates, qdd * rates**2 + qd * changes
    speed[-1] = acceleration[-1] = 0.0
    times = np.arange(len(rows), dtype=np.float64) * period
    return Trajectory(times, q, speed, acceleration)


class _Limits:
    """What limits ``dr/dt``: the pad, and the accelerations and torques of the joints."""

    def __init__(self, timing: Timing, load: Load | None, pace: float) -> None:
        self._timing, self._pace = timing, pace
        self._model = timing.dynamics(load)
        self._data = self._model.createData()
        self._frame = self._model.getFrameId('tcp')
        self._directions, self._bounds = timing.tool_limits(load)

    def steepest(self, q: Array, qd: Array, qdd: Array, rate: float) -> float:
        """Least allowed dr/dt, 1/s, at a planned state (7,) travelled at ``rate``."""
        timing, still = self._timing, np.zeros(7)
        speed, acceleration = self._pad(q, qd, qdd)
        hold = pinocchio.rnea(self._model, self._data, q, still, still)
        moving = pinocchio.rnea(self._model, self._data, q, qd, qdd) - hold
        braking = pinocchio.rnea(self._model, self._data, q, still, qd) - hold
        slopes = np.concatenate([self._directions @ speed, qd, -qd, braking, -braking])
        now = (
            rate
            * rate
            * np.concatenate([self._directions @ acceleration, qdd, -qdd, moving, -moving])
        )
        most = np.concatenate(
            [
                self._bounds,
                timing.max_acceleration,
                timing.max_acceleration,
                timing.max_torque - hold,
                timing.max_torque + hold,
            ]
        )
        braked = slopes < -1e-9
        reserve = _SHARE * most[braked] / self._pace**2 - now[braked]
        allowed = np.maximum(reserve, 0.0) / slopes[braked]
        return float(allowed.max()) if len(allowed) else -math.inf

    def _pad(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Speed and acceleration of the pad (3,), frame `cell`."""
        pinocchio.forwardKinematics(self._model, self._data, q, qd, qdd)
        aligned = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        of_pad = self._model, self._data, self._frame, aligned
        return (
            pinocchio.getFrameVelocity(*of_pad).linear.copy(),
            pinocchio.getFrameClassicalAcceleration(*of_pad).linear.copy(),
        )


def _sampled(timed: Trajectory, at: float) -> tuple[Array, Array, Array]:
    """Positions, speeds and accelerations (7,) of ``timed`` at a time between its samples."""
    index = int(np.searchsorted(timed.times, at, 'right')) - 1
    index = min(max(index, 0), len(timed.times) - 2)
    span = float(timed.times[index + 1] - timed.times[index])
    share = (at - float(timed.times[index])) / span if span > 0 else 1.0
    qd, qdd = (
        rows[index] + (rows[index + 1] - rows[index]) * share for rows in (timed.qd, timed.qdd)
    )
    # Straight between samples, positions would have kinks; so a cubic by the speeds at both.
    start, end = timed.q[index], timed.q[index + 1]
    rest, bend = 1.0 - share, share * (1.0 - share) * span
    q = (
        start * (1.0 + 2.0 * share) * rest**2
        + end * (3.0 - 2.0 * share) * share**2
        + (timed.qd[index] * rest - timed.qd[index + 1] * share) * bend
    )
    return q, qd, qdd
