"""The services by which operators work the conveyor.

- `~/operate` (pack_msgs/Operate): pause, resume, drain, feed, empty, acknowledge, with who and why
- `~/insert_box` (pack_msgs/InsertBox): lays a box on by hand
- `~/remove_box` (pack_msgs/RemoveBox): takes a box away by hand
- `~/pause`, `~/drain` (std_srvs/SetBool): stop or resume feeding and moving, or feeding alone;
  without a name
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool

from conveyor_sim.conveyor.belt_operator import BeltOperator
from conveyor_sim.conveyor.conveyor import Conveyor
from conveyor_sim.conveyor.news import ConveyorNews
from pack_msgs.srv import InsertBox, Operate, RemoveBox
from pack_msgs_py.checks import check_name, clean_text
from pack_msgs_py.codes import Command
from pack_msgs_py.ros.conversions import box_from_ros

#: Who speaks through a service that has no field for a name.
UNNAMED = 'a service call'


class BeltServices:
    """Answers operators.

    Parameters
    ----------
    node : whose services they are.
    conveyor, operator : what is asked.
    now : steady seconds, and seconds since the epoch.
    tell : publishes news.
    operated : publishes the new state of the belt.
    """

    def __init__(
        self,
        node: Node,
        conveyor: Conveyor,
        operator: BeltOperator,
        now: Callable[[], tuple[float, float]],
        tell: Callable[[ConveyorNews], None],
        operated: Callable[[], None],
    ) -> None:
        self._conveyor = conveyor
        self._operator = operator
        self._now = now
        self._tell = tell
        self._operated = operated
        node.create_service(Operate, '~/operate', self._operate)
        node.create_service(SetBool, '~/pause', self._pause)
        node.create_service(SetBool, '~/drain', self._drain)
        node.create_service(InsertBox, '~/insert_box', self._insert)
        node.create_service(RemoveBox, '~/remove_box', self._remove)

    def _operate(self, request: Operate.Request, response: Operate.Response) -> Operate.Response:
        try:
            command = Command(request.command)
        except ValueError:
            response.message = f'command {request.command} is not known to this conveyor'
            return response
        return self._do(command, clean_text(request.who), clean_text(request.why), response)

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        command = Command.PAUSE if request.data else Command.RESUME
        return self._do(command, UNNAMED, '', response)

    def _drain(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        command = Command.DRAIN if request.data else Command.FEED
        return self._do(command, UNNAMED, '', response)

    def _do(self, command: Command, who: str, why: str, response: Any) -> Any:  # noqa: ANN401 - either service
        done, text, news = self._operator.operate(command, who, why, *self._now())
        response.success, response.message = done, text
        self._tell(news)
        self._operated()
        return response

    def _insert(
        self, request: InsertBox.Request, response: InsertBox.Response
    ) -> InsertBox.Response:
        def insert() -> ConveyorNews:
            return self._conveyor.insert_box(box_from_ros(request.box), *self._now())

        said = 'lies on the belt, or waits at the induct for its place'
        return self._by_hand('INSERT_BOX', request.box.id, said, request, response, insert)

    def _remove(
        self, request: RemoveBox.Request, response: RemoveBox.Response
    ) -> RemoveBox.Response:
        def remove() -> ConveyorNews:
            return self._conveyor.remove_box(check_name('box_id', request.box_id), *self._now())

        said = 'is off the belt'
        return self._by_hand('REMOVE_BOX', request.box_id, said, request, response, remove)

    def _by_hand(
        self,
        command: str,
        box_id: str,
        said: str,
        request: Any,  # noqa: ANN401 - either service
        response: Any,  # noqa: ANN401 - either service
        do: Callable[[], ConveyorNews],
    ) -> Any:  # noqa: ANN401 - either service
        """Do what the operator asks for and write it down; the response says why not."""
        news, done, text = ConveyorNews(), True, f'box {box_id!r} {said}'
        try:
            news = do()
        except ValueError as error:
            done, text = False, str(error)
        stamp_s = self._now()[1]
        who, why = clean_text(request.who), clean_text(request.why)
        self._operator.write(command, clean_text(box_id), who, why, done, text, stamp_s)
        response.success, response.message = done, text
        self._tell(news)
        return response
