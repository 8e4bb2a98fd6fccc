"""The heartbeat, which goes on while the node's thread is held up by one long request.

Reading a request of a thousand candidates out of its message takes more than a second, in which
nothing else runs on the node's thread. A heartbeat of that thread alone would stop, and the planner
would forget the arm. So a thread beside it repeats the last heartbeat for a while; one that is held
up for longer is taken for hung, and falls silent.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

#: The node's own thread beats this much later than it should before the other one steps in.
STEP_IN_S = 0.1
#: A thread that has done nothing for so long is taken for hung, seconds.
HELD_UP_S = 10.0


class SteadyHeartbeat:
    """Beats for the node's thread while that is held up.

    Parameters
    ----------
    again : sends the last heartbeat once more, with a stamp of now; called from a thread of its
        own, never beside :meth:`beat`, and may raise when the node is being taken down.
    period_s : how often the heart beats, seconds.
    steady : clock, seconds of no particular origin.
    """

    def __init__(
        self,
        again: Callable[[], None],
        period_s: float,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._again = again
        self._period_s = period_s
        self._steady = steady
        self._lock = threading.Lock()
        self._own_s: float | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._work, name='heartbeat', daemon=True)
        self._thread.start()

    def beat(self, send: Callable[[], None]) -> None:
        """Beat from the node's own thread, by ``send``."""
        with self._lock:
            self._own_s = self._steady()
            send()

    def end(self) -> None:
        """Beat no more."""
        self._ended.set()
        self._thread.join()

    def step_in(self) -> bool:
        """Beat for the node's thread if that is held up; whether it was."""
        with self._lock:
            if self._own_s is None or self._ended.is_set():
                return False
            late_s = self._steady() - self._own_s - self._period_s
            if not STEP_IN_S <= late_s < HELD_UP_S:
                return False
            self._again()
            return True

    def _work(self) -> None:
        while not self._ended.wait(self._period_s):
            try:
                self.step_in()
            except Exception:
                # A signal has closed the context; the node's own thread tells if it is anything
                # else, at its next beat.
                continue
