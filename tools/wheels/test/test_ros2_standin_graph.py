"""The stand-in `ros2` against a live node in a domain of its own."""

import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pack_msgs_py.ros.testing import Spinner
from ros2cli_standin.echo import is_published

pytestmark = pytest.mark.ros

STAND_IN = (str(Path(__file__).parents[2] / 'standin' / 'ros2'),)
STATE = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


def _answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    response.success = request.data
    response.message = 'done'
    return response


@pytest.fixture(scope='module', autouse=True)
def node(domain: int) -> Iterator[Node]:
    with Spinner(domain=domain) as spinner:
        node = rclpy.create_node('talker', namespace='/cell', context=spinner.context)
        node.declare_parameter('rate', 10.0)
        state = node.create_publisher(String, 'state', STATE)
        state.publish(String(data='once, before anyone came'))
        chatter = node.create_publisher(String, 'chatter', 10)
        node.create_timer(0.05, lambda: chatter.publish(String(data='hello')))
        node.create_service(SetBool, 'switch', _answer)
        yield spinner.add(node)


def ros2(domain: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*STAND_IN, *arguments],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def lines_with(line: str, domain: int, *arguments: str) -> list[str]:
    """What a verb lists, with ever more time for discovery until ``line`` is there.

    A list cannot know that it is complete, and on a busy machine discovery takes its time.
    """
    lines: list[str] = []
    for spin_time in ('1', '3', '9', '27'):
        lines = ros2(domain, *arguments, '--spin-time', spin_time).stdout.splitlines()
        if line in lines:
            break
    return lines


def test_topic_list_with_types(domain: int) -> None:
    wanted = '/cell/chatter [std_msgs/msg/String]'
    assert wanted in lines_with(wanted, domain, 'topic', 'list', '-t')


def test_echo_gets_the_last_state_of_a_transient_local_topic(domain: int) -> None:
    ended = ros2(domain, 'topic', 'echo', '/cell/state', '--once')
    assert (ended.stdout, ended.returncode) == ('data: once, before anyone came\n---\n', 0)


def test_echo_waits_for_a_publisher_not_for_any_endpoint(node: Node) -> None:
    listener = node.create_subscription(String, 'late', lambda _: None, 10)
    assert not is_published(node, '/cell/late')
    publisher = node.create_publisher(String, 'late', STATE)
    assert is_published(node, '/cell/late')
    node.destroy_subscription(listener)
    node.destroy_publisher(publisher)


def test_echo_of_a_field(domain: int) -> None:
    ended = ros2(domain, 'topic', 'echo', '/cell/chatter', '--once', '--field', 'data')
    assert ended.stdout == 'hello\n---\n'


def test_echo_of_an_unknown_topic(domain: int) -> None:
    ended = ros2(domain, 'topic', 'echo', 'nothing')
    assert ended.returncode == 1
    assert ended.stdout == 'WARNING: topic [nothing] does not appear to be published yet\n'
    assert ended.stderr == 'Could not determine the type for the passed topic\n'


def test_hz_measures_until_interrupted(domain: int) -> None:
    with subprocess.Popen(
        [*STAND_IN, 'topic', 'hz', '/cell/chatter'],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
    assert line.startswith('average rate: ')
    assert 5.0 < float(line.split()[-1]) < 40.0
    # rclpy may see the signal first and end the loop, between two messages or in the wait for one
    # (then ros2cli too ends with SIGTERM), or Python may raise KeyboardInterrupt
    assert process.returncode in (0, signal.SIGINT, signal.SIGTERM)


def test_topic_info_and_type(domain: int) -> None:
    ended = ros2(domain, 'topic', 'info', '/cell/chatter')
    assert ended.stdout == 'Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0\n'
    assert ros2(domain, 'topic', 'type', '/cell/chatter').stdout == 'std_msgs/msg/String\n'


def test_node_list_and_info(domain: int) -> None:
    assert lines_with('/cell/talker', domain, 'node', 'list') == ['/cell/talker']
    lines = ros2(domain, 'node', 'info', '/cell/talker').stdout.splitlines()
    assert lines[:2] == ['/cell/talker', '  Subscribers:']
    assert '    /cell/switch: std_srvs/srv/SetBool' in lines


def test_service_call(domain: int) -> None:
    values = '{data: true}'
    ended = ros2(domain, 'service', 'call', '/cell/switch', 'std_srvs/srv/SetBool', values)
    expected = "response:\nstd_srvs.srv.SetBool_Response(success=True, message='done')\n\n"
    assert ended.stdout.endswith(expected)


def test_parameters_are_listed_read_and_set(domain: int) -> None:
    assert '  rate' in ros2(domain, 'param', 'list', '/cell/talker').stdout.splitlines()
    ended = ros2(domain, 'param', 'set', '/cell/talker', 'rate', '5.5')
    assert ended.stdout == 'Set parameter successful\n'
    assert ros2(domain, 'param', 'get', 'cell/talker', 'rate').stdout == 'Double value is: 5.5\n'
    assert (
        'Setting parameter failed'
        in ros2(domain, 'param', 'set', '/cell/talker', 'rate', 'fast').stderr
    )


def test_an_unknown_node_has_no_parameters(domain: int) -> None:
    ended = ros2(domain, 'param', 'get', '/nobody', 'rate')
    assert (ended.returncode, ended.stderr) == (1, 'Node not found\n')
