"""What the coordinator asks for, and the decisions that it has under way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.values import Bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.coordination.negotiation import Talk
from pack_planner.decision.planner import PlannerStep
from pack_planner.decision.policy import DecisionState


class Outputs(Protocol):
    """What the coordinator can have done."""

    def plan(self, number: int, state: DecisionState, candidates: int) -> None:
        """Decide about ``state``; answer with :meth:`Coordinator.on_planned`.

        Up to ``candidates`` placements, best first, are what is asked for.
        """

    def check(self, number: int, candidates: Sequence[Decision], enough_s: float) -> None:
        """Ask the arm about ``candidates``; answer with :meth:`Coordinator.on_checked`.

        The first that takes at most ``enough_s`` will do.
        """

    def announce(self, decision: Decision, bins: tuple[Bin, ...]) -> Decision:
        """Publish a decision; returns it with its sequence number and stamps."""

    def send(self, decision: Decision, target: Bin, unhidden_s: float) -> bytes:
        """Send a goal; returns its id. ``unhidden_s``: planning that no motion hid."""

    def closing(self, reason: ClosingReason) -> None:
        """Say why a bin is about to be closed."""

    def swap(self, target: Bin, destination: str) -> None:
        """Ask for an empty bin instead, for ``destination`` (empty: as before).

        Answer with :meth:`Coordinator.on_swapped`.
        """

    def refresh_bins(self) -> None:
        """Ask for the current `bin_state` again."""

    def info(self, text: str) -> None:
        """Tell the operator."""

    def warn(self, text: str) -> None:
        """Tell the operator that something is not as it should be."""


@dataclass(frozen=True)
class PlanRequest:
    """A decision being computed."""

    number: int
    bins: tuple[Bin, ...]
    box_ids: tuple[str, ...]
    scan_sequence: int
    ahead: bool
    talk: Talk


@dataclass(frozen=True)
class ReadyDecision:
    """What is to be done once the running goal has ended as expected."""

    outcome: PlannerStep
    plan: PlanRequest
    ready_s: float


@dataclass(frozen=True)
class CheckRequest:
    """Candidates that the arm has been asked about."""

    plan: PlanRequest
    planned: Planned
    limit_s: float
    asked_s: float
