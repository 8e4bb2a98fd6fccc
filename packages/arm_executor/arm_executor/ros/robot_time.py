"""Tells robot time on `robot_time`, as `/clock` tells that of a simulation (imports ROS).

Under its own name, since the nodes of the cell live by the clock on the wall unless they are told
otherwise; on `/clock` too when that is asked for. A recording has it as `/clock`.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from pack_msgs_py.ros.conversions import time_to_ros

#: While no robot time passes it is told every so many times that it is asked to.
_STANDING_STILL = 20


class RobotTime:
    """The publishers.

    What is told begins at the time on the wall at which the node was made.

    Parameters
    ----------
    node : whose publishers they are; it may take its time from `/clock` itself.
    robot_time : robot seconds since the start.
    as_clock : tell it on `/clock` too.
    paced : it passes no faster than on the wall, so that one can well say what it is between two
        that were told: half of them are, unless somebody lives by `/clock`.
    """

    def __init__(
        self, node: Node, robot_time: Callable[[], float], *, as_clock: bool, paced: bool = False
    ) -> None:
        self._robot_time = robot_time
        self._start_s = time.time()
        self._told_s = -1.0
        self._as_clock = as_clock
        self._passing = 2 if paced and not as_clock else 1
        self._asked = self._passing
        self._publishers = [node.create_publisher(Clock, 'robot_time', 10)]
        if as_clock:
            self._publishers.append(node.create_publisher(Clock, '/clock', 10))

    def tell_at_once(self) -> None:
        """Something has happened: whoever lives by `/clock` hears the time before it hears that."""
        if self._as_clock:
            self.tell()

    def tell(self) -> float:
        """Say what time it is, when it has changed or was not said for long; returns it."""
        now_s = self._robot_time()
        self._asked += 1
        if self._asked >= (self._passing if now_s != self._told_s else _STANDING_STILL):
            self._told_s, self._asked = now_s, 0
            for publisher in self._publishers:
                publisher.publish(Clock(clock=time_to_ros(self._start_s + now_s)))
        return now_s
