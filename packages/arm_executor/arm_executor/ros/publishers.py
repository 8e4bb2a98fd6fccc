"""What the node tells the rest of the cell."""

from __future__ import annotations

from builtin_interfaces.msg import Time as TimeMsg
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from arm_executor.bins.book import BookState
from arm_executor.goals.outputs import BinClosed, BinsChanged, Happened, Status
from arm_executor.ros.messages import diagnostics_to_ros
from pack_msgs.msg import (
    BinState,
    BinStateArray,
    BoxEvent,
    ExecutorState,
    PlacementReport,
)
from pack_msgs_py.cell_values import BinSnapshot, Report
from pack_msgs_py.codes import BinStatus
from pack_msgs_py.ros import conversions
from pack_msgs_py.ros.conversions import time_from_ros
from pack_msgs_py.ros.sourced import SourcedPublisher
from pack_msgs_py.values import frame_name


class Publishers:
    """The publishers of ``node``, each with the QoS of its topic."""

    def __init__(self, node: Node, session: int) -> None:
        def publisher(kind: type, topic: str) -> SourcedPublisher:
            return SourcedPublisher(node, kind, topic, session)

        self._node = node
        self._bin_state = publisher(BinStateArray, 'bin_state')
        self._bin_closed = publisher(BinState, 'bin_closed')
        self._reports = publisher(PlacementReport, 'placement_report')
        self._events = publisher(BoxEvent, 'box_event')
        self._state = publisher(ExecutorState, 'executor_state')
        self._diagnostics = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._frames: dict[str, str] = {}
        self._beaten = ExecutorState()

    def _stamp(self) -> TimeMsg:
        return self._node.get_clock().now().to_msg()

    def event(self, output: Happened) -> None:
        """Something happened to a box, with its original stamp."""
        self._events.publish(conversions.event_to_ros(output.event))

    def bins(self, output: BinsChanged) -> None:
        """Every standing bin; the planner looks at the oldest first."""
        state = output.state
        self._frames.update({bin_.id: frame_name(bin_.station) for bin_ in state.bins})
        stamp_s = time_from_ros(self._stamp())
        snapshot = BinSnapshot(state.revision, stamp_s, state.bins)
        status = dict.fromkeys(state.held, BinStatus.HELD)
        status |= dict.fromkeys(state.blocked, BinStatus.BLOCKED)
        self._bin_state.publish(conversions.bins_to_ros(snapshot, dict(state.poses), status))

    def closed(self, output: BinClosed) -> None:
        """The content of a bin that was taken away."""
        self._bin_closed.publish(
            conversions.bin_to_ros(output.bin, dict(output.poses), self._stamp(), BinStatus.CLOSED)
        )

    def report(self, report: Report) -> PlacementReport:
        """The outcome of a goal; returns the message that was sent."""
        msg = conversions.report_to_ros(report, self._frames.get(report.bin_id, ''))
        self._reports.publish(msg)
        return msg

    def heartbeat(self, status: Status) -> None:
        """Alive, and in this mode."""
        msg = ExecutorState(
            mode=int(status.mode),
            active_box_id=status.active_box,
            time_remaining=conversions.duration_to_ros(status.remaining_s),
            message=status.message,
        )
        msg.header.stamp = self._stamp()
        self._beaten = msg
        self._send_heartbeat(msg)

    def heartbeat_again(self) -> None:
        """Still alive, and in the same mode."""
        self._beaten.header.stamp = self._stamp()
        self._send_heartbeat(self._beaten)

    def _send_heartbeat(self, msg: ExecutorState) -> None:
        self._state.publish(msg)
        self._state.assert_liveliness()

    def diagnostics(self, status: Status, bins: BookState, journal: str) -> None:
        """Mode, last fault, journal and bins for `/diagnostics` (REP 107)."""
        name = self._node.get_fully_qualified_name()
        self._diagnostics.publish(diagnostics_to_ros(name, status, bins, journal, self._stamp()))
