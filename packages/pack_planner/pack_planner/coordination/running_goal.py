"""The goal that the executor is working on, as far as the planner has heard, and past ones."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.cell_values import Decision, Report
from pack_msgs_py.codes import ErrorCode, Mode, PlacementStatus, Reason
from pack_msgs_py.values import Bin, Box
from pack_planner.coordination.inputs import Heartbeat

ACCEPT_TIMEOUT_S = 2.0
REPORT_TIMEOUT_S = 2.0
RESULT_TIMEOUT_S = 1.0
#: An executor that says it is idle for so long is not working on our goal.
FORGOTTEN_S = 3.0

_NO_GOAL_ID = bytes(16)


#: After so many motions with it that failed, a box goes to the reject lane.
MOTIONS_TRIED = 3
#: The same for one that is not what was scanned: a second scan comes first.
SCANS_TRIED = 2
_TRIES = {
    ErrorCode.BOX_MISMATCH: SCANS_TRIED,
    ErrorCode.GRASP_FAILED: MOTIONS_TRIED,
    ErrorCode.PATH_TOLERANCE_VIOLATED: MOTIONS_TRIED,
    ErrorCode.COLLISION: MOTIONS_TRIED,
    ErrorCode.MOTION_OVERDUE: MOTIONS_TRIED,
}


class Failures:
    """Motions that failed, by box: what fails time and again blocks the belt."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._rejects: dict[str, tuple[Reason, str]] = {}

    def add(self, box_id: str, code: ErrorCode, message: str) -> None:
        """A goal for this box ended with ``code``."""
        tries = _TRIES.get(code)
        if tries is None:
            return
        count = self._counts[box_id] = self._counts.get(box_id, 0) + 1
        if count < tries:
            return
        if code is ErrorCode.BOX_MISMATCH:
            self._rejects[box_id] = (Reason.INVALID_DATA, message)
        else:
            text = f'{count} motions with box {box_id!r} failed, at last: {message}'
            self._rejects[box_id] = (Reason.FAULT, text)

    def reject(self, box: Box) -> Decision | None:
        """The decision to reject ``box``, when that is all that is left."""
        if box.id not in self._rejects:
            return None
        reason, text = self._rejects[box.id]
        return Decision(box, status=PlacementStatus.REJECT, reject_reason=reason, reason=text)


@dataclass
class RunningGoal:
    """One goal from sending to its end; times are seconds of the steady clock."""

    decision: Decision
    target: Bin
    goal_id: bytes
    sent_s: float
    accepted: bool | None = None
    answered_s: float = 0.0
    picked: bool = False
    report: Report | None = None
    reported_s: float = 0.0
    has_result: bool = False
    idle_since_s: float | None = None

    def matches(self, report: Report) -> bool:
        """Whether ``report`` is about this goal.

        A goal that is refused before it has an id is reported without one.
        """
        if report.goal_id != _NO_GOAL_ID:
            return report.goal_id == self.goal_id
        return (report.box_id, report.bin_id, report.bin_revision) == (
            self.decision.box.id,
            self.decision.bin_id,
            self.decision.bin_revision,
        )

    def hear(self, heartbeat: Heartbeat, now_s: float) -> None:
        """Note since when the executor has been idle although it has this goal."""
        if heartbeat.mode is not Mode.IDLE:
            self.idle_since_s = None
        elif self.idle_since_s is None:
            self.idle_since_s = now_s

    def end(self, now_s: float) -> tuple[ErrorCode, str] | None:
        """How the goal ended, ``None`` while it may still be running.

        A report and the action's answer belong together; when one of them stays away, the goal is
        over after a time-out all the same.
        """
        if self.report is not None and (
            self.accepted is False or self.has_result or now_s - self.reported_s > RESULT_TIMEOUT_S
        ):
            return self.report.code, self.report.message
        if self.accepted is None and now_s - self.sent_s > ACCEPT_TIMEOUT_S:
            return ErrorCode.UNKNOWN, f'no answer to the goal within {ACCEPT_TIMEOUT_S:g} s'
        if self.accepted is False and now_s - self.answered_s > REPORT_TIMEOUT_S:
            return ErrorCode.UNKNOWN, 'refused, and no report said why'
        idle = self.idle_since_s
        if self.report is None and idle is not None and now_s - idle > FORGOTTEN_S:
            return ErrorCode.UNKNOWN, f'the executor was idle for {FORGOTTEN_S:g} s'
        return None
