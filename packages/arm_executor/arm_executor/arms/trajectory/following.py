"""Follows trajectories with a robot, watches it, and stops it.

Radians, metres; seconds of the wall clock, but along a trajectory.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.trajectory.link import RobotLink, RunningMotion
from arm_executor.arms.trajectory.run import RobotRun
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.tree import CELL_JOINT_NAMES
from arm_executor.motion.stopping import stopped
from arm_executor.motion.timing import Load, Timing, Trajectory
from pack_msgs_py.codes import ErrorCode, Phase

Array = NDArray[np.float64]

#: The robot is looked at this often.
_LOOK_S = 0.01
#: A stop begins so much further on the trajectory, seconds along it: by then the controller has it.
_LEAD_S = 0.1
#: The robot rests once no joint moved by more than this within :data:`_LOOK_S` times three.
_STILL = 2e-4
#: Below this share of its speed a robot is stopped at once: there is nothing to slow down.
_CREEPS = 0.1
#: A ramp that has not ended by then is cancelled; before the watchdog gives the arm up.
_RAMP_TIMEOUT_S = 2.0
#: A way back that makes no progress for so long is given up; a motion of a goal has a watchdog.
STALLED_S = 10.0
#: Longest that it takes to come to rest, and that a safety stop takes to be told of.
_REST_TIMEOUT_S, _TROUBLE_TOLD_S = 0.8, 0.3


class Follower:
    """Has a robot follow trajectories; ``commanded`` (7,) is where it is meant to be.

    Parameters
    ----------
    link : the robot.
    timing : says how fast it may stop with what it holds.
    start_tolerance : how near every joint must be to where a trajectory begins.
    ramps : whether a stop is a trajectory of its own, or left to the controller.
    """

    def __init__(
        self, link: RobotLink, timing: Timing, start_tolerance: float, *, ramps: bool
    ) -> None:
        self._link = link
        self._timing = timing
        self._start_tolerance = start_tolerance
        self._ramps = ramps
        self.commanded = link.positions()
        self.tracking_error = 0.0

    def astray(self, start: Array) -> str:
        """Why a motion from ``start`` (7,) cannot begin; empty when it can.

        When the joints are elsewhere, that is where the next motion has to be planned from.
        """
        position = self._link.positions()
        error = np.abs(position - start)
        worst = int(error.argmax())
        if error[worst] <= self._start_tolerance:
            return ''
        self.commanded = position
        unit = 'm' if worst == 0 else 'rad'
        return (
            f'{CELL_JOINT_NAMES[worst]} is {error[worst]:.3f} {unit} away from where the motion '
            f'starts, {self._start_tolerance:g} {unit} are allowed; plan it again'
        )

    def follow(
        self,
        timed: Trajectory,
        run: RobotRun | None = None,
        phases: Sequence[tuple[float, Phase]] = (),
        *,
        done_s: float = 0.0,
        load: Load | None = None,
        stoppable: bool = True,
    ) -> None:
        """Have ``timed`` run with ``load`` on the pad; each of ``phases`` begins at its time.

        ``done_s`` of the plan of ``run`` are done before.

        Raises
        ------
        MotionError
            With the robot at rest, or stopped by itself: ``CANCELED`` after a stop, ``BOX_LOST``
            when the vacuum goes, ``PROTECTIVE_STOP``, or what the controller says.
        """
        upcoming = list(phases)
        motion = self._link.start(timed)
        farthest_s, since = 0.0, time.monotonic()
        while not motion.wait(_LOOK_S):
            at_s = motion.at_s()
            if at_s > farthest_s:
                farthest_s, since = at_s, time.monotonic()
            if run is not None:
                while upcoming and at_s >= upcoming[0][0] - 1e-9:
                    run.enter(upcoming.pop(0)[1], done_s + at_s)
                run.progress(done_s + at_s)
                if stoppable and run.stop.is_set():
                    self._stop(motion, timed, load)
                    self._check_grasp(load, ' while it was stopped on request')
                    raise MotionError(ErrorCode.CANCELED, 'the motion was stopped on request')
            elif time.monotonic() - since > STALLED_S:
                motion.cancel()
                self._settle()
                msg = f'no motion for {STALLED_S:g} s: is the speed slider at zero?'
                raise MotionError(ErrorCode.MOTION_OVERDUE, msg)
            self._watch(motion, timed, at_s, load)
        code, text = motion.outcome()
        if code is not ErrorCode.NONE:
            self._settle()
            self._raise_trouble(_TROUBLE_TOLD_S)
            raise MotionError(code, text)
        self.commanded = timed.q[-1]
        if run is not None:
            for _, phase in upcoming:
                run.enter(phase, done_s + timed.duration)

    def _watch(
        self, motion: RunningMotion, timed: Trajectory, at_s: float, load: Load | None
    ) -> None:
        trouble = self._link.trouble()
        if trouble:
            motion.cancel()
            self._settle()
            raise MotionError(ErrorCode.PROTECTIVE_STOP, trouble)
        if load is not None and not self._link.vacuum_holds():
            self._stop(motion, timed, load)
            self._check_grasp(load, f' after {at_s:.2f} s of its way')

    def _check_grasp(self, load: Load | None, when: str) -> None:
        if load is not None and not self._link.vacuum_holds():
            msg = f'the vacuum was lost{when}; look where the box lies, and at pad and box'
            raise MotionError(ErrorCode.BOX_LOST, msg)

    def _stop(self, motion: RunningMotion, timed: Trajectory, load: Load | None) -> None:
        """Come to rest, along the path where the controller lets us."""
        pace = self._link.speed_scaling()
        if self._ramps and pace > _CREEPS and not self._link.trouble():
            at_s = min(motion.at_s() + _LEAD_S, timed.duration)
            ramp = stopped(self._timing, timed, at_s, load, pace=pace)
            times = np.r_[0.0, ramp.times + _LEAD_S]
            q, qd, qdd = (np.vstack([rows[:1], rows]) for rows in (ramp.q, ramp.qd, ramp.qdd))
            try:
                slowing = self._link.start(Trajectory(times, q, qd, qdd))
            except MotionError:
                motion.cancel()
            else:
                if not slowing.wait(_RAMP_TIMEOUT_S):
                    slowing.cancel()
        else:
            motion.cancel()
        self._settle()

    def _settle(self) -> None:
        """Wait until the joints rest, and take it from there; a silent robot is left alone."""
        until = time.monotonic() + _REST_TIMEOUT_S
        try:
            before = self._link.positions()
            while time.monotonic() < until:
                time.sleep(3 * _LOOK_S)
                now = self._link.positions()
                if np.abs(now - before).max() < _STILL:
                    break
                before = now
        except MotionError:
            return
        self.commanded = before

    def _raise_trouble(self, within_s: float) -> None:
        """A controller that gives up has mostly been stopped: the reason comes a little later."""
        until = time.monotonic() + within_s
        while not (trouble := self._link.trouble()) and time.monotonic() < until:
            time.sleep(_LOOK_S)
        if trouble:
            raise MotionError(ErrorCode.PROTECTIVE_STOP, trouble)
