"""The belt in robot time: when it stands because it is paused or jammed."""

from __future__ import annotations

import math

from conveyor_sim.belt.jams import Jams
from conveyor_sim.belt.loop import Belt
from conveyor_sim.belt.robot_clock import RobotClock


class BeltTime:
    """Stops and starts ``belt`` as the operator and the jams will have it."""

    def __init__(self, belt: Belt, jams: Jams, speed: float) -> None:
        self.clock = RobotClock(speed)
        self.jammed = self.paused = self.kept = self.with_arm = self.inactive = False
        self._belt = belt
        self._jams = jams
        self._robot_s = 0.0

    @property
    def stands(self) -> bool:
        """Whether nothing moves and nothing is fed.

        ``kept`` : until a jam is acknowledged. ``with_arm`` : as long as the arm stands.
        ``inactive`` : until its node is activated.
        """
        return self.paused or self.jammed or self.kept or self.with_arm or self.inactive

    def restore(self, robot_s: float, now_s: float, *, paused: bool) -> None:
        """Go on from ``robot_s``."""
        self.clock.restore(robot_s, now_s)
        self._robot_s, self.paused = robot_s, paused
        self.jammed = self._jammed_now()
        self._belt.set_motion(now_s, paused=self.stands)

    def pause(self, paused: bool, now_s: float) -> None:
        """The operator stops the belt, or lets it go on."""
        self.paused = paused
        self._belt.set_motion(now_s, paused=self.stands)

    def keep(
        self,
        now_s: float,
        *,
        kept: bool | None = None,
        with_arm: bool | None = None,
        inactive: bool | None = None,
    ) -> None:
        """Let the belt stand for another reason, or no longer for that."""
        self.kept = self.kept if kept is None else kept
        self.with_arm = self.with_arm if with_arm is None else with_arm
        self.inactive = self.inactive if inactive is None else inactive
        self._belt.set_motion(now_s, paused=self.stands)

    def tune(self, now_s: float, belt_speed: float, speed: float) -> None:
        """Change the belt's speed and the speed factor; at speed 0 jams take no time."""
        self.clock.set_speed(speed, now_s)
        self.jammed = self._jammed_now()
        self._belt.set_motion(now_s, belt_speed=belt_speed, speed=speed, paused=self.stands)

    def advance(self, now_s: float) -> list[bool]:
        """Bring the belt up to now; returns what jams did on the way: began or ended."""
        changes = []
        robot_s, speed = self.clock.at(now_s), self.clock.speed
        while speed > 0 and (change_s := self._jams.next_change_s(self._robot_s)) <= robot_s:
            self._robot_s = change_s
            self.jammed = self._jammed_now()
            changes.append(self.jammed)
            when_s = now_s - (robot_s - change_s) / speed
            self._belt.set_motion(when_s, paused=self.stands)
        self._robot_s = robot_s
        return changes

    def next_change_s(self, now_s: float) -> float | None:
        """When, on the steady clock, the next jam begins or ends."""
        change_s = self._jams.next_change_s(self._robot_s)
        return None if math.isinf(change_s) else self.clock.wall_s(change_s, now_s)

    def _jammed_now(self) -> bool:
        return self.clock.speed > 0 and self._jams.jammed(self._robot_s)
