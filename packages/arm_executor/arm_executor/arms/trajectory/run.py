"""One motion of a robot: robot time by phase, progress, and where the controller is in it."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping

from arm_executor.model.arm_interface import MotionHooks, MotionPlan, MotionResult
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose

#: Progress is told again after so much of the whole, and never without any: a robot that stands
#: still is to be noticed by the watchdog.
_STEP = 0.002


class RobotRun:
    """Counts robot time by phase and reports progress.

    ``speed`` is robot seconds per wall-clock second, 1 but for a simulated robot.
    """

    def __init__(
        self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event, speed: float
    ) -> None:
        self.plan, self.hooks, self.stop = plan, hooks, stop
        self._speed = speed
        self._split: dict[Phase, float] = {}
        self._phase = Phase.APPROACHING
        self._since = time.monotonic()
        self._told = -1.0

    def enter(self, phase: Phase, done_s: float) -> None:
        """``phase`` begins, with ``done_s`` of the plan done."""
        self._count()
        if phase is not self._phase or self._told < 0:
            self._phase, self._told = phase, -1.0
        self.progress(done_s)

    def progress(self, done_s: float) -> None:
        """The robot has done ``done_s`` of the plan by now."""
        self._count()
        fraction = min(1.0, done_s / max(self.plan.predicted_s, 1e-3))
        if fraction > self._told + _STEP or self._told < 0:
            self._told = fraction
            self.hooks.phase(self._phase, fraction)

    def result(
        self,
        code: ErrorCode,
        message: str,
        measured: Pose | None,
        others: Mapping[str, Pose],
    ) -> MotionResult:
        """The result with this run's times; the arguments are fields of :class:`MotionResult`."""
        self._count()
        split = {phase: seconds for phase, seconds in self._split.items() if seconds > 0}
        return MotionResult(
            code, message, sum(split.values()), measured, others, 0.0, split_s=split
        )

    def _count(self) -> None:
        now = time.monotonic()
        spent = (now - self._since) * self._speed
        self._split[self._phase] = self._split.get(self._phase, 0.0) + spent
        self._since = now
