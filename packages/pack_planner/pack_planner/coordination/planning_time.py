"""What planning costs of a box's time: by the clock, or counted by what was done.

An arm at speed 0 moves as fast as the machine computes. Then no clock tells what a motion would
have hidden, and a busy machine would make goals late. So everything is counted instead: a decision
by the nodes of its search, an answer of the arm by what it predicted and planned, and a motion
hides as much as would follow its pick. Runs of one seed then decide alike, on any machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pack_msgs_py.cell_values import MOTION_PLAN_S
from pack_planner.coordination.answers import TRANSIENT, CheckAnswer

#: Seconds of a decision beside its nodes, and of a prediction: medians of two slow cores.
DECISION_S, PREDICTION_S = 0.002, 0.002
#: Share of a motion that follows its pick: 0.71 to 0.78 of four kinds of bins.
AFTER_PICK_SHARE = 0.7


@dataclass(frozen=True)
class PlanningTime:
    """Seconds that planning counts; ``node_s`` is those of a node, ``None``: by the clock."""

    node_s: float | None = None

    @property
    def is_counted(self) -> bool:
        """Whether the clock does not matter."""
        return self.node_s is not None

    def of_decision(self, nodes: int, clock_s: float) -> float:
        """Of a decision that searched ``nodes`` and took ``clock_s`` by the clock."""
        return clock_s if self.node_s is None else DECISION_S + nodes * self.node_s

    def of_answers(self, answers: Sequence[CheckAnswer], clock_s: float) -> float:
        """Of what the arm answered after ``clock_s`` by the clock."""
        if not self.is_counted:
            return clock_s
        looked_at = [answer for answer in answers if answer.code not in TRANSIENT]
        planned = sum(not answer.predicted for answer in looked_at)
        return PREDICTION_S * len(looked_at) + MOTION_PLAN_S * planned

    def hidden_by(self, motion_s: float) -> float:
        """What a motion of so much robot time hides of the planning that follows it, if counted."""
        return AFTER_PICK_SHARE * motion_s if self.is_counted else 0.0


BY_CLOCK = PlanningTime()
