"""The one report in which a goal ends: of a placement that was tried, or of a refusal."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from arm_executor.goals.admission import Refusal
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.goals.waiting import Waiting
from arm_executor.model.arm_interface import MotionResult
from pack_msgs_py.cell_values import Report
from pack_msgs_py.checks import LONGEST_S
from pack_msgs_py.geometry.pose import Pose, corner_distance, metres, turn_between


@dataclass(frozen=True)
class GoalTimes:
    """Seconds of a goal before its motion.

    ``budget_s`` is the time from receipt to deadline, ``planning_s`` what planning took of it,
    ``waited`` how long the arm had to wait for belt and tray.
    """

    budget_s: float
    planning_s: float
    waited: Waiting


def placement_report(
    goal: PlaceGoal,
    result: MotionResult,
    times: GoalTimes,
    now_s: float,
    expected: Pose | None = None,
) -> Report:
    """Report of a goal that ended at ``now_s``, seconds since the epoch, with ``result``.

    Errors count from ``expected``, where the box should rest; by default from the target.
    """
    decision, measured = goal.decision, result.measured
    cycle_s = times.planning_s + times.waited.tray_s + result.motion_s
    report = Report(
        box_id=decision.box.id,
        bin_id=decision.bin_id,
        bin_serial=decision.bin_serial,
        bin_revision=decision.bin_revision,
        code=result.code,
        message=result.message,
        commanded=decision.target,
        measured=measured,
        others_moved_m=result.others_moved_m,
        planning_s=times.planning_s,
        wait_s=times.waited.belt_s,
        motion_s=result.motion_s,
        cycle_s=cycle_s,
        slack_s=times.budget_s - cycle_s,
        goal_id=goal.goal_id,
        stamp_s=now_s,
        attributes=decision.box.extra,
    )
    if measured is None:
        return report
    expected = expected or decision.target
    return replace(
        report,
        position_error_m=corner_distance(expected, measured, metres(decision.box.size_mm)),
        angle_error_rad=turn_between(expected, measured),
    )


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
        slack_s=_slack_s(goal.deadline_s, now_s),
        goal_id=goal.goal_id,
        stamp_s=now_s,
        attributes=decision.box.extra,
    )


def _slack_s(deadline_s: float, now_s: float) -> float:
    """Time left, as far as a report can say it; 0 for a deadline that is none."""
    if not math.isfinite(deadline_s):
        return 0.0
    return min(LONGEST_S, max(-LONGEST_S, deadline_s - now_s))
