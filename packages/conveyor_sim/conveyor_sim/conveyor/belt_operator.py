"""What an operator does with the belt, and what a person must know of it.

A jam is an alarm: the belt stands until it is over and somebody has acknowledged it. Who has paused
or drained the belt, and alarms that stand, are in the ledger, and so outlive the process.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace

from conveyor_sim.conveyor.conveyor import Conveyor
from conveyor_sim.conveyor.news import ConveyorNews
from conveyor_sim.ledger.ledger import Ledger
from pack_msgs_py.alarms import TROUBLES, Alarm, with_new
from pack_msgs_py.codes import Command, Severity
from pack_msgs_py.operations import SOMEBODY, Operation
from pack_msgs_py.wording import how_many

#: What is said of a belt in a state that an operator has brought it into, by the command.
_STATES = {Command.PAUSE: 'PAUSED', Command.DRAIN: 'DRAINED'}
_ENDS = {Command.RESUME: Command.PAUSE, Command.FEED: Command.DRAIN}


class BeltOperator:
    """Between operators and the conveyor; the caller publishes the news that it returns.

    Parameters
    ----------
    conveyor : whose belt it is, started.
    ledger : where everything is written down.
    acknowledges_itself : nobody stands by: a jam is shown, and over when it is over.
    """

    def __init__(
        self, conveyor: Conveyor, ledger: Ledger, *, acknowledges_itself: bool = False
    ) -> None:
        self._conveyor = conveyor
        self._ledger = ledger
        self._acknowledges_itself = acknowledges_itself
        self._reasons: dict[Command, Operation] = {
            command: Operation(**json.loads(text))
            for command in _STATES
            if (text := ledger.setting(f'by {command.name}'))
        }
        self.standing = () if acknowledges_itself else ledger.standing()
        #: Its number in the ledger while it lasts, acknowledged or not.
        self._jam = ledger.alarm_not_ended('JAM')

    @property
    def said(self) -> str:
        """Who has brought the belt into its state, since when and why; empty when nobody has."""
        condition = self._conveyor.condition
        command = {'paused': Command.PAUSE, 'draining': Command.DRAIN}.get(condition)
        reason = None if command is None else self._reasons.get(command)
        return '' if command is None or reason is None else reason.says(_STATES[command])

    def operate(
        self, command: Command, who: str, why: str, now_s: float, stamp_s: float
    ) -> tuple[bool, str, ConveyorNews]:
        """Do what is asked for: whether it was done, a sentence, and what is to be told."""
        operation = Operation(stamp_s, command.name, '', who or SOMEBODY, why)
        news = ConveyorNews()
        try:
            text, news = self._do(command, operation, now_s, stamp_s)
        except ValueError as error:
            operation = replace(operation, done=False, answer=str(error))
        else:
            operation = replace(operation, answer=text)
        self._ledger.write_operation(operation)
        return operation.done, operation.answer, news

    def write(
        self,
        command: str,
        box_id: str,
        who: str,
        why: str,
        done: bool,
        answer: str,
        stamp_s: float,
    ) -> None:
        """Write down what was asked for about a box."""
        operation = Operation(stamp_s, command, box_id, who or SOMEBODY, why, done, answer)
        self._ledger.write_operation(operation)

    def _do(
        self, command: Command, operation: Operation, now_s: float, stamp_s: float
    ) -> tuple[str, ConveyorNews]:
        conveyor = self._conveyor
        match command:
            case Command.PAUSE | Command.RESUME:
                self._check_changes(command, conveyor.paused)
                news = conveyor.pause(command is Command.PAUSE, now_s, stamp_s)
                text = 'the belt stands' if command is Command.PAUSE else 'the belt goes on'
            case Command.DRAIN | Command.FEED:
                self._check_changes(command, conveyor.draining)
                news = conveyor.drain(command is Command.DRAIN, now_s, stamp_s)
                are = 'is' if conveyor.on_belt == 1 else 'are'
                text = f'no more boxes are fed; {conveyor.on_belt} on the belt {are} still packed'
                if command is Command.FEED:
                    text = 'boxes are fed again'
            case Command.EMPTY:
                news, gone = conveyor.empty(f'belt emptied by {operation.who}', now_s, stamp_s)
                self._remember(Command.DRAIN, operation)
                kept = f'; box {conveyor.handled!r} is with the arm' if conveyor.handled else ''
                boxes = how_many(gone, 'box')
                return f'{boxes} went to the reject lane, no more are fed{kept}', news
            case Command.ACKNOWLEDGE:
                return self._acknowledge(operation, now_s)
            case _:
                msg = f'{command.name} is for the arm executor, not for the conveyor'
                raise ValueError(msg)
        if command in _ENDS:
            self._forget(_ENDS[command])
        else:
            self._remember(command, operation)
        return text, news

    def _check_changes(self, command: Command, on: bool) -> None:
        """``ValueError`` when the belt is as it is asked to be already."""
        if command in _STATES and on:
            reason = self._reasons.get(command)
            state = _STATES[command] if reason is None else reason.says(_STATES[command])
            back = {Command.PAUSE: 'cell resume', Command.DRAIN: 'cell feed'}[command]
            msg = f'the belt is {state}; to go on: {back}'
            raise ValueError(msg)
        if command in _ENDS and not on:
            msg = f'the belt is not {_STATES[_ENDS[command]].lower()}'
            raise ValueError(msg)

    def _remember(self, command: Command, operation: Operation) -> None:
        self._reasons[command] = operation
        self._ledger.set_setting(f'by {command.name}', json.dumps(asdict(operation)))

    def _forget(self, command: Command) -> None:
        self._reasons.pop(command, None)
        self._ledger.set_setting(f'by {command.name}', '')

    # -- jams -----------------------------------------------------------------------------------

    def look(self, now_s: float, stamp_s: float) -> tuple[Alarm, ...] | None:
        """After every step of the conveyor: all that stands, when that has changed."""
        jammed = self._conveyor.jammed
        if jammed and self._jam is None:
            trouble = TROUBLES['JAM']
            message = 'the belt has jammed and stands'
            alarm = Alarm('JAM', message, trouble.severity, trouble.action, raised_s=stamp_s)
            if self._acknowledges_itself:
                action = 'None: the belt goes on once the jam is over'
                alarm = replace(alarm, severity=Severity.WARNING, action=action)
            else:
                self._conveyor.keep_standing(True, now_s)
            self._jam = self._ledger.raise_alarm(alarm)
            self.standing = with_new(self.standing, alarm)
            return self.standing
        if self._jam is not None and not jammed:
            self._ledger.end_alarm(self._jam, stamp_s)
            self._jam = None
            if self._acknowledges_itself:
                self.standing = ()
                return self.standing
        return None

    def take_up(self, now_s: float) -> None:
        """After a restart: an alarm that stands keeps the belt standing."""
        if any(alarm.blocks for alarm in self.standing):
            self._conveyor.keep_standing(True, now_s)

    def _acknowledge(self, operation: Operation, now_s: float) -> tuple[str, ConveyorNews]:
        if not self.standing:
            msg = 'no alarm and no warning stands in the conveyor'
            raise ValueError(msg)
        over = ', '.join(alarm.code for alarm in self.standing)
        self._ledger.acknowledge(operation.stamp_s, operation.who, operation.why)
        self.standing = ()
        news = self._conveyor.keep_standing(False, now_s, operation.stamp_s)
        still = '; the belt goes on once the jam is over' if self._conveyor.jammed else ''
        return f'acknowledged: {over}{still}', news
