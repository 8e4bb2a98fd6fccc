"""What a run's summary says of the arm's answers."""

from __future__ import annotations

import pytest

from pack_cell.report.arm_answers import AskedPlacements, asked_text
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode, PlacementStatus
from pack_msgs_py.values import Box

BOX = Box('a', (100.0, 100.0, 100.0))


def decision(objective=10.0, first=10.0, checked=1, refusal=ErrorCode.NONE, check_s=0.1):
    return Decision(
        BOX, 'bin-1', objective=objective, candidates_checked=checked, check_s=check_s,
        first_objective=first, first_refusal=refusal,
    )  # fmt: skip


def asked_summary(decisions):
    asked = AskedPlacements()
    for decided in decisions:
        asked.add(decided)
    return asked.summary()


def test_the_share_of_possible_first_choices_and_what_the_others_cost():
    summary = asked_summary(
        [
            decision(),
            decision(),
            decision(),
            decision(22.0, 10.0, 3, ErrorCode.PATH_IN_COLLISION, 0.5),
            decision(checked=0),
            Decision(BOX, status=PlacementStatus.REJECT, candidates_checked=6),
        ]
    )
    assert summary['decisions_asked'] == 4
    assert summary['first_choices_possible'] == 75.0
    assert summary['first_refusals'] == {'PATH_IN_COLLISION': 1}
    assert summary['candidates_per_decision'] == 1.5
    assert summary['objective_lost'] == pytest.approx(3.0)
    assert summary['check_s']['max'] == 0.5
    assert '75.0 % possible; 1.50 candidates' in asked_text(summary)


def test_an_arm_that_was_never_asked_has_no_share():
    summary = asked_summary([decision(checked=0)])
    assert summary['first_choices_possible'] is None
    assert asked_text(summary) == 'the arm was not asked'
