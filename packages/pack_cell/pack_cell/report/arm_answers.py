"""What the arm said of the planner's choices before they became goals."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode, PlacementStatus
from pack_msgs_py.metrics import time_summary


@dataclass
class AskedPlacements:
    """How far the arm's word changed the decisions to place a box; keeps numbers alone."""

    _check_s: array[float] = field(default_factory=lambda: array('d'))
    _refusals: Counter[str] = field(default_factory=Counter)
    _candidates: int = 0
    _lost: float = 0.0

    def add(self, decision: Decision) -> None:
        """Count one decision.

        Decisions that the arm was not asked about do not count; nor does what ended without a
        placement, when every candidate was refused and a bin was closed instead.
        """
        if not decision.candidates_checked or decision.status is PlacementStatus.REJECT:
            return
        self._check_s.append(decision.check_s)
        self._candidates += decision.candidates_checked
        self._lost += decision.objective - decision.first_objective
        if decision.first_refusal is not ErrorCode.NONE:
            self._refusals[decision.first_refusal.name] += 1

    def summary(self) -> dict[str, Any]:
        """As plain data.

        ``first_choices_possible`` : percent whose first choice the arm could do.
        ``first_refusals`` : why it could not, by code.
        ``candidates_per_decision`` : that the arm looked at, mean.
        ``objective_lost`` : by how much the objective of what was taken lies above that of the
        first choice, centimetres, mean over all decisions; negative when the box alone got a
        better place.
        ``check_s`` : seconds that asking took.
        """
        count = len(self._check_s)
        possible = count - self._refusals.total()
        return {
            'decisions_asked': count,
            'first_choices_possible': 100.0 * possible / count if count else None,
            'first_refusals': dict(sorted(self._refusals.items())),
            'candidates_per_decision': self._candidates / count if count else None,
            'objective_lost': self._lost / count if count else None,
            'check_s': time_summary(self._check_s),
        }


def asked_text(answers: dict[str, Any]) -> str:
    """One line for people."""
    if not answers['decisions_asked']:
        return 'the arm was not asked'
    return (
        f'{answers["first_choices_possible"]:.1f} % possible; '
        f'{answers["candidates_per_decision"]:.2f} candidates asked per decision, '
        f'p95 {1e3 * answers["check_s"]["p95"]:.0f} ms, '
        f'objective {answers["objective_lost"]:+.1f} cm'
    )
