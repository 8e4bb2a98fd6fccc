"""One motion of the robot: a goal for each controller that takes part (imports ROS)."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from rclpy.action.client import ClientGoalHandle
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectoryPoint

from arm_executor.arms.trajectory.parameters import TrajectoryParameters
from arm_executor.motion.timing import Trajectory
from pack_msgs_py.codes import ErrorCode

#: At the end of a trajectory a joint moves no faster, rad/s and m/s.
_END_SPEED = 0.2
#: Arm and rail may be so far apart on their trajectory, seconds along it.
_OUT_OF_STEP_S = 0.15

_RESULT = FollowJointTrajectory.Result
_CODES = {
    _RESULT.INVALID_GOAL: ErrorCode.START_STATE_INVALID,
    _RESULT.INVALID_JOINTS: ErrorCode.START_STATE_INVALID,
    _RESULT.OLD_HEADER_TIMESTAMP: ErrorCode.START_STATE_INVALID,
}


def goal_of(
    timed: Trajectory, columns: Sequence[int], names: Sequence[str], own: TrajectoryParameters
) -> FollowJointTrajectory.Goal:
    """What a controller is told: the joints ``columns`` of ``timed``, which it calls ``names``.

    Positions and speeds, from which controllers interpolate a cubic. The tolerances name every
    joint, as the passthrough controller needs, with a speed at the end, which is 0 else.
    """
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = list(names)
    # The first sample is where the robot is already.
    goal.trajectory.points = [
        JointTrajectoryPoint(
            positions=[float(timed.q[row, column]) for column in columns],
            velocities=[float(timed.qd[row, column]) for column in columns],
            time_from_start=_duration(float(timed.times[row])),
        )
        for row in range(1, len(timed.times))
        if timed.times[row] > timed.times[row - 1] + 1e-6
    ]
    goal.trajectory.points[-1].velocities = [0.0] * len(columns)
    goal.path_tolerance = [JointTolerance(name=name, position=own.path_tolerance) for name in names]
    goal.goal_tolerance = [
        JointTolerance(name=name, position=own.goal_tolerance, velocity=_END_SPEED)
        for name in names
    ]
    goal.goal_time_tolerance = _duration(own.goal_time_tolerance_s)
    return goal


def _duration(seconds: float) -> Duration:
    whole = int(seconds)
    return Duration(sec=whole, nanosec=min(999_999_999, round((seconds - whole) * 1e9)))


class TrajectoryPart:
    """The goal of one controller: whether it was accepted, how far it is, how it ended."""

    def __init__(self, names: Sequence[str]) -> None:
        self._who = names[0] if len(names) == 1 else f'the controller of {names[-1]}'
        self._answered, self.ended = threading.Event(), threading.Event()
        self.handle: ClientGoalHandle | None = None
        self.feedback: tuple[float, float] | None = None
        self.accepted_at = 0.0
        self.code, self.text = ErrorCode.NONE, ''

    def on_answer(self, future: Future) -> None:
        """The controller has accepted or refused."""
        handle = future.result()
        if handle is not None and handle.accepted:
            self.accepted_at = time.monotonic()
            self.handle = handle
            handle.get_result_async().add_done_callback(self._on_result)
        self._answered.set()

    def on_feedback(self, msg: Any) -> None:  # noqa: ANN401 - rclpy has no type for it
        """The controller says how far it is."""
        at = msg.feedback.desired.time_from_start
        self.feedback = (time.monotonic(), at.sec + 1e-9 * at.nanosec)

    def _on_result(self, future: Future) -> None:
        answer = future.result()
        result = answer.result
        if answer.status != GoalStatus.STATUS_SUCCEEDED:
            # The passthrough controller says SUCCESSFUL even when the robot gave up.
            self.code = _CODES.get(result.error_code, ErrorCode.PATH_TOLERANCE_VIOLATED)
            said = result.error_string or 'without a word'
            how = 'canceled' if answer.status == GoalStatus.STATUS_CANCELED else 'gave up'
            self.text = f'{self._who} {how} the trajectory ({result.error_code}): {said}'
        self.ended.set()

    def refused(self, timeout_s: float) -> str:
        """Why the trajectory will not be run, within ``timeout_s``; empty when it is."""
        if not self._answered.wait(timeout_s):
            return f'{self._who} does not answer'
        if self.handle is None:
            return f'{self._who} refused the trajectory: is it active, and not busy?'
        return ''


class RobotMotion:
    """A :class:`~arm_executor.arms.trajectory.link.RunningMotion` of one goal or two.

    Parameters
    ----------
    parts : the goals.
    duration_s : of the trajectory.
    speed : robot seconds per wall-clock second.
    scaling : share of its speed that the robot runs at.
    """

    def __init__(
        self,
        parts: Sequence[TrajectoryPart],
        duration_s: float,
        speed: float,
        scaling: Callable[[], float],
    ) -> None:
        self._parts, self._duration_s, self._speed = parts, duration_s, speed
        self._scaling = scaling
        self._out_of_step = ''
        self.ask_by: Callable[[Callable[[], None]], None] = lambda job: job()

    def wait(self, timeout_s: float) -> bool:
        """Whether all of it has ended, within ``timeout_s``."""
        until = time.monotonic() + timeout_s
        done = all(part.ended.wait(max(0.0, until - time.monotonic())) for part in self._parts)
        if any(part.ended.is_set() and part.code for part in self._parts):
            # What the others would still do is no use any more.
            self.cancel()
        elif not done:
            self._check_step()
        return done

    def _check_step(self) -> None:
        known = [part for part in self._parts if part.feedback is not None]
        if len(known) < 2 or self._out_of_step:
            return
        places = [self._place(part) for part in known]
        apart_s = max(places) - min(places)
        if apart_s > _OUT_OF_STEP_S:
            self._out_of_step = f'arm and rail are {apart_s:.2f} s out of step'
            self.cancel()

    def at_s(self) -> float:
        """How far along the trajectory the slowest part is."""
        return min(self._place(part) for part in self._parts)

    def _place(self, part: TrajectoryPart) -> float:
        """By the last word of its controller, and at the robot's speed since."""
        if part.ended.is_set():
            return self._duration_s
        since, at_s = part.feedback or (part.accepted_at, 0.0)
        at_s += (time.monotonic() - since) * self._speed * self._scaling()
        return min(at_s, self._duration_s)

    def outcome(self) -> tuple[ErrorCode, str]:
        """How it ended: ``NONE``, or the first code and its text."""
        if self._out_of_step:
            return ErrorCode.PATH_TOLERANCE_VIOLATED, self._out_of_step
        for part in self._parts:
            if part.code:
                return part.code, part.text
        return ErrorCode.NONE, ''

    def cancel(self) -> None:
        """End what still runs."""
        handles = [
            part.handle
            for part in self._parts
            if part.handle is not None and not part.ended.is_set()
        ]

        def ask() -> None:
            for handle in handles:
                handle.cancel_goal_async()

        self.ask_by(ask)
