"""Messages as a recorder hears them, for tests."""

from __future__ import annotations

from pack_cell.recording.messages import RecordedMessage, RecordedTopic

FOREVER = {'sec': 9223372036, 'nsec': 854775807}
#: What a publisher that keeps its last words offers, as rosbag2 writes it.
KEPT = {
    'history': 'unknown',
    'depth': 0,
    'reliability': 'reliable',
    'durability': 'transient_local',
    'deadline': FOREVER,
    'lifespan': FOREVER,
    'liveliness': 'automatic',
    'liveliness_lease_duration': FOREVER,
    'avoid_ros_namespace_conventions': False,
}
HASH = 'RIHS01_' + 'ab' * 32


def topic(name: str = '/cell_1/words') -> RecordedTopic:
    return RecordedTopic(name, 'std_msgs/msg/String', 'string data\n', (KEPT,), HASH)


def cdr_string(text: str) -> bytes:
    """`std_msgs/msg/String` in CDR."""
    body = text.encode() + b'\0'
    return b'\x00\x01\x00\x00' + len(body).to_bytes(4, 'little') + body


def message(text: str, heard_s: float, on: RecordedTopic | None = None) -> RecordedMessage:
    heard_ns = round(1e9 * heard_s)
    return RecordedMessage(on or topic(), heard_ns, heard_ns - 1000, cdr_string(text))
