"""One execution of a motion: its hooks, its stop event and its clock."""

from __future__ import annotations

import threading
from collections.abc import Mapping

from arm_executor.arms.physics.world import STEP_S
from arm_executor.model.arm_interface import MotionHooks, MotionPlan, MotionResult
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose

#: Progress is reported this often, in steps of physics.
_REPORT_EVERY = 24


class Interrupted(Exception):
    """The motion ended early; the arm is at rest. ``code`` is what the goal ends with."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code


class MotionRun:
    """Counts robot time by phase and reports progress."""

    def __init__(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> None:
        self.plan, self.hooks, self.stop = plan, hooks, stop
        self._steps: dict[Phase, int] = {}
        self._phase = Phase.APPROACHING
        self._motion_steps: int | None = None

    def enter(self, phase: Phase) -> None:
        """``phase`` begins."""
        self._phase = phase
        self._steps.setdefault(phase, 0)
        self.hooks.phase(phase, self._fraction())

    def tick(self, steps: int = 1) -> None:
        """That many steps of physics passed."""
        before = self._total()
        self._steps[self._phase] = self._steps.get(self._phase, 0) + steps
        if before // _REPORT_EVERY != self._total() // _REPORT_EVERY:
            self.hooks.phase(self._phase, self._fraction())

    def finish(self) -> None:
        """The motion is over; what follows is waiting for boxes to settle."""
        if self._motion_steps is None:
            self._motion_steps = self._total()

    def result(
        self,
        code: ErrorCode,
        message: str,
        measured: Pose | None,
        others: Mapping[str, Pose],
        moved_m: float,
    ) -> MotionResult:
        """The result with this run's times; the arguments are fields of :class:`MotionResult`."""
        steps = self._total() if self._motion_steps is None else self._motion_steps
        split = {phase: count * STEP_S for phase, count in self._steps.items()}
        return MotionResult(code, message, steps * STEP_S, measured, others, moved_m, split)

    def _total(self) -> int:
        return sum(self._steps.values())

    def _fraction(self) -> float:
        return min(1.0, self._total() * STEP_S / max(self.plan.predicted_s, STEP_S))
