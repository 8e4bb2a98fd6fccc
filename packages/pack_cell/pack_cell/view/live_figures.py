"""The figures of the page: of the last boxes, so that they tell how the cell runs now."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field

from pack_msgs_py.cell_values import BoxEvent, Decision, Report
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.values import Bin

#: Boxes that rates and times are of.
WINDOW = 100
#: Messages of which a repetition is recognized.
_REMEMBERED = 2000


class SeenBefore:
    """Recognizes what was there already, among the last of many."""

    def __init__(self, most: int = _REMEMBERED) -> None:
        self._seen: dict[Hashable, None] = {}
        self._most = most

    def __call__(self, key: Hashable) -> bool:
        """Whether ``key`` has been asked about before."""
        if key in self._seen:
            return True
        self._seen[key] = None
        while len(self._seen) > self._most:
            del self._seen[next(iter(self._seen))]
        return False


def _recent() -> deque[float]:
    return deque(maxlen=WINDOW)


@dataclass
class LiveFigures:
    """Counts since the page began to listen, and times of the last :data:`WINDOW` boxes.

    ``slack_s`` is what was left of the deadline, ``robot_s`` robot time of each goal, failed ones
    and waiting for the belt included.
    """

    placed: int = 0
    rejects: Counter[Reason] = field(default_factory=Counter)
    lost: int = 0
    late: int = 0
    planning_s: deque[float] = field(default_factory=_recent)
    slack_s: deque[float] = field(default_factory=_recent)
    goals: deque[tuple[float, bool]] = field(default_factory=lambda: deque(maxlen=WINDOW))
    closed: dict[int, float] = field(default_factory=dict)

    def add_decision(self, decision: Decision) -> None:
        """Count a decision that was not known."""
        self.planning_s.append(decision.planning_s)

    def add_report(self, report: Report) -> None:
        """Count a goal that has ended and was not known."""
        in_bin = report.code.box_is_in_bin
        self.goals.append((max(0.0, report.cycle_s + report.wait_s), in_bin))
        if in_bin:
            self.slack_s.append(report.slack_s)
            self.late += report.slack_s < 0

    def add_event(self, event: BoxEvent) -> None:
        """Count an event that was not known."""
        self.placed += event.event is BoxEventKind.PLACED
        self.lost += event.event is BoxEventKind.LOST
        if event.event is BoxEventKind.REJECTED:
            self.rejects[event.reason] += 1

    def add_closed(self, closed: Bin) -> None:
        """Count a bin that was taken away; again is no matter."""
        self.closed[closed.serial] = closed.fill_rate

    @property
    def boxes_per_hour(self) -> float | None:
        """Placed boxes per hour of robot time; ``None`` before the first."""
        robot_s = sum(seconds for seconds, _ in self.goals)
        placed = sum(in_bin for _, in_bin in self.goals)
        return 3600 * placed / robot_s if placed and robot_s > 0 else None

    @property
    def planning_p95_s(self) -> float | None:
        """What 95 % of the last decisions took at most."""
        return share_below(self.planning_s, 0.95)

    @property
    def fill_closed(self) -> float | None:
        """Mean fill of the closed bins, 0 to 1 (eq. 2 of Ojha et al.)."""
        return sum(self.closed.values()) / len(self.closed) if self.closed else None

    @property
    def least_slack_s(self) -> float | None:
        """The least that was left of a deadline."""
        return min(self.slack_s, default=None)

    @property
    def mean_slack_s(self) -> float | None:
        """What is left of the deadline in the mean."""
        return sum(self.slack_s) / len(self.slack_s) if self.slack_s else None


def share_below(values: Iterable[float], share: float) -> float | None:
    """The smallest of ``values`` that ``share`` of them do not exceed; ``None`` of none.

    >>> share_below([3.0, 1.0, 2.0, 4.0], 0.75)
    3.0
    """
    ordered = sorted(values)
    return ordered[math.ceil(share * len(ordered)) - 1] if ordered else None
