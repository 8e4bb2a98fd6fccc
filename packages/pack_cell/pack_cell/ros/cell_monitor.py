"""Node `cell_monitor`: publishes the state of the whole cell.

- subscribes to `executor_state`, `alarms`, `box_scan` and `/diagnostics`
- publishes `cell_state` (pack_msgs/CellState) on each change, and once a second
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos import QoSProfile

from pack_cell.watching.cell_watch import NODES, CellWatch
from pack_msgs.msg import AlarmArray, BoxScan, ExecutorState
from pack_msgs.msg import CellState as CellStateMsg
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.checks import clean_text
from pack_msgs_py.codes import Level, Mode
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.graph import node_names
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import Sources

PERIOD_S = 1.0
#: How often it is looked whether the state is another.
LOOK_S = 0.1


class CellListener:
    """Feeds a :class:`CellWatch` with what is heard by ``node``, in the node's namespace.

    Without ``scans`` whoever hears them anyway calls :meth:`CellWatch.on_scan`. ``sources`` says
    whom the node believes; by default that is found out here.
    """

    def __init__(self, node: Node, *, scans: bool = True, sources: Sources | None = None) -> None:
        self.watch = CellWatch(time.monotonic)
        sources = sources or Sources(node)
        self._prefix = node.get_namespace().rstrip('/') + '/'
        heard: list[tuple[type, str, Callable[[Any], None], QoSProfile]] = [
            (ExecutorState, 'executor_state', self._on_arm, QoSProfile(depth=10)),
            (AlarmArray, 'alarms', self._on_alarms, qos.ALARMS_HEARD),
        ]
        if scans:
            heard.append((BoxScan, 'box_scan', self._on_scan, qos.heard('box_scan')))
        for kind, topic, take, profile in heard:
            node.create_subscription(kind, topic, sources.checked(topic, take), profile)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        node.create_timer(PERIOD_S, lambda: self.watch.forget_gone(node_names(node)))

    def _on_arm(self, msg: ExecutorState) -> None:
        if msg.mode in set(Mode):
            active, message = clean_text(msg.active_box_id), clean_text(msg.message)
            self.watch.on_heartbeat(Mode(msg.mode), active, message)

    def _on_alarms(self, msg: AlarmArray) -> None:
        try:
            node, alarms = conversions.alarms_from_ros(msg)
        except ValueError:
            return  # who sent it is told by those who act on it
        self.watch.on_alarms(node, alarms)

    def _on_scan(self, msg: BoxScan) -> None:
        self.watch.on_scan(len(msg.boxes), msg.remaining)

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            name = f'/{status.name}'
            if not name.startswith(self._prefix):
                continue
            name = name[len(self._prefix) :]
            if name in NODES:
                level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
                values = {pair.key: clean_text(pair.value) for pair in status.values}
                text = clean_text(status.message)
                self.watch.on_diagnostics(name, Level(min(level, 3)), text, values)


class CellMonitor:
    """Publishes `cell_state` by ``node``: on each change, and once a second."""

    def __init__(self, node: Node, *, scans: bool = True, sources: Sources | None = None) -> None:
        self._node = node
        self.watch = CellListener(node, scans=scans, sources=sources).watch
        self._last: CellState | None = None
        self._sent_s = 0.0
        self._publisher = node.create_publisher(
            CellStateMsg, 'cell_state', qos.TOPICS['cell_state']
        )
        node.create_timer(LOOK_S, self._look)

    @property
    def state(self) -> CellState:
        """The state of the cell now."""
        stamp_s = conversions.time_from_ros(self._node.get_clock().now().to_msg())
        return self.watch.state(stamp_s)

    def _look(self) -> None:
        state = self.state
        same = self._last is not None and replace(self._last, stamp_s=0.0) == replace(
            state, stamp_s=0.0
        )
        if same and time.monotonic() - self._sent_s < PERIOD_S:
            return
        self._last, self._sent_s = state, time.monotonic()
        self._publisher.publish(conversions.cell_state_to_ros(state))


class MonitorNode(Node):
    """The monitor alone, for cells that are launched."""

    def __init__(self, **node_options: Any) -> None:  # noqa: ANN401 - rclpy's own options
        super().__init__('cell_monitor', **node_options)
        self.monitor = CellMonitor(self)


def main(args: list[str] | None = None) -> None:
    """Run the monitor until SIGINT or SIGTERM."""
    run_node('cell_monitor', MonitorNode, args=args)


if __name__ == '__main__':
    main()
