"""The node `conveyor`.

- publishes `box_scan` (pack_msgs/BoxScan): on each change, once a second, and at `rate` while the
  belt moves
- publishes and subscribes `box_event` (pack_msgs/BoxEvent): says REJECTED; follows PICKED, PLACED,
  RETURNED, LOST
- subscribes `placements` (pack_msgs/PlacementDecision): brings the box of the newest decision;
  diverts a rejected one
- subscribes `bin_state` (pack_msgs/BinStateArray) and `bin_closed` (pack_msgs/BinState): a box in
  a bin is not on the belt
- subscribes `executor_state` (pack_msgs/ExecutorState): brings the box that the arm waits for,
  should its decision not have arrived; the belt stands while the arm is stopped
- publishes `simulation/true_boxes` (pack_msgs/BoxScan): the boxes as they really are, each where
  it is once it stands at the pick point; for simulated worlds alone
- subscribes `placement_report` (pack_msgs/PlacementReport): the robot time that the arm has spent,
  which is what arrivals wait for at speed 0; a box that it did not find is scanned again
- publishes `/diagnostics` (diagnostic_msgs/DiagnosticArray), once a second
- publishes `alarms` (pack_msgs/AlarmArray): a jam, until it is over and acknowledged
- serves what :mod:`conveyor_sim.ros.operating` lists, for operators
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from conveyor_sim.conveyor.belt_operator import BeltOperator
from conveyor_sim.conveyor.news import ConveyorNews
from conveyor_sim.factory import make_conveyor, make_ledger, open_stream
from conveyor_sim.ledger.ledger import LedgerError
from conveyor_sim.parameters import ConveyorParameters
from conveyor_sim.ros.diagnostics import diagnostics_to_ros
from conveyor_sim.ros.operating import BeltServices
from pack_msgs.msg import (
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    ExecutorState,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.checks import check_length, check_name
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.one_source import new_session
from pack_msgs_py.parameter_fields import check_value, parameter_fields
from pack_msgs_py.ros.conversions import (
    decision_from_ros,
    event_from_ros,
    event_to_ros,
    report_from_ros,
    scan_to_ros,
    time_from_ros,
)
from pack_msgs_py.ros.conversions.content import MOST_BINS, MOST_BOXES
from pack_msgs_py.ros.declare_parameters import declare_parameters
from pack_msgs_py.ros.managed_node import ManagedNode
from pack_msgs_py.ros.own_alarms import OwnAlarms
from pack_msgs_py.ros.qos import TRUE_BOXES, heard
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import BELT, SourcedPublisher, Sources
from pack_msgs_py.wording import how_many

IDLE_PERIOD_S = 1.0
DIAGNOSTICS_PERIOD_S = 1.0
#: A timer cannot be shorter; also keeps a scan from being sent just before an arrival.
MIN_PERIOD_S = 0.001
THROTTLE_S = 5.0
#: Modes of the arm in which it takes no box: the belt stands with it.
_ARM_STANDS = (
    ExecutorState.MODE_PAUSED,
    ExecutorState.MODE_ALARM,
    ExecutorState.MODE_PROTECTIVE_STOP,
    ExecutorState.MODE_FAULT,
)


class ConveyorNode(ManagedNode):
    """Turns messages into calls of :class:`Conveyor`, and its answers into messages.

    While it is not active the belt stands, and tells what is on it.

    Raises
    ------
    ValueError
        A parameter is wrong, or the box file cannot be used.
    LedgerError
        The ledger cannot be used.
    """

    def __init__(self, **kwargs) -> None:  # type: ignore[no-untyped-def]
        super().__init__('conveyor', **kwargs)
        try:
            self._params = declare_parameters(self, ConveyorParameters)
        except BaseException:
            self.destroy_node()
            raise
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._use_parameters)
        self.begin()

    def set_active(self, *, active: bool) -> None:
        """Let the belt run, or stand."""
        self._tell(self._conveyor.set_active(active, *self._now()))
        self._publish_diagnostics()

    def make(self) -> None:
        """Stream, ledger, belt, and all that hears and tells."""
        params = self._params
        stream = open_stream(params)
        self._ledger = make_ledger(params, stream)
        self.at_release(self._ledger.close)
        self._conveyor = make_conveyor(params, stream, self._ledger)
        self._ended = self._arm_stands = False

        session = new_session()
        self._sources = Sources(self, (BELT, session))
        self._scans = SourcedPublisher(self, BoxScan, 'box_scan', session)
        self._true_boxes: tuple[ScannedBox, ...] | None = None
        self._truth = SourcedPublisher(self, BoxScan, TRUE_BOXES, session)
        self._events = SourcedPublisher(self, BoxEvent, 'box_event', session)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = self.create_timer(IDLE_PERIOD_S, self._on_timer)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)
        self.get_logger().info(
            f'supplies {stream.description}, belt with {self._conveyor.geometry}, '
            f'ledger {"in memory" if not params.state_dir else self._ledger.path}'
        )

        for note in stream.notes:
            self.get_logger().warning(f'{stream.name}: {note}')

        # In this order when several have come: a decision rests on what happened before.
        for kind, topic, callback in (
            (BoxEvent, 'box_event', self._on_event),
            (BinStateArray, 'bin_state', self._on_bins),
            (BinState, 'bin_closed', self._on_bin_closed),
            (PlacementReport, 'placement_report', self._on_report),
            (PlacementDecision, 'placements', self._on_placement),
        ):
            self.create_subscription(kind, topic, self._guard(topic, callback), heard(topic))
        beat = self._guard('executor_state', self._on_executor_state)
        self.create_subscription(ExecutorState, 'executor_state', beat, 10)
        news = self._conveyor.start(*self._now(), active=self.is_active)
        self._operator = BeltOperator(
            self._conveyor, self._ledger, acknowledges_itself=params.acknowledge == 'itself'
        )
        self._operator.take_up(self._now()[0])
        self._alarms = OwnAlarms(self)
        self._publish_alarms()
        BeltServices(self, self._conveyor, self._operator, self._now, self._tell, self._operated)
        self._tell(news)

    def _now(self) -> tuple[float, float]:
        """Steady seconds for motion, and seconds since the epoch for stamps."""
        return time.monotonic(), self.get_clock().now().nanoseconds * 1e-9

    def _tell(self, news: ConveyorNews, topic: str = '') -> None:
        for text in news.complaints:
            self._complain(topic, text)
        for note in news.notes:
            self.get_logger().info(note)
        for event in news.events:
            self.get_logger().warning(f'rejected {event.box_id}: {event.text}')
        for event in (*news.repeated, *news.events):
            self._events.publish(event_to_ros(event))
        if self._operator.look(*self._now()) is not None:
            self._publish_alarms()
            self._publish_diagnostics()
        if news.changed:
            self._publish_scan()

    def _operated(self) -> None:
        """An operator has changed something: all see it at once."""
        self._publish_alarms()
        self._publish_diagnostics()

    def _publish_alarms(self) -> None:
        self._alarms.publish(self._operator.standing)

    def _on_timer(self) -> None:
        news = self._conveyor.tick(*self._now())
        self._tell(replace(news, changed=True))

    def _publish_scan(self) -> None:
        now_s, stamp_s = self._now()
        self._publish_truth(now_s, stamp_s)
        self._scans.publish(scan_to_ros(self._conveyor.scan(now_s, stamp_s)))
        period = 1.0 / self._params.rate if self._conveyor.moves(now_s) else IDLE_PERIOD_S
        change_s = self._conveyor.next_change_s(now_s)
        if change_s is not None:
            period = max(MIN_PERIOD_S, min(period, change_s - now_s))
        self._timer.timer_period_ns = round(1e9 * period)
        self._timer.reset()
        if self._conveyor.ended and not self._ended:
            self.get_logger().info(
                f'the stream has ended: {how_many(self._conveyor.supplied, "box")}'
            )
        self._ended = self._conveyor.ended

    def _publish_truth(self, now_s: float, stamp_s: float) -> None:
        """Before the scan that shows them, so that no world meets a box that it does not know."""
        boxes = self._conveyor.true_boxes(now_s)
        if boxes != self._true_boxes:
            self._true_boxes = boxes
            self._truth.publish(scan_to_ros(Scan(0, stamp_s, boxes)))

    def _guard(self, topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """``take`` for messages of the source of ``topic``; what cannot be used is told."""

        def receive(msg: Any) -> None:  # noqa: ANN401 - any message type
            try:
                take(msg)
            except ValueError as error:
                self._complain(topic, str(error))

        return self._sources.checked(topic, receive)

    def _on_placement(self, msg: PlacementDecision) -> None:
        decision = decision_from_ros(msg)
        self._tell(self._conveyor.on_decision(decision, *self._now()), 'placements')

    def _on_event(self, msg: BoxEvent) -> None:
        event = event_from_ros(msg)
        self._tell(self._conveyor.on_event(event, *self._now()), 'box_event')

    def _on_executor_state(self, msg: ExecutorState) -> None:
        executing = msg.mode == ExecutorState.MODE_EXECUTING
        box_id = check_name('active_box_id', msg.active_box_id) if executing else ''
        self._tell(self._conveyor.on_handled(box_id, *self._now()))
        stands = msg.mode in _ARM_STANDS
        if stands != self._arm_stands:
            self._arm_stands = stands
            self._tell(self._conveyor.stand_with_arm(stands, *self._now()))
            self._publish_diagnostics()

    def _on_report(self, msg: PlacementReport) -> None:
        report = report_from_ros(msg)
        if report.code is ErrorCode.GRASP_FAILED:
            text = f'the arm found no box: {report.message}'
            news = self._conveyor.on_empty_grasp(report.box_id, text, report.stamp_s, *self._now())
            self._tell(news)
        spent_s = report.cycle_s + report.wait_s
        if spent_s > 0.0:
            self._tell(self._conveyor.on_robot_time(spent_s, *self._now()))

    def _on_bins(self, msg: BinStateArray) -> None:
        check_length('bin_state', msg.bins, MOST_BINS)
        self._on_content('bin_state', msg.bins, time_from_ros(msg.header.stamp))

    def _on_bin_closed(self, msg: BinState) -> None:
        self._on_content('bin_closed', [msg], time_from_ros(msg.header.stamp))

    def _on_content(self, topic: str, bins: Iterable[BinState], content_stamp_s: float) -> None:
        for content in bins:
            check_length(f'bin {content.bin_id!r}', content.boxes, MOST_BOXES)
        box_ids = [placed.box.id for content in bins for placed in content.boxes]
        if '' in box_ids:
            self._complain(topic, 'a box in a bin has an empty id')
        named = [check_name('box_id', box_id) for box_id in box_ids if box_id]
        self._tell(self._conveyor.on_content(named, content_stamp_s, *self._now()), topic)

    def _publish_diagnostics(self) -> None:
        name, stamp = self.get_fully_qualified_name(), self.get_clock().now().to_msg()
        said = self._operator.said
        self._diagnostics.publish(diagnostics_to_ros(name, self._conveyor, said, stamp))

    def _complain(self, topic: str, why: str) -> None:
        self.get_logger().warning(f'ignored on {topic}: {why}', throttle_duration_sec=THROTTLE_S)

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        specs = {spec.name: spec for spec in parameter_fields(ConveyorParameters)}
        try:
            for change in changes:
                if change.name in specs:
                    check_value(specs[change.name], change.value)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _use_parameters(self, changes: list[Parameter]) -> None:
        known = {spec.name for spec in parameter_fields(ConveyorParameters)}
        values = {change.name: change.value for change in changes if change.name in known}
        self._params = params = replace(self._params, **values)
        if not self.is_configured:
            return
        self._conveyor.tune(
            self._now()[0],
            belt_speed=float(params.belt_speed),
            speed=float(params.speed),
            max_laps=params.max_laps,
        )
        self._publish_scan()


def main(args: list[str] | None = None) -> None:
    """Run the node until it is told to end; exit code 2 when it cannot start as asked."""
    run_node(
        'conveyor',
        ConveyorNode,
        args=args,
        cannot_start=(ValueError, LedgerError),
        failed=(LedgerError,),
    )


if __name__ == '__main__':
    main()
