"""Recorded messages to values of the cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from functools import cache
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message

from pack_cell.recording.heard import (
    ArmMode,
    FixedFrame,
    Heard,
    JointPositions,
    RobotText,
    RobotTimes,
)
from pack_cell.recording.messages import RecordedMessage, RecordedTopic
from pack_cell.recording.reading import NoRecording, read_messages
from pack_cell.ros.message_definitions import installed_type_hash, message_class
from pack_msgs_py.codes import Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions
from pack_planner.coordination.planning_record import record_from_json

CLOCK = '/clock'


def recorded_values(paths: Sequence[Path]) -> list[Heard]:
    """What the recordings of a run say of the cell, in the order in which it was said.

    Topics that the cell does not know, and messages that cannot be read, are left out.

    Raises
    ------
    NoRecording
        A file cannot be read, or they hold nothing of a cell, or that of another version.
    """
    every = (message for path in paths for message in read_messages(path))
    messages = sorted(every, key=lambda message: message.published_ns)
    if not messages:
        msg = f'{paths[0]} holds no message'
        raise NoRecording(msg)
    clocks = [(m.published_ns, _nanoseconds(m)) for m in messages if m.topic.name == CLOCK]
    times = RobotTimes(clocks, messages[0].published_ns)
    heard = []
    for message in messages:
        topic = message.topic.name.rsplit('/', 1)[1]
        for value in _values(topic, message):
            heard.append(Heard(times.at(message.published_ns), topic, value))
    if not any(each.topic in ('bin_state', 'placements') for each in heard):
        raise NoRecording(_nothing_of_a_cell(paths[0], {message.topic for message in messages}))
    return heard


def _nothing_of_a_cell(path: Path, topics: Set[RecordedTopic]) -> str:
    others = sorted({topic.type_name for topic in topics if not _is_installed(topic)})
    if others:
        return (
            f'{path} was recorded with other versions of {", ".join(others)}: replay it with the '
            'version of the cell that recorded it; summary.json names it'
        )
    return f'{path} holds nothing of a cell'


@cache
def _is_installed(topic: RecordedTopic) -> bool:
    """Whether messages of ``topic`` are what this installation takes them for."""
    installed = installed_type_hash(topic.type_name)
    return not (installed and topic.type_hash) or installed == topic.type_hash


def _nanoseconds(message: RecordedMessage) -> int:
    clock: Time = _message(message).clock
    return int(clock.sec) * 1_000_000_000 + int(clock.nanosec)


def _message(message: RecordedMessage) -> Any:  # noqa: ANN401 - rclpy is not typed
    return deserialize_message(message.data, message_class(message.topic.type_name))


def _values(topic: str, message: RecordedMessage) -> list[Any]:
    read = _READERS.get(topic)
    if read is None or not _is_installed(message.topic):
        return []
    try:
        values = read(_message(message))
    except (ValueError, LookupError, RuntimeError, MemoryError):
        return []
    return values if isinstance(values, list) else [values]


def _frames(msg: Any) -> list[FixedFrame]:  # noqa: ANN401 - rclpy is not typed
    frames = []
    for stamped in msg.transforms:
        at, turn = stamped.transform.translation, stamped.transform.rotation
        pose = Pose((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
        frames.append(FixedFrame(stamped.child_frame_id, stamped.header.frame_id, pose))
    return frames


_READERS: Mapping[str, Callable[[Any], Any]] = {
    'box_scan': lambda msg: conversions.scan_from_ros(msg)[0],
    'bin_state': conversions.bins_from_ros,
    'bin_closed': conversions.bin_from_ros,
    'bin_closing': conversions.closing_from_ros,
    'placements': conversions.decision_from_ros,
    'placement_report': conversions.report_from_ros,
    'box_event': conversions.event_from_ros,
    'planning_record': lambda msg: record_from_json(msg.data),
    'executor_state': lambda msg: ArmMode(Mode(msg.mode), msg.message),
    'joint_states': lambda msg: JointPositions(tuple(msg.name), tuple(msg.position)),
    'robot_description': lambda msg: RobotText(msg.data),
    'tf_static': _frames,
}
