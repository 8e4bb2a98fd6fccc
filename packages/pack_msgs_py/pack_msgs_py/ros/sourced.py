"""Topics of the cell: said with one's own source, heard from the one that is believed."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from pack_msgs.msg import BoxEvent, PlacementDecision, Source
from pack_msgs_py.one_source import NAMED_SOURCES, OneSource
from pack_msgs_py.ros import qos

ARM, BELT, PLANNER = 'the arm', 'the belt', 'the planner'
#: After so many seconds without a word each is dead: the heartbeat comes ten times a second, a scan
#: once a second, and a decision when it comes.
SILENT_S = {ARM: 1.1, BELT: 1.5, PLANNER: 0.0}
#: Who speaks on each topic; on `box_event` the arm and the belt do.
SPEAKERS = {
    'box_scan': BELT,
    qos.TRUE_BOXES: BELT,
    'bin_state': ARM,
    'bin_closed': ARM,
    'placement_report': ARM,
    'executor_state': ARM,
    'placements': PLANNER,
}
#: What comes so much later than its stamp is told of, on the topics that are sent at once.
LATE_S, FRESH = 3.0, ('box_scan', 'executor_state')
#: Clocks of two computers may differ so much, seconds.
AHEAD_S = 5.0
THROTTLE_S = 5.0
#: How often it is looked whether one that was started again is to be believed, seconds.
SETTLE_PERIOD_S = 0.25


def source_of(msg: Any) -> Source:  # noqa: ANN401 - any message of the topics above
    """Where a message says who says it; a decision does so in the order that it holds."""
    source: Source = msg.placement.source if isinstance(msg, PlacementDecision) else msg.source
    return source


class SourcedPublisher:
    """Publishes on ``topic`` with its QoS, and says of each message that ``session`` said it."""

    def __init__(self, node: Node, kind: type, topic: str, session: int) -> None:
        self._publisher = node.create_publisher(kind, topic, qos.TOPICS[topic])
        self._session, self._number = session, 0

    def publish(self, msg: Any) -> None:  # noqa: ANN401 - any message with a source
        """Number ``msg`` and send it."""
        self._number += 1
        source = source_of(msg)
        source.session, source.number = self._session, self._number
        self._publisher.publish(msg)

    def assert_liveliness(self) -> None:
        """Tell that the thread behind a heartbeat runs, though it may have nothing to say."""
        self._publisher.assert_liveliness()


class Sources:
    """Whom ``node`` believes.

    Parameters
    ----------
    node : who listens.
    own : the session of the node, and as which part it speaks itself; ``None`` for an observer.
    """

    def __init__(self, node: Node, own: tuple[str, int] | None = None) -> None:
        self._node = node
        self._goals = 0
        since = int(os.environ.get(NAMED_SOURCES) or 0)
        self._parts = {
            part: OneSource(part, silent_s, since=since) for part, silent_s in SILENT_S.items()
        }
        if own is not None:
            part, session = own
            self._parts[part] = OneSource(part, own=session, since=since)
        node.create_timer(SETTLE_PERIOD_S, self._settle)

    def _settle(self) -> None:
        now_s = time.monotonic()
        for part in self._parts.values():
            part.settle(now_s)

    def checked(self, topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """``take``, which gets the messages of ``topic`` of the source that is believed.

        It may get them a little later, and must not raise. Of a topic that is no part of the cell
        alone it gets all.
        """
        if topic not in SPEAKERS and topic != 'box_event':
            return take

        def receive(msg: Any) -> None:  # noqa: ANN401 - any message with a source
            source = source_of(msg)
            why = self._ahead(topic, msg) or self._part(topic, msg).hear(
                topic,
                (source.session, source.number),
                lambda: take(msg),
                now_s=time.monotonic(),
                epoch_s=time.time(),
            )
            if why:
                self._node.get_logger().warning(why, throttle_duration_sec=THROTTLE_S)

        return receive

    def _ahead(self, topic: str, msg: Any) -> str:  # noqa: ANN401 - any message with a header
        """Why a message is left whose stamp has not come yet; tells of a late one."""
        header = msg.placement.header if isinstance(msg, PlacementDecision) else msg.header
        stamp_s = header.stamp.sec + 1e-9 * header.stamp.nanosec
        now_s = 1e-9 * self._node.get_clock().now().nanoseconds
        if not now_s:  # nobody has told the time yet
            return ''
        age_s = now_s - stamp_s
        if age_s < -AHEAD_S:
            return (
                f'{topic} ignored: its stamp is {-age_s:.1f} s ahead, at most {AHEAD_S:g} s will '
                'do; do the clocks agree?'
            )
        if topic in FRESH and age_s > LATE_S:
            text = f'{topic} is {age_s:.1f} s old: is who sends it busy, do the clocks agree?'
            self._node.get_logger().warning(text, throttle_duration_sec=THROTTLE_S)
        return ''

    def goal(self, session: int, take: Callable[[], None]) -> str:
        """A goal has come from a planner; why it is not taken, empty when it is."""
        self._goals += 1
        return self._parts[PLANNER].hear(
            'place_box',
            (session, self._goals),
            take,
            now_s=time.monotonic(),
            epoch_s=time.time(),
        )

    def heard_again(self, topic: str) -> None:
        """``topic`` was subscribed to anew."""
        for source in self._parts.values():
            source.heard_again(topic)

    def second(self) -> str:
        """That a second source speaks for a part of the cell; empty while none does."""
        now_s = time.monotonic()
        said = (source.second(now_s) for source in self._parts.values())
        return next((text for text in said if text), '')

    def _part(self, topic: str, msg: Any) -> OneSource:  # noqa: ANN401 - any message
        if topic in SPEAKERS:
            return self._parts[SPEAKERS[topic]]
        for part in (ARM, BELT):
            if self._parts[part].believes(msg.source.session):
                return self._parts[part]
        return self._parts[BELT if msg.event == BoxEvent.REJECTED else ARM]
