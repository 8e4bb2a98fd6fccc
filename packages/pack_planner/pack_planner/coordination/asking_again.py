"""When to ask again for what should have been heard long ago, and whose message may be lost."""

from __future__ import annotations

#: What is missing is asked for again after so long, and then after ever longer, seconds.
FIRST_S, LONGEST_S = 4.0, 60.0


class AskingAgain:
    """For one topic; times are seconds of the steady clock."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._wait_s = FIRST_S

    def due(self, *, missing: bool, now_s: float) -> bool:
        """Whether to ask now; ``missing`` says that nothing was heard that could be used."""
        if not missing:
            self._since_s, self._wait_s = None, FIRST_S
            return False
        if self._since_s is None:
            self._since_s = now_s
        if now_s - self._since_s < self._wait_s:
            return False
        self._since_s, self._wait_s = now_s, min(LONGEST_S, 2.0 * self._wait_s)
        return True
