"""Messages go by UDP: no memory is shared, and another user of the machine hears them too."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros

TOOLS = Path(__file__).resolve().parents[1] / 'tools'
TALK = """
import rclpy, time
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('talker')
chat = node.create_publisher(String, 'chat', 10)
until = time.monotonic() + 60
while time.monotonic() < until:
    chat.publish(String(data='hello'))
    rclpy.spin_once(node, timeout_sec=0.05)
"""
LISTEN = """
import rclpy, time
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('listener')
heard = []
node.create_subscription(String, 'chat', heard.append, 10)
until = time.monotonic() + 20
while not heard and time.monotonic() < until:
    rclpy.spin_once(node, timeout_sec=0.1)
print(len(heard), sum('/dev/shm/fastrtps' in line for line in open('/proc/self/maps')))
"""
#: Nobody, who can read what is installed and write nothing.
OTHER_USER = 65534


def environment() -> dict[str, str]:
    """The environment as `env.sh` makes it where nothing was set before."""
    words = ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'FASTRTPS_', 'FASTDDS_')
    clean = {key: value for key, value in os.environ.items() if not key.startswith(words)}
    script = f'cell_tools={TOOLS}; source {TOOLS}/transport.sh; env -0'
    text = subprocess.run(
        ['bash', '-c', script], env=clean, check=True, capture_output=True, text=True
    ).stdout
    return dict(line.partition('=')[::2] for line in text.split('\0') if line)


def heard_and_shared(tmp_path: Path, user: int | None) -> str:
    """What a listener of ``user`` prints that hears a talker of this user."""
    settings = environment() | {'HOME': '/tmp'}
    talker = subprocess.Popen([sys.executable, '-c', TALK], env=settings)
    try:
        return subprocess.run(
            [sys.executable, '-c', LISTEN],
            env=settings | {'ROS_LOG_DIR': '/tmp/ros-of-another' if user else str(tmp_path)},
            user=user,
            extra_groups=None if user is None else [],
            check=True,
            capture_output=True,
            text=True,
            timeout=60,
        ).stdout.strip()
    finally:
        talker.kill()
        talker.wait()


def test_processes_of_one_machine_talk_and_share_no_memory(ros_domain: int, tmp_path: Path) -> None:
    assert heard_and_shared(tmp_path, None) == '1 0'


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can be another user')
def test_another_user_of_the_machine_hears_the_cell(ros_domain: int, tmp_path: Path) -> None:
    try:
        subprocess.run([sys.executable, '-V'], user=OTHER_USER, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip('another user cannot run this Python')
    assert heard_and_shared(tmp_path, OTHER_USER) == '1 0'


def test_who_says_how_far_nodes_are_heard_gets_that() -> None:
    script = f'cell_tools={TOOLS}; source {TOOLS}/transport.sh; env'
    given = {'PATH': os.environ['PATH'], 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    text = subprocess.run(
        ['bash', '-c', script], env=given, check=True, capture_output=True, text=True
    ).stdout
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET' in text
    assert f'FASTRTPS_DEFAULT_PROFILES_FILE={TOOLS}/fastdds_network.xml' in text
