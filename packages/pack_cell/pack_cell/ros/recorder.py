"""Node `recorder`: listens to every topic of the cell and feeds a :class:`RunRecord`.

Subscribes
    box_scan, simulation/true_boxes, placements, placement_report, box_event, bin_state, bin_closed,
    bin_closing
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from copy import copy
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions

from pack_cell.report.record import RunRecord
from pack_cell.report.run_log import RunLog
from pack_cell.ros.cell_monitor import CellMonitor
from pack_cell.watching.cell_watch import CellWatch
from pack_msgs.msg import (
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.parameter_service import check_parameters_of_nodes
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.security import secured_or_nothing
from pack_msgs_py.ros.sourced import Sources

#: Events that wait to be handled: on a busy machine the cell runs ahead of this process.
_BACKLOG = 10_000
#: Called with the kind of change ('decision', 'report', 'event', 'closed', 'closing') and the new
#: value.
Listener = Callable[[str, Any], None]


class Recorder(Node):
    """Turns messages into values and hands them to a record.

    ``log`` keeps those that changed it; what it holds of earlier sessions is recorded first.
    """

    def __init__(
        self,
        record: RunRecord | None = None,
        listener: Listener | None = None,
        context: Context | None = None,
        log: RunLog | None = None,
        name: str = 'recorder',
    ) -> None:
        super().__init__(name, context=context)
        self.record = record or RunRecord()
        self.problems: list[str] = []
        self._listener: Listener = lambda kind, value: None
        self._log: RunLog | None = None
        self.sources = Sources(self)
        topics: dict[str, tuple[type, Callable[[Any], None]]] = {
            'box_scan': (BoxScan, self._on_scan),
            qos.TRUE_BOXES: (BoxScan, self._on_truth),
            'placements': (PlacementDecision, self._on_decision),
            'placement_report': (PlacementReport, self._on_report),
            'box_event': (BoxEvent, self._on_event),
            'bin_state': (BinStateArray, self._on_bins),
            'bin_closed': (BinState, self._on_closed),
            'bin_closing': (DiagnosticStatus, self._on_closing),
        }
        for topic, content in log.messages() if log is not None else ():
            kind, callback = topics[topic]
            callback(deserialize_message(content, kind))
        self.record.scan = None  # what the belt was then
        self._log, self._listener = log, listener or self._listener
        for topic, (kind, callback) in topics.items():
            profile = copy(qos.TOPICS[topic])
            if profile.depth > 1:
                profile.depth = _BACKLOG
            take = self.sources.checked(topic, self._guard(topic, callback))
            self.create_subscription(kind, topic, take, profile)

    def _guard(self, topic: str, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        """``callback`` that notes a message it cannot use instead of failing."""

        def guarded(msg: Any) -> None:  # noqa: ANN401 - any message type
            try:
                callback(msg)
            except ValueError as error:
                text = f'{topic}: {error}'
                if text not in self.problems:
                    self.problems.append(text)
                    self.get_logger().warning(text)

        return guarded

    def _keep(self, topic: str, msg: Any) -> None:  # noqa: ANN401 - any message type
        """Write down a message that has told something new."""
        if self._log is not None:
            self._log.add(topic, serialize_message(msg))

    def _on_scan(self, msg: BoxScan) -> None:
        scan, errors = conversions.scan_from_ros(msg)
        for text in errors:
            if text not in self.problems:
                self.problems.append(text)
        self._keep_boxes('box_scan', msg, self.record.on_scan(scan))

    def _on_truth(self, msg: BoxScan) -> None:
        scan, _ = conversions.scan_from_ros(msg)
        self._keep_boxes(qos.TRUE_BOXES, msg, self.record.on_truth(scan))

    def _keep_boxes(self, topic: str, msg: BoxScan, box_ids: Collection[str]) -> None:
        """Of a scan, only the boxes that were not known so."""
        if box_ids and self._log is not None:
            boxes = [item for item in msg.boxes if item.box.id in box_ids]
            self._keep(topic, BoxScan(header=msg.header, boxes=boxes))

    def _on_decision(self, msg: PlacementDecision) -> None:
        decision = conversions.decision_from_ros(msg)
        if self.record.on_decision(decision):
            self._keep('placements', msg)
            self._listener('decision', decision)

    def _on_report(self, msg: PlacementReport) -> None:
        report = conversions.report_from_ros(msg)
        if self.record.on_report(report):
            self._keep('placement_report', msg)
            self._listener('report', report)

    def _on_event(self, msg: BoxEvent) -> None:
        event = conversions.event_from_ros(msg)
        if self.record.on_event(event):
            self._keep('box_event', msg)
            self._listener('event', event)

    def _on_bins(self, msg: BinStateArray) -> None:
        self.record.on_bins(conversions.bins_from_ros(msg, every=True))

    def _on_closed(self, msg: BinState) -> None:
        closed = conversions.bin_from_ros(msg)
        if self.record.on_closed(closed):
            self._keep('bin_closed', msg)
            self._listener('closed', closed)

    def _on_closing(self, msg: DiagnosticStatus) -> None:
        reason = conversions.closing_from_ros(msg)
        self.record.on_closing(reason)
        self._keep('bin_closing', msg)
        self._listener('closing', reason)


class SteppedRecorder:
    """A recorder that is spun by its owner, step by step; leaves signals to the owner.

    Publishes `cell_state`, too.
    """

    def __init__(self, record: RunRecord, listener: Listener, log: RunLog | None = None) -> None:
        check_parameters_of_nodes()
        with secured_or_nothing():
            rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
            self._recorder = Recorder(record, listener, log=log)
        self._monitor = CellMonitor(self._recorder, scans=False, sources=self._recorder.sources)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._recorder)

    @property
    def cell_state(self) -> CellState:
        """The state of the whole cell now."""
        scan = self._recorder.record.scan
        if scan is not None:
            self._monitor.watch.on_scan(len(scan.boxes), scan.remaining)
        return self._monitor.state

    @property
    def watch(self) -> CellWatch:
        """What each node of the cell has said last."""
        return self._monitor.watch

    def listen(self, seconds: float) -> None:
        """Handle one message, or return after ``seconds``."""
        self._executor.spin_once(timeout_sec=seconds)

    def drain(self, seconds: float) -> None:
        """Handle what has come, for at most ``seconds``."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)

    def close(self) -> list[str]:
        """Stop listening; return what was wrong with messages that could not be used."""
        problems = self._recorder.problems
        self._recorder.destroy_node()
        rclpy.try_shutdown()
        return problems


def main(args: list[str] | None = None) -> None:
    """Run the recorder alone and log what it hears."""
    run_node('recorder', _logging_recorder, args=args)


def _logging_recorder() -> Recorder:
    recorder = Recorder()
    recorder._listener = lambda kind, value: recorder.get_logger().info(f'{kind}: {value}')  # noqa: SLF001
    return recorder


if __name__ == '__main__':
    main()
