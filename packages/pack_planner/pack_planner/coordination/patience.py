"""How long a look-ahead that is not full is waited for."""

from __future__ import annotations

from dataclasses import dataclass

from pack_planner.coordination.inputs import Inputs


@dataclass
class Patience:
    """Says when there is enough on the belt to choose from.

    Attributes
    ----------
    look_ahead : boxes that the belt holds when it is full.
    least : with so many the planner decides at once; 0 for a full belt only.
    seconds : then it takes what there is, counted from when there was something, but not enough.
    """

    look_ahead: int
    least: int = 0
    seconds: float = 3.0
    _short_since_s: float | None = None

    def enough(self, inputs: Inputs) -> bool:
        """Whether there is no reason to wait: the belt is full, at its end, or full enough."""
        least = min(self.least, self.look_ahead)
        return inputs.look_ahead_full(self.look_ahead) or 0 < least <= len(inputs.available())

    def over(self, inputs: Inputs, now_s: float) -> bool:
        """Whether to decide now: there is enough, or there has been something for long enough."""
        some = bool(inputs.available())
        if self.enough(inputs) or not some:
            self._short_since_s = None
            return some
        if self._short_since_s is None:
            self._short_since_s = now_s
        return now_s - self._short_since_s > self.seconds
