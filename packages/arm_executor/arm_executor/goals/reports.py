"""Reports of goals that were refused before anything moved."""

from __future__ import annotations

import math

from arm_executor.goals.admission import PlaceGoal, Refusal
from pack_msgs_py.cell_values import Report


def refusal_report(goal: PlaceGoal, refusal: Refusal, now_s: float) -> Report:
    """Report of a goal that was refused at ``now_s``, seconds since the epoch."""
    decision = goal.decision
    return Report(
        box_id=decision.box.id,
        bin_id=decision.bin_id,
        bin_serial=decision.bin_serial,
        bin_revision=decision.bin_revision,
        code=refusal.code,
        message=refusal.message,
        commanded=decision.target,
        slack_s=goal.deadline_s - now_s if math.isfinite(goal.deadline_s) else 0.0,
        goal_id=goal.goal_id,
        stamp_s=now_s,
    )
