"""In which mode the executor is, and why."""

from __future__ import annotations

from dataclasses import dataclass

from arm_executor.goals.operator_panel import OperatorPanel
from arm_executor.goals.outputs import Status
from arm_executor.goals.placing import Tools
from arm_executor.model.arm_interface import WatchedArm
from pack_msgs_py.cell_values import Report
from pack_msgs_py.codes import ErrorCode, Mode

#: What a node says that has no arm yet.
STARTING = 'starting'


def trouble_of(tools: Tools | None) -> str:
    """Why the robot cannot move, for an arm that can tell; empty when it can, or is not there."""
    arm = None if tools is None else tools.arm
    return arm.trouble() if isinstance(arm, WatchedArm) else ''


@dataclass
class ExecutorCondition:
    """What stands in the way of goals; each text says why, an empty one that it does not.

    Attributes
    ----------
    fault : what should not happen has happened: until the node is started again.
    protective_stop : the arm stands, with what it holds, until it is reset.
    stop_wanted : it is to stand so as soon as its motion has stopped.
    inactive : the node is not active.
    ready : whether the arm is there.
    last_fault : the last thing that went wrong, whatever came of it.
    """

    fault: str = ''
    protective_stop: str = ''
    stop_wanted: str = ''
    inactive: str = ''
    ready: bool = False
    last_fault: str = ''

    @property
    def stops(self) -> bool:
        """Whether the arm stands for a person, or is about to."""
        return bool(self.protective_stop or self.stop_wanted or self.fault)

    def ended(self, report: Report, *, needs_reset: bool) -> None:
        """A goal has ended so; ``needs_reset``: with the arm standing where it is."""
        if report.code not in (ErrorCode.NONE, ErrorCode.CANCELED):
            self.last_fault = f'{report.code.name}: {report.message}'
        if needs_reset or self.stop_wanted:
            self.protective_stop = self.stop_wanted or report.message or 'protective stop'

    def failed(self, error: Exception) -> None:
        """What should not happen has."""
        self.fault = self.last_fault = f'{type(error).__name__}: {error}; restart the node'

    def status(self, box: str, remaining_s: float, in_doubt: str, panel: OperatorPanel) -> Status:
        """What is done.

        Parameters
        ----------
        box : the one that is being placed, for ``remaining_s`` more; empty for none.
        in_doubt : the one whose end is not written yet, which a stopped arm may hold.
        panel : pauses and alarms.
        """
        if self.fault:
            return Status(Mode.FAULT, box, 0.0, self.fault)
        if self.protective_stop:
            return Status(Mode.PROTECTIVE_STOP, in_doubt, 0.0, self.protective_stop)
        if not self.ready:
            return Status(Mode.INACTIVE, '', 0.0, STARTING)
        if box:
            return Status(Mode.EXECUTING, box, remaining_s, '')
        if panel.alarm:
            return Status(Mode.ALARM, '', 0.0, panel.alarm)
        if panel.paused:
            return Status(Mode.PAUSED, '', 0.0, panel.paused)
        if self.inactive:
            return Status(Mode.INACTIVE, '', 0.0, self.inactive)
        return Status(Mode.IDLE, '', 0.0, '')
