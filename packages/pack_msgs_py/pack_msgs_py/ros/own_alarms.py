"""What stands in a node, on `alarms`; what others say there in its name is set right."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from rclpy.node import Node

from pack_msgs.msg import AlarmArray
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import alarms_from_ros, alarms_to_ros, time_from_ros

#: How often the node looks whether somebody else has spoken in its name, seconds.
LOOK_S = 1.0
#: Messages of its own that it may hear late.
_SENT = 20


class OwnAlarms:
    """Publishes what stands in ``node``, and tells ``others`` what stands in others.

    The arm heeds the alarms of every node. One that somebody else raised in the name of this node,
    or took back, would hold until this node has something to say; so it says it again.
    """

    def __init__(
        self, node: Node, others: Callable[[str, tuple[Alarm, ...]], None] | None = None
    ) -> None:
        self._node = node
        self._others = others
        self._standing: tuple[Alarm, ...] = ()
        self._sent: deque[float] = deque(maxlen=_SENT)
        self._contradict = False
        self._publisher = node.create_publisher(AlarmArray, 'alarms', qos.TOPICS['alarms'])
        node.create_subscription(AlarmArray, 'alarms', self._hear, qos.ALARMS_HEARD)
        node.create_timer(LOOK_S, self._look)

    def publish(self, standing: tuple[Alarm, ...]) -> None:
        """All that stands now."""
        self._standing = standing
        now_s = 1e-9 * self._node.get_clock().now().nanoseconds
        msg = alarms_to_ros(self._node.get_fully_qualified_name(), standing, now_s)
        self._sent.append(time_from_ros(msg.header.stamp))
        self._publisher.publish(msg)

    def _hear(self, msg: AlarmArray) -> None:
        try:
            if msg.node != self._node.get_fully_qualified_name():
                if self._others is not None:
                    self._others(*alarms_from_ros(msg))
            elif time_from_ros(msg.header.stamp) not in self._sent:
                self._contradict = True
        except ValueError as error:
            self._warn(f'alarms ignored: {error}')

    def _look(self) -> None:
        if self._contradict:
            self._contradict = False
            name = self._node.get_fully_qualified_name()
            self._warn(f'somebody else says on alarms what stands in {name}; it is set right')
            self.publish(self._standing)

    def _warn(self, text: str) -> None:
        self._node.get_logger().warning(text, throttle_duration_sec=5.0)
