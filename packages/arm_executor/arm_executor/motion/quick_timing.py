"""Timing for predictions: how long a path takes, some ten times as fast, to a percent or so.

The torques of the empty arm, which hardly ever limit it, are left out. A motion that is carried out
is timed by :class:`arm_executor.motion.timing.Timing`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.pace import derivatives, times_along
from arm_executor.motion.timing import Load, Timing, Trajectory

Array = NDArray[np.float64]

#: How much longer a motion takes than the limits at the points of the grid allow: the median of
#: planned motions.
_SLOWER = 1.011
#: A limit to jerk makes a motion longer by so many times the time in which a joint comes to its
#: greatest acceleration: the median again.
_RAMPS = 2.0
#: Torques are computed at every so-manieth point of a path with a box, and are linear in between.
_APART = 4


class QuickTiming(Timing):
    """A :class:`Timing` whose trajectories have the points of their path, and no speeds."""

    def trajectory(
        self, q: Array, load: Load | None, period: float, *, share: float = 1.0
    ) -> Trajectory | None:
        """As :meth:`Timing.trajectory`, with a sample for each point of ``q``."""
        steps = np.abs(np.diff(q, axis=0)).max(axis=1)
        q = q[np.r_[True, steps > 1e-9]]
        if len(q) < 3:
            return None
        slope, bend = derivatives(q)
        tool = self.kinematics.tool(q)[:, :3, 3]
        tool_slope, tool_bend = derivatives(np.ascontiguousarray(tool))
        directions, bounds = self.tool_limits(load)
        torques = self._torques(q, slope, bend, load)
        times = times_along(
            slope, bend, self.max_speed, self.max_acceleration, tool_slope, tool_bend,
            directions, bounds, *torques, self.max_torque,
        )  # fmt: skip
        if not len(times):
            return None
        still = np.zeros_like(q)
        slower = _SLOWER + _RAMPS * self.ramp_s / float(times[-1])
        return Trajectory(times * slower / share, q, still, still)

    def _torques(
        self, q: Array, slope: Array, bend: Array, load: Load | None
    ) -> tuple[Array, Array, Array]:
        """See :meth:`Timing.torques_along`."""
        if load is None:
            nothing = np.zeros_like(q)
            return nothing, nothing, nothing
        rows = np.unique(np.r_[np.arange(0, len(q), _APART), len(q) - 1])
        known = self.torques_along(q[rows], slope[rows], bend[rows], load)
        every = np.arange(len(q))
        by_u, by_x, hold = (
            np.stack([np.interp(every, rows, column) for column in table.T], axis=1)
            for table in known
        )
        return by_u, by_x, hold
