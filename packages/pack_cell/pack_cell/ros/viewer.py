"""Node `viewer`: listens to the cell for the live page, and passes on what its buttons ask for.

It only listens and calls services: the cell does not notice whether it is there.

Subscribes
    box_scan, bin_state, bin_closed, bin_closing, placements, placement_report, box_event,
    executor_state, alarms, joint_states, robot_description, /diagnostics
Parameters
    host, port: where the page is served; port 0 takes any free one
Calls
    arm_executor/operate, conveyor/operate, arm_executor/get_parameters
"""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from arm_executor.model.robot_shapes import read_urdf
from pack_cell.options.page_address import DEFAULT_PORT, LOOPBACK
from pack_cell.ros.cell_monitor import CellListener
from pack_cell.ros.resting_executor import RestingExecutor
from pack_cell.view.cell_view import CellView
from pack_cell.view.page import CellPage, Order, PageAddress
from pack_cell.view.web_server import PageTaken
from pack_cell.watching.cell_watch import ARM_EXECUTOR, CONVEYOR, STANDS
from pack_msgs.msg import (
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs.srv import Operate
from pack_msgs_py.codes import Command
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.conversions import bins_from_ros, scan_from_ros
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import Sources

#: Who asks, for the journals of the nodes: nobody logs in at the page.
WHO = 'somebody at the live page'
#: Buttons that come to one command of one node.
_ORDERS = {
    Order.PAUSE: (ARM_EXECUTOR, Command.PAUSE),
    Order.STOP: (ARM_EXECUTOR, Command.STOP),
    Order.RESET: (ARM_EXECUTOR, Command.RESET),
    Order.SWAP_BIN: (ARM_EXECUTOR, Command.SWAP_BIN),
    Order.CLOSE_BIN: (ARM_EXECUTOR, Command.CLOSE_BIN),
    Order.HOLD_BIN: (ARM_EXECUTOR, Command.HOLD_BIN),
    Order.RELEASE_BIN: (ARM_EXECUTOR, Command.RELEASE_BIN),
    Order.DRAIN: (CONVEYOR, Command.DRAIN),
    Order.FEED: (CONVEYOR, Command.FEED),
    Order.EMPTY: (CONVEYOR, Command.EMPTY),
}
#: Those of them that are about one bin.
_OF_A_BIN = (Order.SWAP_BIN, Order.CLOSE_BIN, Order.HOLD_BIN, Order.RELEASE_BIN)
#: So long the arm may take to end its box when a shift is finished, seconds.
FINISH_S = 60.0
SCENE_PERIOD_S, TEXT_PERIOD_S = 0.05, 0.3
#: The page gives way to what moves the cell.
NICENESS = 5


class Viewer(Node):
    """See the module; ``address`` is where the page is served, by default as parameters say.

    ``looked_at`` is set while somebody may look.
    """

    def __init__(self, address: PageAddress | None = None, **node_arguments: Any) -> None:  # noqa: ANN401
        super().__init__('viewer', **node_arguments)
        if address is None:
            host = self.declare_parameter('host', LOOPBACK).value
            address = PageAddress(host, self.declare_parameter('port', DEFAULT_PORT).value)
        listener = CellListener(self, scans=False)
        self.view = CellView(listener.watch, int(os.environ.get('ROS_DOMAIN_ID') or 0))
        self._orders: queue.SimpleQueue[tuple[Order, str]] = queue.SimpleQueue()
        self._bins: BinStateArray | None = None
        self._scan: BoxScan | None = None
        self._seen, self._finishing_until_s = False, 0.0
        self.looked_at = threading.Event()
        self._layout: tuple[str, str] | None = None
        self._wake = self.create_guard_condition(self._pass_on)
        self.page = CellPage(self.view, address, self._on_button, self.looked_at.set)
        self.url = f'http://{address.host}:{self.page.port}/'
        self._listen()
        self._operate = {
            name: self.create_client(Operate, f'{name}/operate')
            for name in (ARM_EXECUTOR, CONVEYOR)
        }
        self._layout_asked = self.create_client(GetParameters, 'arm_executor/get_parameters')
        self._scene_timer = self.create_timer(SCENE_PERIOD_S, self._show_scene)
        self._scene_timer.cancel()
        self._joints: Any = None
        self.create_timer(TEXT_PERIOD_S, self._show_text)
        self._layout_timer = self.create_timer(1.0, self._ask_layout)

    def destroy_node(self) -> None:
        """Stop serving, then the node."""
        self.page.close()
        super().destroy_node()

    # -- what is heard ---------------------------------------------------------------------------

    def _listen(self) -> None:
        view = self.view
        cell: dict[str, tuple[type, Callable[[Any], None]]] = {
            'box_scan': (BoxScan, self._on_scan),
            'bin_state': (BinStateArray, self._on_bins),
            'bin_closed': (BinState, lambda msg: view.on_closed(conversions.bin_from_ros(msg))),
            'bin_closing': (
                DiagnosticStatus,
                lambda msg: view.on_closing(conversions.closing_from_ros(msg)),
            ),
            'placements': (
                PlacementDecision,
                lambda msg: view.on_decision(conversions.decision_from_ros(msg)),
            ),
            'placement_report': (
                PlacementReport,
                lambda msg: view.on_report(conversions.report_from_ros(msg)),
            ),
            'box_event': (BoxEvent, self._on_event),
        }
        others: dict[str, tuple[type, Callable[[Any], None], QoSProfile]] = {
            'robot_description': (
                String,
                lambda msg: view.on_robot(read_urdf(msg.data)),
                qos.STATE,
            ),
        }
        sources = Sources(self)
        for topic, (kind, take) in cell.items():
            checked = sources.checked(topic, self._guarded(topic, take))
            self.create_subscription(kind, topic, checked, qos.TOPICS[topic])
        for topic, (kind, take, profile) in others.items():
            self.create_subscription(kind, topic, self._guarded(topic, take), profile)

    def _guarded(self, topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """``take`` that notes a message it cannot use instead of failing."""

        def guarded(msg: Any) -> None:  # noqa: ANN401 - any message type
            try:
                take(msg)
            except ValueError as error:
                self.get_logger().warning(f'{topic}: {error}', throttle_duration_sec=5.0)

        return guarded

    # The largest messages of the cell, and the most frequent: converted only for who looks.

    def _on_bins(self, msg: BinStateArray) -> None:
        self._bins = msg

    def _on_scan(self, msg: BoxScan) -> None:
        self._scan = msg
        self.view.watch.on_scan(len(msg.boxes), msg.remaining)

    def _take_waiting(self) -> None:
        """Convert what has come since."""
        if self._bins is not None:
            bins, self._bins = self._bins, None
            self._guarded('bin_state', lambda msg: self.view.on_bins(bins_from_ros(msg)))(bins)
        if self._scan is not None:
            scan, self._scan = self._scan, None
            self._guarded('box_scan', lambda msg: self.view.on_scan(scan_from_ros(msg)[0]))(scan)

    def _on_event(self, msg: BoxEvent) -> None:
        if self._seen:
            # Where a box lay that was picked is in the scan before.
            self._take_waiting()
        self.view.on_event(conversions.event_from_ros(msg))

    # -- where everything stands -----------------------------------------------------------------

    def _ask_layout(self) -> None:
        if not self._layout_asked.service_is_ready():
            return
        self._layout_timer.cancel()
        request = GetParameters.Request(names=['layout', 'robot'])
        self._layout_asked.call_async(request).add_done_callback(self._on_layout)

    def _on_layout(self, future: Any) -> None:  # noqa: ANN401 - rclpy's future
        values = [value.string_value for value in future.result().values]
        if len(values) != 2:  # what answers is no executor of this cell
            self.get_logger().warning(
                f'belt and bins are drawn where they usually stand: {len(values)} of 2 parameters '
                'came from arm_executor'
            )
            return
        self._layout = (values[0], values[1])

    def _stand_like_the_cell(self) -> None:
        """Read the layout; what reads it takes half a second to come up."""
        if self._layout is None:
            return
        from arm_executor.reach.layout_file import find_layout

        (path, robot), self._layout = self._layout, None
        try:
            self.page.stand_like(find_layout(path, robot))
        except ValueError as error:
            self.get_logger().warning(f'belt and bins are drawn where they usually stand: {error}')

    # -- what is shown ---------------------------------------------------------------------------

    def _show_text(self) -> None:
        """What is cheap, and whether anybody looks: all else is done only then."""
        self.page.refresh_state()
        self._pass_on()  # a wake-up may be missed
        if self._finishing_until_s:
            self._close_bins_of_the_shift()
        if self.page.watched is not self._seen:
            self._seen = not self._seen
            (self._look if self._seen else self._look_away)()
        if self._seen:
            self._take_waiting()
            self.page.refresh_text()
        elif self.looked_at.is_set():
            self.looked_at.clear()
            if self.page.watched:
                # Somebody has come while it was cleared.
                self.looked_at.set()

    def _look(self) -> None:
        def take(msg: JointState) -> None:
            self.view.on_joints(dict(zip(msg.name, msg.position, strict=True)))

        heard = self._guarded('joint_states', take)
        self._joints = self.create_subscription(
            JointState, 'joint_states', heard, qos_profile_sensor_data
        )
        self._scene_timer.reset()

    def _look_away(self) -> None:
        self._scene_timer.cancel()
        self.destroy_subscription(self._joints)

    def _show_scene(self) -> None:
        self._take_waiting()
        self._stand_like_the_cell()
        self.page.refresh_scene()

    # -- what the buttons ask for ----------------------------------------------------------------

    def _on_button(self, order: Order, bin_id: str) -> None:
        """From a thread of the page."""
        self._orders.put((order, bin_id))
        self._wake.trigger()

    def _pass_on(self) -> None:
        while not self._orders.empty():
            order, bin_id = self._orders.get()
            if order is Order.RESUME:
                self._resume()
            elif order is Order.FINISH:
                self._finish()
            elif order is Order.ACKNOWLEDGE:
                for node, count in self.view.watch.nodes_with_alarms.items():
                    if count:
                        self._ask(node.rpartition('/')[2], Command.ACKNOWLEDGE)
            else:
                node, command = _ORDERS[order]
                self._ask(node, command, bin_id if order in _OF_A_BIN else '')

    def _resume(self) -> None:
        """The arm, and the belt where that was paused too."""
        belt_paused = self.view.watch.belt_condition == 'paused'
        if self.view.watch.paused or not belt_paused:
            self._ask(ARM_EXECUTOR, Command.RESUME)
        if belt_paused:
            self._ask(CONVEYOR, Command.RESUME)

    def _finish(self) -> None:
        """The arm ends its box, the belt is emptied; bins are closed when the arm stands."""
        if not self.view.watch.paused:
            self._ask(ARM_EXECUTOR, Command.PAUSE)
        self._ask(CONVEYOR, Command.EMPTY)
        self._finishing_until_s = time.monotonic() + FINISH_S

    def _close_bins_of_the_shift(self) -> None:
        if self.view.watch.mode in STANDS:
            self._ask(ARM_EXECUTOR, Command.CLOSE_ALL)
            self._ask(ARM_EXECUTOR, Command.RESUME)
        elif time.monotonic() > self._finishing_until_s:
            text = 'The arm is still placing a box; it stays paused: press Finish again, or Resume'
            self.page.tell(text, good=False)
        else:
            return
        self._finishing_until_s = 0.0

    def _ask(self, node: str, command: Command, bin_id: str = '') -> None:
        client = self._operate.get(node)
        if client is None or not client.service_is_ready():
            self.page.tell(f'{node} does not answer: is the cell running?', good=False)
            return
        request = Operate.Request(command=int(command), bin_id=bin_id, who=WHO)
        client.call_async(request).add_done_callback(self._on_answer)

    def _on_answer(self, future: Any) -> None:  # noqa: ANN401 - rclpy's future
        answer = future.result()
        self.page.tell(answer.message, good=answer.success)


def serve_page(address: PageAddress, told: Callable[[str], None], namespace: str = '') -> None:
    """Serve the page of the cell in ``namespace`` until a signal; ``told`` hears where it is.

    Raises
    ------
    SystemExit
        With code 0 after a signal, 2 when the address cannot be had.
    """

    def make() -> Viewer:
        viewer = Viewer(address, namespace=namespace)
        told(viewer.url)
        return viewer

    _run(make, [])


def main(args: list[str] | None = None) -> None:
    """Run the node alone, as `ros2 run` and the launch file do."""

    def make() -> Viewer:
        viewer = Viewer()
        viewer.get_logger().info(f'the cell is shown at {viewer.url}')
        return viewer

    _run(make, args)


def _run(make: Callable[[], Viewer], args: list[str] | None) -> None:
    os.nice(NICENESS)
    run_node(
        'viewer',
        make,
        args=args,
        cannot_start=(PageTaken,),
        spun_by=lambda viewer: RestingExecutor(viewer.looked_at),
    )


if __name__ == '__main__':
    main()
