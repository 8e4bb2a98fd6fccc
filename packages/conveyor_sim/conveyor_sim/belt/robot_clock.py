"""Robot time: what the arm and the belt are simulated in."""

from __future__ import annotations


class RobotClock:
    """Robot seconds, which pass ``speed`` times as fast as those of the steady clock.

    At speed 0, as fast as possible, no time passes by itself: the arm says how much its motions
    took, and who has nothing else to wait for skips to what comes next.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._robot_s = 0.0
        self._since_s = 0.0

    def restore(self, robot_s: float, now_s: float) -> None:
        """Go on from ``robot_s``."""
        self._robot_s, self._since_s = robot_s, now_s

    def at(self, now_s: float) -> float:
        """Robot seconds since the first start."""
        self._robot_s += max(0.0, now_s - self._since_s) * self.speed
        self._since_s = max(now_s, self._since_s)
        return self._robot_s

    def set_speed(self, speed: float, now_s: float) -> None:
        """Let time pass at another speed from now on."""
        self.at(now_s)
        self.speed = speed

    def pass_by(self, seconds: float) -> None:
        """At speed 0: so much robot time was spent; otherwise it has passed by itself."""
        if self.speed == 0:
            self._robot_s += max(0.0, seconds)

    def skip_to(self, robot_s: float) -> None:
        """At speed 0: nothing happens until ``robot_s``."""
        if self.speed == 0:
            self._robot_s = max(self._robot_s, robot_s)

    def wall_s(self, robot_s: float, now_s: float) -> float | None:
        """When, on the steady clock, it will be ``robot_s``; ``None`` at speed 0."""
        if self.speed == 0:
            return None
        return now_s + max(0.0, robot_s - self.at(now_s)) / self.speed
