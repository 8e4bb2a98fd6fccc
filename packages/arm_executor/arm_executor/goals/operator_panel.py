"""What stands in the way of the arm: a pause, and alarms that nobody has acknowledged.

Both outlive the process: they are in the journal before anybody hears of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from arm_executor.bins.operation_log import OperationLog
from arm_executor.goals.outputs import AlarmsChanged, Output, Said
from pack_msgs_py.alarms import Alarm, raised, with_new
from pack_msgs_py.cell_values import Report
from pack_msgs_py.codes import Command, Severity
from pack_msgs_py.operations import SOMEBODY, Operation


class OperatorPanel:
    """May be read from any thread.

    Parameters
    ----------
    log : where it is kept.
    emit : takes what there is to tell.
    now : wall clock, seconds since the epoch.
    acknowledges_itself : nobody stands by: an alarm is shown like a warning, and the cell goes on.
    """

    def __init__(
        self,
        log: OperationLog,
        emit: Callable[[Output], None],
        now: Callable[[], float],
        *,
        acknowledges_itself: bool = False,
    ) -> None:
        self._log = log
        self._emit = emit
        self._now = now
        self._acknowledges_itself = acknowledges_itself
        self._pause = log.pause()
        self.standing = () if acknowledges_itself else log.standing()
        self._elsewhere: dict[str, tuple[Alarm, ...]] = {}

    @property
    def paused(self) -> str:
        """By whom the arm was paused, since when and why; empty when it is not."""
        return '' if self._pause is None else self._pause.says('PAUSED')

    @property
    def alarm(self) -> str:
        """The first alarm for which the arm must not move, and what to do; empty for none."""
        for node, alarms in (('', self.standing), *self._elsewhere.items()):
            for alarm in alarms:
                if alarm.blocks:
                    where = f'{node.lstrip("/")}: ' if node else ''
                    return f'{where}{alarm.code}: {alarm.message}. {alarm.action}'
        return ''

    def request(
        self, command: str, subject: str, who: str, why: str, answer: tuple[bool, str]
    ) -> tuple[bool, str]:
        """Write down what was asked for and what came of it; returns that."""
        done, text = answer
        operation = Operation(self._now(), command, subject, who or SOMEBODY, why, done, text)
        self._log.write(operation)
        if done and command == Command.PAUSE.name:
            self._pause = operation
        elif done and command == Command.RESUME.name:
            self._pause = None
        level = '' if done else 'refused: '
        self._emit(Said('info', f'{command} {subject} by {operation.who}: {level}{text}'))
        return done, text

    def report(self, report: Report) -> None:
        """A goal has ended: maybe with something that a person must know of."""
        alarm = raised(
            report.code.name,
            report.message,
            self._now(),
            box_id=report.box_id,
            bin_id=report.bin_id,
        )
        if alarm is not None:
            self.raise_alarm(alarm)

    def raise_alarm(self, alarm: Alarm) -> None:
        """Something that a person must know of."""
        if alarm.blocks and self._acknowledges_itself:
            alarm = replace(
                alarm, severity=Severity.WARNING, action='None: alarms acknowledge themselves here'
            )
        self._log.raise_alarm(alarm)
        self.standing = with_new(self.standing, alarm)
        if alarm.blocks:
            text = f'ALARM {alarm.code}: {alarm.message}. {alarm.action}'
            self._emit(Said('error', text))
        self._emit(AlarmsChanged(self.standing))

    def acknowledge(self, who: str = SOMEBODY, why: str = '') -> tuple[bool, str]:
        """A person has looked: nothing stands any more."""
        if not self.standing:
            return False, 'no alarm and no warning stands in the arm executor'
        over = ', '.join(dict.fromkeys(alarm.code for alarm in self.standing))
        self._log.acknowledge(self._now(), who, why)
        self.standing = ()
        self._emit(AlarmsChanged(()))
        return True, f'acknowledged: {over}'

    def hear(self, node: str, alarms: tuple[Alarm, ...]) -> None:
        """What stands in another node: the arm does not move for its alarms either."""
        if alarms:
            self._elsewhere[node] = alarms
        else:
            self._elsewhere.pop(node, None)

    def forget_gone(self, names: Callable[[], Collection[str]]) -> None:
        """Forget what stood in nodes that are none of ``names`` any more, or never were.

        Nobody could ever say that it is over.
        """
        if self._elsewhere:
            there = names()
            for node in [node for node in self._elsewhere if node not in there]:
                codes = ', '.join(alarm.code for alarm in self._elsewhere.pop(node))
                self._emit(Said('warning', f'{codes} of {node} is left: there is no such node'))
