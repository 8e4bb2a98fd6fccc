"""What the arm said of the planner's choices before they became goals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode, PlacementStatus
from pack_msgs_py.metrics import time_summary


def asked_summary(decisions: Sequence[Decision]) -> dict[str, Any]:
    """How far the arm's word changed the decisions to place a box, as plain data.

    Decisions that the arm was not asked about do not count; nor does what ended without a
    placement, when every candidate was refused and a bin was closed instead.

    ``first_choices_possible`` : percent whose first choice the arm could do.
    ``first_refusals`` : why it could not, by code.
    ``candidates_per_decision`` : that the arm looked at, mean.
    ``objective_lost`` : by how much the objective of what was taken lies above that of the first
    choice, centimetres, mean over all decisions; negative when the box alone got a better place.
    ``check_s`` : seconds that asking took.
    """
    asked = [
        one
        for one in decisions
        if one.candidates_checked and one.status is not PlacementStatus.REJECT
    ]
    refused = [one for one in asked if one.first_refusal is not ErrorCode.NONE]
    reasons: dict[str, int] = {}
    for one in refused:
        reasons[one.first_refusal.name] = reasons.get(one.first_refusal.name, 0) + 1
    count = len(asked)
    lost = sum(one.objective - one.first_objective for one in asked)
    return {
        'decisions_asked': count,
        'first_choices_possible': 100.0 * (count - len(refused)) / count if count else None,
        'first_refusals': dict(sorted(reasons.items())),
        'candidates_per_decision': (
            sum(one.candidates_checked for one in asked) / count if count else None
        ),
        'objective_lost': lost / count if count else None,
        'check_s': time_summary([one.check_s for one in asked]),
    }


def asked_text(found: dict[str, Any]) -> str:
    """One line for people."""
    if not found['decisions_asked']:
        return 'the arm was not asked'
    return (
        f'{found["first_choices_possible"]:.1f} % possible; '
        f'{found["candidates_per_decision"]:.2f} candidates asked per decision, '
        f'p95 {1e3 * found["check_s"]["p95"]:.0f} ms, '
        f'objective {found["objective_lost"]:+.1f} cm'
    )
