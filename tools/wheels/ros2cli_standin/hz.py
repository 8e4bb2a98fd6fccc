"""``ros2 topic hz``: how often a topic is published."""

from __future__ import annotations

import argparse
import math
import time
from collections import deque

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.qos import qos_profile_sensor_data

from ros2cli_standin.graph import add_discovery_arguments, open_node
from ros2cli_standin.topics import topic_class

DEFAULT_WINDOW_SIZE = 10000
_SECOND = 1_000_000_000


def _positive_int(text: str) -> int:
    value = int(text) if text.isdigit() else 0
    if value <= 0:
        raise argparse.ArgumentTypeError('value must be a positive integer')
    return value


def add_hz(parser: argparse.ArgumentParser) -> None:
    """Print the average publishing rate to screen."""
    add_discovery_arguments(parser)
    parser.add_argument('topic_name', help="Name of the ROS topic to listen to (e.g. '/chatter')")
    parser.add_argument(
        '--window',
        '-w',
        dest='window_size',
        type=_positive_int,
        default=DEFAULT_WINDOW_SIZE,
        metavar='WINDOW',
        help='window size, in # of messages, for calculating rate (default: %(default)s)',
    )
    parser.add_argument(
        '--filter',
        dest='filter_expr',
        metavar='EXPR',
        help='only measure messages matching the specified Python expression',
    )
    parser.add_argument('--wall-time', action='store_true', help='calculates rate using wall time')
    parser.set_defaults(run=_hz)


class Rate:
    """Intervals between messages, in nanoseconds of the clock that stamps them."""

    def __init__(self, window: int) -> None:
        self._intervals: deque[int] = deque(maxlen=window)
        self._last = -1
        self._printed = 0

    def tick(self, now: int) -> None:
        """Note a message that came at ``now``; start anew when time went backwards."""
        if self._last < 0 or now < self._last:
            self._intervals.clear()
        else:
            self._intervals.append(now - self._last)
        self._last = now

    def report(self) -> str | None:
        """The rate so far, at most once per second of the clock."""
        if not self._intervals:
            return None
        if not self._printed:
            self._printed = self._last
            return None
        if self._last < self._printed + _SECOND:
            return None
        self._printed = self._last
        count = len(self._intervals)
        mean = sum(self._intervals) / count
        deviation = math.sqrt(sum((interval - mean) ** 2 for interval in self._intervals) / count)
        rate = _SECOND / mean if mean > 0 else 0.0
        return (
            f'average rate: {rate:.3f}\n'
            f'\tmin: {min(self._intervals) / _SECOND:.3f}s '
            f'max: {max(self._intervals) / _SECOND:.3f}s '
            f'std dev: {deviation / _SECOND:.5f}s window: {count}'
        )


def _hz(arguments: argparse.Namespace) -> None:
    topic = arguments.topic_name
    with open_node(arguments, lambda node: topic_class(node, topic) is not None) as node:
        message_type = topic_class(node, topic)
        if message_type is None:
            print(f'WARNING: topic [{topic}] does not appear to be published yet')
        while message_type is None:
            time.sleep(0.1)
            message_type = topic_class(node, topic)
        rate = Rate(arguments.window_size)
        clock = Clock(clock_type=ClockType.SYSTEM_TIME) if arguments.wall_time else node.get_clock()

        def on_message(message: object) -> None:
            if arguments.filter_expr and not eval(arguments.filter_expr, {'m': message}):
                return
            now = clock.now().nanoseconds
            # Simulated time that has not begun yet.
            if now:
                rate.tick(now)

        node.create_subscription(message_type, topic, on_message, qos_profile_sensor_data)
        while rclpy.ok():
            rclpy.spin_once(node)
            report = rate.report()
            if report:
                print(report)
