"""Talks to a running cell: finds it, asks its nodes, listens to its state."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from types import TracebackType
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from pack_cell.ros.cell_monitor import CellListener
from pack_cell.watching.cell_watch import ARM_EXECUTOR, CONVEYOR, CellWatch
from pack_cell.watching.finding import NoCell, namespace_of_cell
from pack_msgs.msg import BinStateArray
from pack_msgs.msg import CellState as CellStateMsg
from pack_msgs.srv import InsertBox, InsertPlacedBox, Operate, RemoveBox, ResolveBox
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.codes import Command
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.parameter_service import check_parameters_of_nodes
from pack_msgs_py.values import Box, PlacedBox

_OPERATE_TYPE = 'pack_msgs/srv/Operate'
_SPIN_S = 0.05
#: How long other namespaces may take to show up once one was found.
_MORE_S = 0.3
#: What a monitor has said counts for so long; it speaks each second.
_FRESH_S = 5.0

#: Whether it was done, and a sentence.
Answer = tuple[bool, str]


class CellClient:
    """A cell in one ROS domain, for a ``with`` block.

    Parameters
    ----------
    domain : the ROS domain to look in.
    namespace : of the cell; ``None`` for the only one there.
    timeout_s : longest wait for the cell, and for each answer, seconds.
    who, why : written into the journals with every request.

    Raises
    ------
    NoCell
        No cell is found in time, or more than one; a node does not answer in time.
    """

    def __init__(
        self, domain: int, namespace: str | None, timeout_s: float, who: str = '', why: str = ''
    ) -> None:
        self.domain = domain
        self._asked = namespace
        self._timeout_s = timeout_s
        self._who, self._why = who, why
        self._context = rclpy.Context()
        self._closing = ExitStack()

    def __enter__(self) -> CellClient:
        check_parameters_of_nodes()
        rclpy.init(
            context=self._context,
            domain_id=self.domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._closing.callback(rclpy.try_shutdown, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._closing.callback(self._executor.shutdown)
        try:
            self.namespace = self._find()
            self._node = rclpy.create_node(
                'operator', namespace=self.namespace, context=self._context
            )
            # Else the logger of the next client of this process speaks by the node of this one.
            self._closing.callback(self._node.destroy_node)
            self._executor.add_node(self._node)
            self.watch = CellListener(self._node).watch
        except BaseException:
            self._closing.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._closing.close()

    def _find(self) -> str:
        """The namespace of the cell.

        Of a node that hangs nothing is found: the arm's or the belt's will do.
        """
        finder = rclpy.create_node('operator_finder', context=self._context)
        try:
            until_s = time.monotonic() + self._timeout_s
            seen: set[str] = set()
            while time.monotonic() < until_s:
                fresh = {
                    name.removesuffix(f'/{node}/operate') or '/'
                    for name, types in finder.get_service_names_and_types()
                    for node in (ARM_EXECUTOR, CONVEYOR)
                    if name.endswith(f'/{node}/operate') and _OPERATE_TYPE in types
                }
                if fresh and not seen:
                    until_s = min(until_s, time.monotonic() + _MORE_S)
                seen |= fresh
                if self._asked is not None and '/' + self._asked.strip('/') in seen:
                    break
                time.sleep(_SPIN_S)
            return namespace_of_cell(self._asked, seen, self.domain)
        finally:
            finder.destroy_node()

    # -- listening ------------------------------------------------------------------------------

    def wait_until(self, met: Callable[[CellWatch], bool], seconds: float | None = None) -> bool:
        """Listen until ``met``; whether it was in time."""
        until_s = time.monotonic() + (self._timeout_s if seconds is None else seconds)
        while not met(self.watch):
            if time.monotonic() > until_s:
                return False
            self._executor.spin_once(timeout_sec=_SPIN_S)
        return True

    def state(self, seconds: float) -> CellState:
        """The state of the cell, after listening for up to ``seconds``.

        When a node is not heard in that time, the word of the monitor counts, which has listened
        for longer: it knows a node that hangs from one that still starts.
        """
        heard: list[CellState] = []

        def take(msg: CellStateMsg) -> None:
            with suppress(ValueError):
                heard.append(conversions.cell_state_from_ros(msg))

        subscription = self._node.create_subscription(
            CellStateMsg, 'cell_state', take, qos.TOPICS['cell_state']
        )
        self.wait_until(lambda watch: watch.complete, seconds)
        self._node.destroy_subscription(subscription)
        fresh = [state for state in heard if abs(time.time() - state.stamp_s) < _FRESH_S]
        return fresh[-1] if fresh and not self.watch.complete else self.watch.state()

    def boxes_in_bins(self) -> set[str]:
        """Ids of the boxes in the bins that stand in the cell."""
        heard: list[BinStateArray] = []
        subscription = self._node.create_subscription(
            BinStateArray, 'bin_state', heard.append, qos.TOPICS['bin_state']
        )
        self.wait_until(lambda _: bool(heard))
        self._node.destroy_subscription(subscription)
        states = heard[-1].bins if heard else ()
        return {placed.box.id for state in states for placed in state.boxes}

    # -- asking ---------------------------------------------------------------------------------

    def arm(self, command: Command, bin_id: str = '') -> Answer:
        """Ask the arm executor."""
        return self._operate(ARM_EXECUTOR, command, bin_id)

    def belt(self, command: Command) -> Answer:
        """Ask the conveyor."""
        return self._operate(CONVEYOR, command, '')

    def _operate(self, node: str, command: Command, bin_id: str) -> Answer:
        request = Operate.Request(command=int(command), bin_id=bin_id, who=self._who, why=self._why)
        return self._call(Operate, f'{node}/operate', request)

    def remove_from(self, node: str, box_id: str) -> Answer:
        """A box was taken away by hand: from the belt, or from a bin of the arm executor."""
        request = RemoveBox.Request(box_id=box_id, who=self._who, why=self._why)
        return self._call(RemoveBox, f'{node}/remove_box', request)

    def resolve(self, box_id: str, *, placed: bool) -> Answer:
        """A person has looked for a box in doubt: it is in its bin, or was taken away."""
        request = ResolveBox.Request(
            box_id=box_id, placed=placed, who=self._who, why=self._why or 'no reason given'
        )
        return self._call(ResolveBox, f'{ARM_EXECUTOR}/resolve_box', request)

    def insert_on_belt(self, box: Box) -> Answer:
        """A box is laid on the belt by hand."""
        request = InsertBox.Request(box=conversions.box_to_ros(box), who=self._who, why=self._why)
        return self._call(InsertBox, f'{CONVEYOR}/insert_box', request)

    def insert_in_bin(self, bin_id: str, placed: PlacedBox) -> Answer:
        """A box was put into a bin by hand."""
        x, y, z = (
            (corner + edge / 2) / 1000
            for corner, edge in zip(placed.corner_mm, placed.size_mm, strict=True)
        )
        message = conversions.placed_box_to_ros(placed, Pose((x, y, z)))
        request = InsertPlacedBox.Request(
            bin_id=bin_id, placed=message, who=self._who, why=self._why
        )
        return self._call(InsertPlacedBox, f'{ARM_EXECUTOR}/insert_box', request)

    def _call(self, kind: type, name: str, request: Any) -> Answer:  # noqa: ANN401 - any service
        client = self._node.create_client(kind, name)
        try:
            if not client.wait_for_service(self._timeout_s):
                msg = (
                    f'{name} of the cell in {self.namespace} is not there: its node is down, '
                    'starts, or hangs: look with cell status'
                )
                raise NoCell(msg)
            future = client.call_async(request)
            until_s = time.monotonic() + self._timeout_s
            while not future.done():
                if time.monotonic() > until_s:
                    msg = (
                        f'{name} gave no answer within {self._timeout_s:g} s; what was asked for '
                        'may still be done: look with cell status'
                    )
                    raise NoCell(msg)
                self._executor.spin_once(timeout_sec=_SPIN_S)
            answer = future.result()
            return bool(answer.success), str(answer.message)
        finally:
            self._node.destroy_client(client)
