"""Times and counts of a run: of each decision and each goal a few numbers, and nothing else."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from pack_cell.report.arm_answers import Asked
from pack_msgs_py.cell_values import Decision, Report
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.metrics import quantile, time_summary


def _numbers() -> array[float]:
    return array('d')


@dataclass
class Figures:
    """Eight numbers a box at most, so that a long run takes no more memory than a short one.

    ``goals`` counts every goal that has ended by its code. Times are of goals that ended with the
    box in its bin; ``robot_s`` is robot time of all goals, waiting for the belt included.
    """

    planning_s: array[float] = field(default_factory=_numbers)
    overhead_s: array[float] = field(default_factory=_numbers)
    arm_planning_s: array[float] = field(default_factory=_numbers)
    motion_s: array[float] = field(default_factory=_numbers)
    wait_s: array[float] = field(default_factory=_numbers)
    slack_s: array[float] = field(default_factory=_numbers)
    errors_mm: array[float] = field(default_factory=_numbers)
    goals: Counter[ErrorCode] = field(default_factory=Counter)
    asked: Asked = field(default_factory=Asked)
    robot_s: float = 0.0
    others_moved_mm: float | None = None

    def add_decision(self, one: Decision) -> None:
        """Count a decision; the overhead of the first is not ROS, the planner loads its engine."""
        if self.planning_s and one.trigger_stamp_s > 0:
            spent_s = one.stamp_s - one.trigger_stamp_s - one.planning_s - one.check_s
            self.overhead_s.append(max(0.0, spent_s))
        self.planning_s.append(one.planning_s)
        self.asked.add(one)

    def add_report(self, one: Report) -> None:
        """Count a goal that has ended."""
        self.goals[one.code] += 1
        self.robot_s += one.cycle_s + one.wait_s
        if not one.code.box_is_in_bin:
            return
        self.arm_planning_s.append(one.planning_s)
        self.motion_s.append(one.motion_s)
        self.wait_s.append(one.wait_s)
        self.slack_s.append(one.slack_s)
        self.others_moved_mm = max(self.others_moved_mm or 0.0, 1e3 * one.others_moved_m)
        if one.measured is not None:
            self.errors_mm.append(1e3 * one.position_error_m)

    @property
    def in_bin(self) -> int:
        """Goals that ended with the box in its bin."""
        return len(self.slack_s)

    def summary(self, deadline_s: float) -> dict[str, Any]:
        """As plain data; a cycle is what was spent of ``deadline_s``."""
        cycles = [deadline_s - slack_s for slack_s in self.slack_s]
        refused = sum(number for code, number in self.goals.items() if not code.box_is_in_bin)
        return {
            'cycle_time_s': time_summary(cycles),
            'planning_s': time_summary(self.planning_s),
            'arm_planning_s': time_summary(self.arm_planning_s),
            'motion_s': time_summary(self.motion_s),
            'wait_s': time_summary(self.wait_s),
            'ros_overhead_s': time_summary(self.overhead_s),
            'arm_asked': self.asked.summary(),
            'deadline_s': deadline_s,
            'deadline_misses': sum(1 for slack_s in self.slack_s if slack_s < 0),
            'refused_goals': refused,
            'goal_codes': {
                code.name: self.goals[code] for code in sorted(self.goals, key=lambda one: one.name)
            },
            'max_pose_error_mm': max(self.errors_mm, default=None),
            'p95_pose_error_mm': quantile(self.errors_mm, 0.95) if self.errors_mm else None,
            'max_others_moved_mm': self.others_moved_mm,
        }
