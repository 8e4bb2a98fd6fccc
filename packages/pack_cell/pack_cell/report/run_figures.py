"""Times and counts of a run: of each decision and each goal a few numbers, and nothing else."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field

from pack_cell.report.arm_answers import AskedPlacements
from pack_msgs_py.cell_values import Decision, Report
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import stands_upright


def _numbers() -> array[float]:
    return array('d')


@dataclass
class RunFigures:
    """Eight numbers a box at most, so that a long run takes no more memory than a short one.

    ``goals`` counts every goal that has ended by its code. Times are of goals that ended with the
    box in its bin, ``tray_s`` of those of them with another face up than on the belt; ``robot_s``
    is robot time of all goals, waiting for the belt included.
    """

    planning_s: array[float] = field(default_factory=_numbers)
    overhead_s: array[float] = field(default_factory=_numbers)
    arm_planning_s: array[float] = field(default_factory=_numbers)
    motion_s: array[float] = field(default_factory=_numbers)
    wait_s: array[float] = field(default_factory=_numbers)
    tray_s: array[float] = field(default_factory=_numbers)
    slack_s: array[float] = field(default_factory=_numbers)
    errors_mm: array[float] = field(default_factory=_numbers)
    goals: Counter[ErrorCode] = field(default_factory=Counter)
    asked: AskedPlacements = field(default_factory=AskedPlacements)
    robot_s: float = 0.0
    others_moved_mm: float | None = None

    def add_decision(self, decision: Decision) -> None:
        """Count a decision; the overhead of the first is not ROS, the planner loads its engine."""
        if self.planning_s and decision.trigger_stamp_s > 0:
            spent_s = (
                decision.stamp_s - decision.trigger_stamp_s - decision.planning_s - decision.check_s
            )
            self.overhead_s.append(max(0.0, spent_s))
        self.planning_s.append(decision.planning_s)
        self.asked.add(decision)

    def add_report(self, report: Report) -> None:
        """Count a goal that has ended."""
        self.goals[report.code] += 1
        self.robot_s += report.cycle_s + report.wait_s
        if not report.code.box_is_in_bin:
            return
        self.arm_planning_s.append(report.planning_s)
        self.motion_s.append(report.motion_s)
        self.wait_s.append(report.wait_s)
        self.slack_s.append(report.slack_s)
        if not stands_upright(report.commanded.quaternion):
            self.tray_s.append(max(0.0, report.cycle_s - report.planning_s - report.motion_s))
        self.others_moved_mm = max(self.others_moved_mm or 0.0, 1e3 * report.others_moved_m)
        if report.measured is not None:
            self.errors_mm.append(1e3 * report.position_error_m)

    @property
    def in_bin(self) -> int:
        """Goals that ended with the box in its bin."""
        return len(self.slack_s)
