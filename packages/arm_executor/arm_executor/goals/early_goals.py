"""Goals that came before the scan that they rest on: goal and scan travel on different ways."""

from __future__ import annotations

from collections.abc import Callable

from arm_executor.goals.belt_view import BeltView
from arm_executor.goals.place_goal import PlaceGoal

#: A goal waits for its scan for so long, seconds.
EARLY_S = 0.5


class EarlyGoals:
    """Keeps goals until their scan has come, or they have waited for :data:`EARLY_S`.

    ``steady`` gives seconds of no particular origin.
    """

    def __init__(self, belt: BeltView, steady: Callable[[], float]) -> None:
        self._belt = belt
        self._steady = steady
        self._waiting: list[tuple[PlaceGoal, float]] = []

    def kept(self, goal: PlaceGoal) -> bool:
        """Whether ``goal`` has to wait; it is then kept here."""
        waits = self._is_early(goal)
        if waits:
            self._waiting.append((goal, self._steady() + EARLY_S))
        return waits

    def due(self) -> list[PlaceGoal]:
        """Take out the goals that wait no longer, in the order in which they came."""
        due = []
        waiting, self._waiting = self._waiting, []
        for goal, until_s in waiting:
            if self._is_early(goal) and self._steady() < until_s:
                self._waiting.append((goal, until_s))
            else:
                due.append(goal)
        return due

    def removed(self, goal_id: bytes) -> list[PlaceGoal]:
        """Take out the goal that was cancelled, if it waits here."""
        removed = [goal for goal, _ in self._waiting if goal.goal_id == goal_id]
        self._waiting = [entry for entry in self._waiting if entry[0].goal_id != goal_id]
        return removed

    def _is_early(self, goal: PlaceGoal) -> bool:
        scan = self._belt.scan
        return goal.decision.scan_sequence > (0 if scan is None else scan.sequence)
