"""What a decision may take: seconds, and nodes of the search.

Compiled code does not ask Python what time it is. It looks at a flag in each turn of its loops, and
a timer raises that flag when the time is out; so a loop ends within a few microseconds, however
long it would have gone on and however busy the machine is.
"""

from __future__ import annotations

import math
import threading
import time

import numpy as np


class Budget:
    """Seconds and nodes for a search; a context, at the end of which its timer ends.

    Attributes
    ----------
    stop : what compiled loops look at, bool (1,). What they made when it is raised is not complete.
    taken : nodes that were taken.
    """

    def __init__(self, seconds: float = math.inf, nodes: float = math.inf) -> None:
        self._until = time.monotonic() + seconds
        self._nodes = nodes
        self.taken = 0
        self.stop = np.array([seconds <= 0.0])
        self._timer: threading.Timer | None = None
        if 0.0 < seconds < threading.TIMEOUT_MAX:
            self._timer = threading.Timer(seconds, self.end)
            self._timer.daemon = True
            self._timer.start()

    def __enter__(self) -> Budget:
        return self

    def __exit__(self, *_: object) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def end(self) -> None:
        """Raise the flag: nothing is left."""
        self.stop[0] = True

    def is_out(self) -> bool:
        """Whether there is no time left, or no node."""
        if self.taken >= self._nodes or time.monotonic() >= self._until:
            self.end()
        return bool(self.stop[0])

    @property
    def seconds_left(self) -> float:
        """Seconds until the answer is due, not below 0."""
        return max(0.0, self._until - time.monotonic())

    @property
    def nodes_left(self) -> int:
        """Nodes that may still be taken."""
        return int(max(0.0, min(self._nodes - self.taken, float(1 << 40))))

    def take(self, nodes: int) -> None:
        """Count ``nodes`` of the search."""
        self.taken += nodes

    def half(self) -> Budget:
        """A budget of half of what is left; what it takes is to be taken from this one too."""
        return Budget(self.seconds_left / 2.0, (self._nodes - self.taken) / 2.0)
