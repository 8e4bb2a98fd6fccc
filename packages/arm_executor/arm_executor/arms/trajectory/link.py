"""What the arm `trajectory` asks of a robot and its driver, whichever way these are reached.

:class:`arm_executor.ros.robot_link.RosRobotLink` reaches them by ROS. All of it is called from
threads that may wait. Configurations (7,) have the rail first, metres and radians; seconds are
those of the wall clock, but for the time along a trajectory.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.timing import Trajectory
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]


class RunningMotion(Protocol):
    """A trajectory that the robot has accepted."""

    def wait(self, timeout_s: float) -> bool:
        """Whether it has ended, within ``timeout_s``."""

    def at_s(self) -> float:
        """How far along the trajectory the robot is, by its own word; seconds of the trajectory."""

    def outcome(self) -> tuple[ErrorCode, str]:
        """How it ended: ``NONE``, or a code and a sentence with the controller's own words."""

    def cancel(self) -> None:
        """End it; returns at once."""


class RobotLink(Protocol):
    """A robot with its driver."""

    def connect(self) -> None:
        """Wait until the robot is there and tells where its joints are.

        Raises
        ------
        MotionError
            It is not; with the name of what is missing.
        """

    def positions(self) -> Array:
        """Measured configuration (7,), now.

        Raises
        ------
        MotionError
            ``START_STATE_INVALID``: nothing was heard for too long.
        """

    def trouble(self) -> str:
        """Why the robot cannot move, empty when it can: safety stop, power, program, silence."""

    def speed_scaling(self) -> float:
        """Share of its speed at which the robot runs trajectories, 0 to 1."""

    def start(self, timed: Trajectory) -> RunningMotion:
        """Have ``timed`` run from now on, in place of one that still runs.

        Raises
        ------
        MotionError
            It was refused.
        """

    def set_vacuum(self, *, on: bool) -> None:
        """Switch the vacuum.

        Raises
        ------
        MotionError
            ``PROTECTIVE_STOP``: it was not done.
        """

    def vacuum_holds(self) -> bool:
        """Whether the pad holds something."""

    def set_payload(self, mass: float, centre: Vec3) -> None:
        """Tell what hangs on the flange: kg, and its centre of mass in the flange's frame, metres.

        Raises
        ------
        MotionError
            ``PROTECTIVE_STOP``: it was not done.
        """
