"""The services by which operators work the node: with who and why, or plain for a tool at hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from arm_executor.bins.book import BookError
from arm_executor.bins.journal import JournalError
from arm_executor.goals.bin_work import BinWork
from arm_executor.goals.core import ExecutorCore
from pack_msgs.srv import InsertPlacedBox, Operate, RemoveBox
from pack_msgs_py.checks import clean_text
from pack_msgs_py.codes import Command, Mode
from pack_msgs_py.operations import SOMEBODY, Operation
from pack_msgs_py.ros import conversions

#: Who speaks through a service that has no field for a name.
UNNAMED = 'a service call'
#: Modes in which the arm stands, though nobody has it paused.
_STAND_LONGER = (Mode.ALARM, Mode.PROTECTIVE_STOP, Mode.FAULT)

Answer = tuple[bool, str]


class OperatorServices:
    """Answers operators for the core.

    Parameters
    ----------
    node : whose services they are.
    core, bins : what is asked.
    drain : sends at once what the core has said.
    operated : tells at once in which mode the core is.
    """

    def __init__(
        self,
        node: Node,
        core: ExecutorCore,
        bins: BinWork,
        drain: Callable[[], None],
        operated: Callable[[], None],
    ) -> None:
        self._core = core
        self._bins = bins
        self._drain = drain
        self._operated = operated
        self._log = node.get_logger()
        self._now = node.get_clock().now
        node.create_service(SetBool, '~/pause', self._pause)
        node.create_service(Trigger, '~/stop', self._stop)
        node.create_service(InsertPlacedBox, '~/insert_box', self._insert)
        node.create_service(RemoveBox, '~/remove_box', self._remove)
        # These wait for the arm; in the node's own group they would hold up the heartbeat.
        waiting = ReentrantCallbackGroup()
        node.create_service(Operate, '~/operate', self._operate, callback_group=waiting)
        node.create_service(Trigger, '~/reset', self._reset, callback_group=waiting)

    async def _operate(
        self, request: Operate.Request, response: Operate.Response
    ) -> Operate.Response:
        try:
            command = Command(request.command)
        except ValueError:
            response.message = f'command {request.command} is not known to this arm executor'
            return response
        bin_id, who = clean_text(request.bin_id), clean_text(request.who)
        if command is Command.RESET:
            answer = await self._reset_answer()
        else:
            answer = self._do(command, bin_id, who, clean_text(request.why))
        return self._told(command.name, bin_id, request, response, answer)

    def _do(self, command: Command, bin_id: str, who: str, why: str = '') -> Answer:
        """Every command but the one that waits for the arm."""
        panel, bins = self._core.panel, self._bins
        match command:
            case Command.PAUSE:
                return self._pause_answer()
            case Command.RESUME if panel.paused:
                return True, self._resume_text()
            case Command.RESUME:
                return False, f'the arm is not paused: {self._mode_text()}'
            case Command.STOP:
                now_s = self._now().nanoseconds * 1e-9
                operation = Operation(now_s, command.name, '', who or SOMEBODY, why)
                self._core.protective_stop(operation.says('stopped'))
                return True, 'the arm stops and keeps what it holds; to go on: cell reset'
            case Command.ACKNOWLEDGE:
                return self._tried(lambda: panel.acknowledge(who or SOMEBODY, why))
        texts: dict[Command, Callable[[], str]] = {
            Command.SWAP_BIN: lambda: bins.swap(bin_id),
            Command.CLOSE_BIN: lambda: bins.close(bin_id),
            Command.HOLD_BIN: lambda: bins.hold(bin_id, held=True),
            Command.RELEASE_BIN: lambda: bins.hold(bin_id, held=False),
            Command.CLOSE_ALL: bins.close_all,
        }
        if command not in texts:
            return False, f'{command.name} is for the conveyor, not for the arm executor'
        return self._tried(lambda: (True, texts[command]()))

    def _pause_answer(self) -> Answer:
        status = self._core.status()
        if self._core.panel.paused:
            return False, f'the arm is {self._core.panel.paused}; to go on: cell resume'
        if status.mode is Mode.EXECUTING:
            return True, f'the arm pauses once box {status.active_box!r} is in its bin'
        return True, 'the arm is paused'

    def _resume_text(self) -> str:
        """A pause is over, and what else keeps the arm from moving."""
        status = self._core.status()
        if status.mode in _STAND_LONGER:
            return f'the arm is paused no longer, and still stands: {status.message.rstrip(".")}'
        return 'the arm goes on'

    def _mode_text(self) -> str:
        status = self._core.status()
        return f'its mode is {status.mode.name}' + (f', {status.message}' if status.message else '')

    async def _reset_answer(self) -> Answer:
        future = Future()
        self._core.reset(future)
        success, text = await future
        return success, text

    @staticmethod
    def _tried(do: Callable[[], Answer]) -> Answer:
        try:
            return do()
        except (BookError, JournalError) as error:
            return False, str(error)

    def _told(self, command: str, subject: str, request: Any, response: Any, answer: Answer) -> Any:  # noqa: ANN401 - of any service
        """Write it down, then answer."""
        who = clean_text(getattr(request, 'who', UNNAMED))
        why = clean_text(getattr(request, 'why', ''))
        subject = clean_text(subject)
        try:
            answer = self._core.panel.request(command, subject, who, why, answer)
        except JournalError as error:
            self._log.error(f'{command} is not written down: {error}')
            answer = (False, str(error))
        response.success, response.message = answer
        self._drain()
        self._operated()
        return response

    def _insert(
        self, request: InsertPlacedBox.Request, response: InsertPlacedBox.Response
    ) -> InsertPlacedBox.Response:
        try:
            placed = conversions.placed_box_from_ros(request.placed)
        except ValueError as error:
            answer = (False, str(error))
        else:
            bin_id = clean_text(request.bin_id)
            answer = self._tried(lambda: (True, self._bins.insert(bin_id, placed)))
        return self._told('INSERT_BOX', request.placed.box.id, request, response, answer)

    def _remove(
        self, request: RemoveBox.Request, response: RemoveBox.Response
    ) -> RemoveBox.Response:
        box_id = clean_text(request.box_id)
        answer = self._tried(lambda: (True, self._bins.remove(box_id)))
        return self._told('REMOVE_BOX', request.box_id, request, response, answer)

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        command = Command.PAUSE if request.data else Command.RESUME
        answer = self._do(command, '', UNNAMED)
        return self._told(command.name, '', request, response, answer)

    def _stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        answer = self._do(Command.STOP, '', UNNAMED)
        return self._told('STOP', '', request, response, answer)

    async def _reset(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        answer = await self._reset_answer()
        return self._told('RESET', '', request, response, answer)
