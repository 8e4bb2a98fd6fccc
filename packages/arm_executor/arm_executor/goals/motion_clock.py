"""Robot time as the arm lives it: what it moved, and what it stood still."""

from __future__ import annotations

import time
from collections.abc import Callable


class MotionClock:
    """Seconds since the start, of which those in motion are the arm's own.

    While the arm moves, its motion says how much robot time passes; while it stands still,
    ``speed`` robot seconds pass in one of ``steady``: none at speed 0. So between two readings the
    joints have moved by their speeds times the difference. Of an arm that does not count its motion
    time passes as on the wall.
    """

    def __init__(self, speed: float = 1.0, steady: Callable[[], float] = time.monotonic) -> None:
        self._speed = speed
        self._steady = steady
        self._looked_s = steady()
        self._moved_s: float | None = None
        self._now_s = 0.0

    def at(self, moved_s: float | None) -> float:
        """Robot time now, seconds; ``moved_s`` are those that the arm has moved for so far."""
        wall_s = self._steady()
        stood_s, self._looked_s = wall_s - self._looked_s, wall_s
        before_s, self._moved_s = self._moved_s, moved_s
        if moved_s is None:
            self._now_s += stood_s
        elif before_s is not None and moved_s > before_s:
            self._now_s += moved_s - before_s
        else:
            self._now_s += self._speed * stood_s
        return self._now_s
