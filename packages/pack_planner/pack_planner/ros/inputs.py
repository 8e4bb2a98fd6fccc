"""What the planner hears of belt and arm; what falls silent is subscribed to anew."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node

from pack_msgs.msg import BinState, BinStateArray, BoxScan, ExecutorState, PlacementReport
from pack_msgs.msg import BoxEvent as BoxEventMsg
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.checks import check_length, check_name
from pack_msgs_py.codes import Mode
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import (
    bins_from_ros,
    event_from_ros,
    report_from_ros,
    scan_from_ros,
    time_from_ros,
)
from pack_msgs_py.ros.conversions.content import MOST_BINS
from pack_msgs_py.ros.sourced import Sources
from pack_msgs_py.ros.transforms import ScanFrames
from pack_msgs_py.values import Bin
from pack_planner.coordination.asking_again import AskingAgain
from pack_planner.coordination.coordinator import Coordinator
from pack_planner.coordination.inputs import Heartbeat, check_scan

#: Without a scan or a heartbeat for so long it is subscribed to anew: the middleware may have lost
#: who sends it.
LATE_S = 3.0

M = TypeVar('M')


class PlannerInputs:
    """The subscriptions of ``node``, which feed ``coordinator``.

    Attributes
    ----------
    scan : the last one, ``None`` before the first.
    known_bins : by their ids, as they were heard last.
    """

    def __init__(
        self, node: Node, coordinator: Coordinator, sources: Sources, frame_prefix: str
    ) -> None:
        self._node, self._coordinator, self._sources = node, coordinator, sources
        self._log = node.get_logger()
        self._frames = ScanFrames(node, frame_prefix)
        self.scan: Scan | None = None
        self.known_bins: dict[str, Bin] = {}
        self._listen(
            PlacementReport,
            'placement_report',
            lambda msg: coordinator.on_report(report_from_ros(msg)),
        )
        self._listen(
            BoxEventMsg, 'box_event', lambda msg: coordinator.on_event(event_from_ros(msg))
        )
        self._hear_arm()
        self._bins_subscription = self._listen(BinStateArray, 'bin_state', self._on_bins)
        self._scan_subscription = self._listen(BoxScan, 'box_scan', self._on_scan)
        self._scanned_s = self._beaten_s = time.monotonic()
        self._bins_again, self._scan_again, self._arm_again = (AskingAgain() for _ in range(3))
        self._refresh_wanted = False

    def refresh_bins(self) -> None:
        """Subscribe to `bin_state` anew: that brings the current one for sure."""
        self._refresh_wanted = True

    def look(self) -> None:
        """Subscribe anew to what has fallen silent; call it now and then."""
        now_s = time.monotonic()
        if self._bins_again.due(missing=self._coordinator.lacks_bins, now_s=now_s):
            self._refresh_wanted = True
        if self._arm_again.due(missing=now_s - self._beaten_s > LATE_S, now_s=now_s):
            self._node.destroy_subscription(self._arm_subscription)
            self._sources.heard_again('executor_state')
            self._hear_arm()
        if self._scan_again.due(missing=now_s - self._scanned_s > LATE_S, now_s=now_s):
            self._node.destroy_subscription(self._scan_subscription)
            self._sources.heard_again('box_scan')
            self._scan_subscription = self._listen(BoxScan, 'box_scan', self._on_scan)
        if self._refresh_wanted:
            self._refresh_wanted = False
            self.known_bins.clear()
            self._node.destroy_subscription(self._bins_subscription)
            self._sources.heard_again('bin_state')
            self._bins_subscription = self._listen(BinStateArray, 'bin_state', self._on_bins)

    def _listen(
        self,
        kind: type[M],
        topic: str,
        take: Callable[[M], None],
        events: SubscriptionEventCallbacks | None = None,
    ) -> Any:  # noqa: ANN401 - rclpy's subscription is generic only in later releases
        """Subscribe; what cannot be used is reported and costs nothing else."""

        def receive(msg: M) -> None:
            try:
                take(msg)
            except ValueError as error:
                self._log.error(f'{topic} ignored: {error}', throttle_duration_sec=5.0)

        return self._node.create_subscription(
            kind,
            topic,
            self._sources.checked(topic, receive),
            qos.heard(topic),
            event_callbacks=events,
        )

    def _hear_arm(self) -> None:
        self._arm_subscription = self._listen(
            ExecutorState, 'executor_state', self._on_heartbeat, self._death_events()
        )

    def _death_events(self) -> SubscriptionEventCallbacks:
        """The QoS events that tell of a dead or hung executor."""

        def liveliness(event: Any) -> None:  # noqa: ANN401 - rclpy's event has no public type
            if event.alive_count == 0:
                self._coordinator.on_executor_lost()

        def deadline(event: Any) -> None:  # noqa: ANN401 - as above
            self._log.warning('the heartbeat of the arm is late', throttle_duration_sec=5.0)

        return SubscriptionEventCallbacks(
            liveliness=liveliness, deadline=deadline, use_default_callbacks=False
        )

    def _on_scan(self, msg: BoxScan) -> None:
        self._scanned_s = time.monotonic()
        scan, errors = scan_from_ros(msg)
        for error in errors:
            self._log.error(f'box left out: {error}', throttle_duration_sec=5.0)
        scan = self._frames.in_cell(check_scan(scan, self._now_s()))
        self.scan = scan
        self._coordinator.on_scan(scan, len(errors))

    def _on_bins(self, msg: BinStateArray) -> None:
        """Convert only bins that changed: a full bin is the largest message of the cell."""
        check_length('bin_state', msg.bins, MOST_BINS)
        changed = [state for state in msg.bins if not self._is_known(state)]
        known = [state for state in msg.bins if self._is_known(state)]
        array = BinStateArray(header=msg.header, revision=msg.revision, bins=changed)
        snapshot = bins_from_ros(array)
        bins = (*snapshot.bins, *(self.known_bins[state.bin_id] for state in known))
        self.known_bins = {target.id: target for target in bins}
        ordered = tuple(sorted(bins, key=lambda target: target.serial))
        self._coordinator.on_bins(replace(snapshot, bins=ordered))

    def _is_known(self, msg: BinState) -> bool:
        known = self.known_bins.get(msg.bin_id)
        return (
            known is not None
            and msg.status == BinState.STATUS_OPEN
            and (known.serial, known.revision) == (msg.serial, msg.revision)
        )

    def _on_heartbeat(self, msg: ExecutorState) -> None:
        self._beaten_s = time.monotonic()
        self._coordinator.on_heartbeat(
            Heartbeat(
                Mode(msg.mode),
                check_name('active_box_id', msg.active_box_id),
                time_from_ros(msg.header.stamp),
            )
        )

    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9
