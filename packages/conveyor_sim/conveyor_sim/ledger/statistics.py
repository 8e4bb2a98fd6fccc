"""What the belt has seen so far: waits, laps, windows that were missed."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass


@dataclass
class BeltStatistics:
    """Since the first start of this ledger. Waits are robot time from being laid on to the pick.

    ``missed_windows``: a box was held at the pick point, and not picked in its time.
    ``late_picks``: a box was picked from a running belt after the blade had let it go.
    """

    picks: int = 0
    longest_wait_s: float = 0.0
    longest_wait_box: str = ''
    most_laps: int = 0
    missed_windows: int = 0
    late_picks: int = 0
    jams: int = 0

    @classmethod
    def from_text(cls, text: str) -> BeltStatistics:
        """As :meth:`text` wrote it; empty for none yet."""
        return cls(**json.loads(text)) if text else cls()

    def text(self) -> str:
        """As JSON."""
        return json.dumps(asdict(self))

    def waited(self, box_id: str, seconds: float, laps: int) -> None:
        """A box has waited so long, and was passed over so often."""
        if seconds > self.longest_wait_s:
            self.longest_wait_s, self.longest_wait_box = seconds, box_id
        self.most_laps = max(self.most_laps, laps)
