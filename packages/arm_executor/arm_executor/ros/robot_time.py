"""Tells robot time on `robot_time`, as `/clock` tells that of a simulation (imports ROS).

Under its own name, since the nodes of the cell live by the clock on the wall; a recording has it as
`/clock`.
"""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from pack_msgs_py.ros.conversions import time_from_ros, time_to_ros

#: While no robot time passes it is told every so many times that it is asked to.
_STANDING_STILL = 20


class RobotTime:
    """The publisher; ``robot_time`` gives robot seconds since the start.

    What is told begins at the time on the wall at which the node was made.
    """

    def __init__(self, node: Node, robot_time: Callable[[], float]) -> None:
        self._robot_time = robot_time
        self._start_s = time_from_ros(node.get_clock().now().to_msg())
        self._told_s, self._still = -1.0, 0
        self._publisher = node.create_publisher(Clock, 'robot_time', 10)

    def tell(self) -> float:
        """Say what time it is, when it has changed or was not said for long; returns it."""
        now_s = self._robot_time()
        self._still = 0 if now_s != self._told_s else self._still + 1
        if self._still % _STANDING_STILL == 0:
            self._told_s = now_s
            self._publisher.publish(Clock(clock=time_to_ros(self._start_s + now_s)))
        return now_s
