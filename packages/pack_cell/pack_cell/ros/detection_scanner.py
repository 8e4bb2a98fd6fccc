"""Node `detection_scanner`: a scanner made of a camera that speaks vision_msgs (docs/camera.md).

- subscribes `detections` (vision_msgs/Detection3DArray), in any frame that `/tf` or `/tf_static`
  connects with `cell`
- subscribes `box_event` (pack_msgs/BoxEvent): what was picked has gone, what came back is there
- subscribes `placements` (pack_msgs/PlacementDecision): what is to be rejected
- publishes `box_scan` (pack_msgs/BoxScan): on each image and at least once a second
- publishes `box_event`: REJECTED, once a box that is to be rejected is no longer seen
"""

from __future__ import annotations

from typing import Any

from rclpy.qos import qos_profile_sensor_data
from vision_msgs.msg import Detection3D, Detection3DArray

from conveyor_sim.streams import load_boxes
from pack_cell.detections.detection import Detection
from pack_cell.detections.parameters import DetectionParameters
from pack_cell.detections.tracker import DetectionTracker
from pack_msgs.msg import BoxEvent, BoxScan, PlacementDecision
from pack_msgs_py.checks import InvalidValue, check_finite
from pack_msgs_py.geometry.frames import composed
from pack_msgs_py.one_source import new_session
from pack_msgs_py.ros.conversions import (
    decision_from_ros,
    event_from_ros,
    event_to_ros,
    pose_from_ros,
    scan_to_ros,
    time_from_ros,
    vector_from_ros,
)
from pack_msgs_py.ros.declare_parameters import declare_parameters
from pack_msgs_py.ros.managed_node import ManagedNode
from pack_msgs_py.ros.qos import TOPICS
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import BELT, SourcedPublisher, Sources
from pack_msgs_py.ros.transforms import ScanFrames
from pack_msgs_py.values import Box
from pack_msgs_py.wording import how_many

PERIOD_S = 1.0
THROTTLE_S = 5.0


def articles(path: str) -> dict[str, Box]:
    """The articles of a box list by their `sku`, or their id where they have none.

    Raises
    ------
    ValueError
        The list cannot be used, or a row of it.
    """
    if not path:
        return {}
    boxes, rejected = load_boxes(path)
    if rejected:
        msg = f'articles: {how_many(len(rejected), "row")} of no use, the first: {rejected[0].text}'
        raise ValueError(msg)
    return {dict(box.extra).get('sku') or box.id: box for box in boxes}


def detection_from_ros(msg: Detection3D) -> Detection:
    """vision_msgs/Detection3D as a checked value, pose in the frame of the message."""
    best = max(msg.results, key=lambda result: result.hypothesis.score, default=None)
    if best is None:
        text = f'detection {msg.id!r} has no results: what is it, how sure is that?'
        raise InvalidValue(text)
    name = msg.id or best.hypothesis.class_id
    if not name:
        text = 'a detection has neither an id nor a class: a box needs a name that stays'
        raise InvalidValue(text)
    size_mm = vector_from_ros(f'detection {name!r} bbox.size', msg.bbox.size, 1e3)
    if min(size_mm) <= 0.0:
        text = f'detection {name!r}: bbox.size is {size_mm} mm; each edge must be above 0'
        raise InvalidValue(text)
    return Detection(
        id=name,
        class_id=best.hypothesis.class_id,
        score=check_finite(f'detection {name!r} score', best.hypothesis.score),
        pose=pose_from_ros(f'detection {name!r} bbox.center', msg.bbox.center),
        size_mm=size_mm,
    )


class DetectionScanner(ManagedNode):
    """See the module; while it is not active it hears, and publishes nothing.

    Raises
    ------
    ValueError
        A parameter or the list of articles cannot be used.
    """

    def __init__(self, **node_arguments: Any) -> None:  # noqa: ANN401 - rclpy's own options
        super().__init__('detection_scanner', **node_arguments)
        self._chosen = declare_parameters(self, DetectionParameters)
        self.begin()

    def set_active(self, *, active: bool) -> None:
        """Publish, or not."""
        if active:
            self._publish()

    def make(self) -> None:
        """All that hears and tells."""
        parameters = self._chosen
        known = articles(parameters.articles)
        self._tracker = DetectionTracker(parameters, known)
        self._frames = ScanFrames(self, parameters.frame_prefix)
        session = new_session()
        self._scans = SourcedPublisher(self, BoxScan, 'box_scan', session)
        self._events = SourcedPublisher(self, BoxEvent, 'box_event', session)
        sources = Sources(self, (BELT, session))
        for kind, topic, take in (
            (BoxEvent, 'box_event', self._on_event),
            (PlacementDecision, 'placements', self._on_decision),
        ):
            self.create_subscription(kind, topic, sources.checked(topic, take), TOPICS[topic])
        self.create_subscription(
            Detection3DArray, 'detections', self._on_detections, qos_profile_sensor_data
        )
        self.create_timer(PERIOD_S, self._publish)
        self.get_logger().info(f'waiting for detections; {len(known)} articles are known')

    def _on_detections(self, msg: Detection3DArray) -> None:
        stamp_s = time_from_ros(msg.header.stamp)
        seen: dict[str, Detection] = {}
        for item in msg.detections:
            try:
                found = detection_from_ros(item)
                frame = item.header.frame_id or msg.header.frame_id
                within = self._frames.pose_in_cell(frame, stamp_s)
            except ValueError as error:
                self._complain(str(error))
                continue
            if found.id in seen:
                self._complain(f'detection {found.id!r} is there twice; the first one counts')
                continue
            seen[found.id] = Detection(
                found.id, found.class_id, found.score, composed(within, found.pose), found.size_mm
            )
        for text in self._tracker.on_detections(seen.values(), stamp_s):
            self.get_logger().error(text)
        self._publish()

    def _on_event(self, msg: BoxEvent) -> None:
        try:
            self._tracker.on_event(event_from_ros(msg))
        except ValueError as error:
            self._complain(f'box_event ignored: {error}')

    def _on_decision(self, msg: PlacementDecision) -> None:
        try:
            self._tracker.on_decision(decision_from_ros(msg))
        except ValueError as error:
            self._complain(f'placements ignored: {error}')

    def _publish(self) -> None:
        if not self.is_active:
            return
        now_s = 1e-9 * self.get_clock().now().nanoseconds
        for event in self._tracker.forget(now_s):
            self._events.publish(event_to_ros(event))
        self._scans.publish(scan_to_ros(self._tracker.scan(now_s)))

    def _complain(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=THROTTLE_S)


def main(args: list[str] | None = None) -> None:
    """Run the node until it is told to end; exit code 2 when it cannot start as asked."""
    run_node('detection_scanner', DetectionScanner, args=args)


if __name__ == '__main__':
    main()
