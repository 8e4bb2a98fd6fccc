"""An executor that rests between messages while nobody waits for what comes of them."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.executors import SingleThreadedExecutor, TimeoutException

#: How long it rests at most, seconds: the topics of the cell hold back more than is said meanwhile.
REST_S = 0.5


class RestingExecutor(SingleThreadedExecutor):
    """Takes all that has come, then rests for ``rest_s`` or until ``awake`` is set.

    A message wakes rclpy's executor, which then looks at everything that a node has, in Python:
    that costs more than most messages. While ``awake`` is set this one does the same.
    """

    def __init__(self, awake: threading.Event, rest_s: float = REST_S, **arguments: Any) -> None:  # noqa: ANN401 - rclpy's own
        super().__init__(**arguments)
        self._awake, self._rest_s = awake, rest_s

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for something and do it, or do all that has come and rest."""
        if self._awake.is_set():
            super().spin_once(timeout_sec)
            return
        while self._do_what_is_ready():
            pass
        self._awake.wait(self._rest_s if timeout_sec is None else min(timeout_sec, self._rest_s))

    def _do_what_is_ready(self) -> int:
        """How much there was, at most one message of each topic."""
        done = 0
        while True:
            try:
                handler, _, _ = self.wait_for_ready_callbacks(0.0)
            except TimeoutException:
                return done
            handler()
            handler.result()
            done += 1
