"""The recorder hears every topic of its namespace, and keeps the last seconds before a fault."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from pack_cell.recording.reading import find_recordings, read_messages
from pack_cell.ros.message_definitions import message_definition
from pack_cell.ros.topic_recorder import TopicRecorder
from pack_msgs.msg import AlarmArray, ExecutorState
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.codes import Severity
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import alarms_to_ros
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros

WARNING = Severity.WARNING


def recorder_in(spinner: Spinner, folder: Path, **given: str) -> TopicRecorder:
    values = {'file': str(folder / 'run.mcap'), 'state_dir': str(folder / 'state'), **given}
    return TopicRecorder(
        context=spinner.context,
        namespace='cell_1',
        parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
    )


def wait_until(condition, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, condition
        time.sleep(0.01)


def test_topics_of_the_namespace_are_recorded_with_what_was_said_before(
    ros_domain: int, tmp_path: Path
) -> None:
    with Spinner(domain=ros_domain) as spinner:
        speaker = Node('speaker', namespace='cell_1', context=spinner.context)
        words = speaker.create_publisher(String, 'words', qos.STATE)
        clock = speaker.create_publisher(Clock, 'robot_time', 10)
        other = speaker.create_publisher(String, '/cell_2/words', qos.STATE)
        words.publish(String(data='before'))
        other.publish(String(data='of another cell'))
        spinner.add(speaker)
        recorder = recorder_in(spinner, tmp_path)
        spinner.add(recorder, recorder.close)
        wait_until(lambda: clock.get_subscription_count() and words.get_subscription_count())
        wait_until(lambda: recorder.heard)
        heard = recorder.heard
        words.publish(String(data='after'))
        clock.publish(Clock())
        wait_until(lambda: recorder.heard >= heard + 2)
    messages = list(read_messages(tmp_path / 'run.mcap', {'/cell_1/words', '/clock'}))
    said = [m.data[8:-1].decode() for m in messages if m.topic.name == '/cell_1/words']
    assert said == ['before', 'after']
    [of_words] = {m.topic for m in messages if m.topic.name == '/cell_1/words'}
    assert of_words.is_kept_for_late_joiners
    assert of_words.type_hash.startswith('RIHS01_')
    assert [m.topic.type_name for m in messages if m.topic.name == '/clock'] == [
        'rosgraph_msgs/msg/Clock'
    ]
    names = {message.topic.name for message in read_messages(tmp_path / 'run.mcap')}
    assert '/cell_2/words' not in names


def test_a_fault_is_kept_also_when_nothing_is_recorded(ros_domain: int, tmp_path: Path) -> None:
    with Spinner(domain=ros_domain) as spinner:
        arm = Node('arm', namespace='cell_1', context=spinner.context)
        state = arm.create_publisher(ExecutorState, 'executor_state', qos.TOPICS['executor_state'])
        spinner.add(arm)
        recorder = recorder_in(spinner, tmp_path, file='')
        spinner.add(recorder, recorder.close)
        wait_until(state.get_subscription_count)
        for mode in (ExecutorState.MODE_EXECUTING, ExecutorState.MODE_PROTECTIVE_STOP):
            heard = recorder.heard
            state.publish(ExecutorState(mode=mode))
            wait_until(lambda before=heard: recorder.heard > before)
    assert not (tmp_path / 'run.mcap').exists()
    [folder] = (tmp_path / 'state' / 'faults' / 'ARM_PROTECTIVE_STOP').iterdir()
    kept = [m for m in read_messages(find_recordings(folder)[0]) if m.topic.name.endswith('_state')]
    assert len(kept) == 2


def test_an_alarm_that_stands_is_kept_once_under_its_code(ros_domain: int, tmp_path: Path) -> None:
    jam = alarms_to_ros('conveyor', [Alarm('JAM', 'the belt stands'), Alarm('w', '', WARNING)], 1.0)
    with Spinner(domain=ros_domain) as spinner:
        conveyor = Node('conveyor', namespace='cell_1', context=spinner.context)
        alarms = conveyor.create_publisher(AlarmArray, 'alarms', 10)
        spinner.add(conveyor)
        recorder = recorder_in(spinner, tmp_path)
        spinner.add(recorder, recorder.close)
        wait_until(alarms.get_subscription_count)
        for _ in range(2):
            heard = recorder.heard
            alarms.publish(jam)
            wait_until(lambda before=heard: recorder.heard > before)
    [folder] = (tmp_path / 'state' / 'faults').glob('*/*')
    assert folder.parent.name == 'JAM'


def test_a_definition_holds_every_message_that_it_is_made_of() -> None:
    text = message_definition('pack_msgs/msg/BoxScan')
    inner = [line.removeprefix('MSG: ') for line in text.splitlines() if line.startswith('MSG: ')]
    assert set(inner) >= {
        'std_msgs/Header', 'builtin_interfaces/Time', 'builtin_interfaces/Duration',
        'geometry_msgs/Vector3', 'geometry_msgs/Pose', 'geometry_msgs/Point',
        'geometry_msgs/Quaternion', 'pack_msgs/ScannedBox', 'pack_msgs/Box',
    }  # fmt: skip
    assert len(inner) == len(set(inner))
    assert message_definition('no_msgs/msg/Nothing') == ''
