"""A listener to the conveyor that waits without sleep."""

from __future__ import annotations

import threading

import pytest
import rclpy

from conveyor_sim.streams import Reading, read_boxes
from pack_msgs.msg import BinState, BinStateArray, BoxEvent, BoxScan, PlacementDecision
from pack_msgs_py.ros.conversions import scan_from_ros
from pack_msgs_py.ros.qos import TOPICS
from pack_msgs_py.ros.testing import Spinner

#: Nothing takes that long, also on a busy machine.
TIMEOUT_S = 30.0


@pytest.fixture
def read(tmp_path):
    """Read a text, or bytes, as a box list of that name."""

    def _read(text, name='list.csv', **reading):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_boxes(path, Reading(**reading))

    return _read


@pytest.fixture
def spinner(ros_domain):
    with Spinner() as made:
        yield made


class Observer:
    """The rest of the cell, as far as the conveyor knows it."""

    def __init__(self, context):
        self.node = rclpy.create_node('observer', context=context)
        self._news = threading.Condition()
        self.scans = []
        self.rejections = []
        self.node.create_subscription(BoxScan, 'box_scan', self._on_scan, TOPICS['box_scan'])
        self.node.create_subscription(BoxEvent, 'box_event', self._on_event, TOPICS['box_event'])
        kinds = {
            'placements': PlacementDecision,
            'box_event': BoxEvent,
            'bin_state': BinStateArray,
            'bin_closed': BinState,
        }
        self._publishers = {
            topic: self.node.create_publisher(kind, topic, TOPICS[topic])
            for topic, kind in kinds.items()
        }

    def send(self, topic, msg):
        self._publishers[topic].publish(msg)

    def picked(self, box_id):
        msg = BoxEvent(box_id=box_id, event=BoxEvent.PICKED)
        msg.header.stamp = self.node.get_clock().now().to_msg()
        return msg

    def stamp(self):
        return self.node.get_clock().now().nanoseconds * 1e-9

    def wait_for(self, condition):
        """The first scan, from the newest one on, for which ``condition`` holds."""
        with self._news:
            met = self._news.wait_for(lambda: self.scans and condition(self.scans[-1]), TIMEOUT_S)
            last = self.scans[-1] if self.scans else None
            assert met, f'no such scan within {TIMEOUT_S} s; the last was {last}'
            return last

    def wait_for_rejection(self, box_id):
        with self._news:
            find = lambda: [e for e in self.rejections if e.box_id == box_id]  # noqa: E731
            assert self._news.wait_for(find, TIMEOUT_S), f'{box_id} was not rejected'
            return find()[0]

    def _on_scan(self, msg):
        scan, errors = scan_from_ros(msg)
        assert errors == []
        with self._news:
            self.scans.append(scan)
            self._news.notify_all()

    def _on_event(self, msg):
        if msg.event == BoxEvent.REJECTED:
            with self._news:
                self.rejections.append(msg)
                self._news.notify_all()


@pytest.fixture
def observer(spinner):
    made = Observer(spinner.context)
    spinner.add(made.node)
    return made
