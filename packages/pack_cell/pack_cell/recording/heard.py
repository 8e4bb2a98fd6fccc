"""What was said in a run, as values with the robot time at which it was said."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pack_msgs_py.codes import Mode
from pack_msgs_py.geometry.pose import Pose


@dataclass(frozen=True)
class Heard:
    """One message: when, on which topic (without its namespace), and what it says.

    ``robot_s`` is robot time since the start of the recording, seconds; ``value`` is a value of the
    cell, or one of the classes below.
    """

    robot_s: float
    topic: str
    value: Any


@dataclass(frozen=True)
class ArmMode:
    """What the arm says of itself."""

    mode: Mode
    message: str = ''


@dataclass(frozen=True)
class JointPositions:
    """Where the joints are, metres and radians, by their names."""

    names: tuple[str, ...]
    positions: tuple[float, ...]


@dataclass(frozen=True)
class FixedFrame:
    """Where a frame stands in another one."""

    name: str
    parent: str
    pose: Pose


@dataclass(frozen=True)
class RobotText:
    """The robot as URDF."""

    urdf: str


class RobotTimes:
    """Robot time by the time on the wall, between what was said of it, seconds.

    Parameters
    ----------
    told : pairs of wall time and robot time, nanoseconds, in the order of wall time. Without any
        robot time is that on the wall.
    start_ns : wall time of the first message.
    """

    def __init__(self, told: Sequence[tuple[int, int]], start_ns: int) -> None:
        self._walls = [wall for wall, _ in told]
        self._robots = [robot for _, robot in told]
        self._start_ns = start_ns

    def at(self, wall_ns: int) -> float:
        """Robot seconds since the first that was told; 0 before it."""
        if not self._walls:
            return 1e-9 * (wall_ns - self._start_ns)
        after = bisect_right(self._walls, wall_ns)
        if after == 0:
            return 0.0
        robot_ns: float = self._robots[after - 1]
        if after < len(self._walls):
            share = (wall_ns - self._walls[after - 1]) / (
                self._walls[after] - self._walls[after - 1]
            )
            robot_ns += share * (self._robots[after] - robot_ns)
        return 1e-9 * (robot_ns - self._robots[0])
