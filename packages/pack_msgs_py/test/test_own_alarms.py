"""What stands in a node is what the node says."""

from __future__ import annotations

import queue

import pytest

pytest.importorskip('rclpy')

from rclpy.node import Node

from pack_msgs.msg import Alarm, AlarmArray
from pack_msgs_py.alarms import raised
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import alarms_to_ros
from pack_msgs_py.ros.own_alarms import OwnAlarms
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros

TIMEOUT_S = 30.0
JAM = raised('JAM', 'the belt has jammed', 50.0)


@pytest.fixture
def talk(domain):
    """A node with alarms, an outlet of somebody else, and what is heard."""
    with Spinner(domain=domain) as spinner:
        node, other = (Node(name, context=spinner.context) for name in ('belt', 'other'))
        said, heard = queue.Queue(), queue.Queue()
        alarms = OwnAlarms(node, lambda name, standing: said.put((name, standing)))
        outlet = other.create_publisher(AlarmArray, 'alarms', qos.TOPICS['alarms'])
        other.create_subscription(AlarmArray, 'alarms', heard.put, qos.ALARMS_HEARD)
        spinner.add(node)
        spinner.add(other)
        yield alarms, outlet, said, heard


def next_codes(heard, node):
    while (msg := heard.get(timeout=TIMEOUT_S)).node != node:
        pass
    return [alarm.code for alarm in msg.alarms]


@pytest.mark.parametrize('standing', [(), (JAM,)])
def test_what_somebody_else_says_in_the_name_of_a_node_is_set_right(talk, standing):
    alarms, outlet, _, heard = talk
    alarms.publish(standing)
    codes = [alarm.code for alarm in standing]
    assert next_codes(heard, '/belt') == codes
    forged = () if standing else (JAM,)
    outlet.publish(alarms_to_ros('/belt', forged, 60.0))
    assert next_codes(heard, '/belt') == [alarm.code for alarm in forged]
    assert next_codes(heard, '/belt') == codes


def test_a_node_hears_what_stands_in_others_and_leaves_what_cannot_be(talk):
    _, outlet, said, _ = talk
    outlet.publish(alarms_to_ros('\x1b[2J', (JAM,), 50.0))
    outlet.publish(AlarmArray(node='/other', alarms=[Alarm(code='JAM', severity=0)]))
    outlet.publish(alarms_to_ros('/other', (JAM,), 50.0))
    name, standing = said.get(timeout=TIMEOUT_S)
    assert (name, [alarm.code for alarm in standing]) == ('/other', ['JAM'])
