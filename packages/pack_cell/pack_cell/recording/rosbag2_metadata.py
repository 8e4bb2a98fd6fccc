"""What `ros2 bag` wants to know of a file, as rosbag2 writes it into its own MCAP files.

Fields and their names are those of `rosbag2_storage/yaml.hpp` of ROS 2 Jazzy, version 9. Without
this record its reader takes the quality of service of the topics for that of an older version.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from pack_cell.recording.messages import RecordedTopic

#: Name of the metadata record, its key, and the version of what is in it.
RECORD, KEY, VERSION = 'rosbag2', 'serialized_metadata', 9


def offers_text(topic: RecordedTopic) -> str:
    """The channel's `offered_qos_profiles`."""
    return yaml.safe_dump([dict(offer) for offer in topic.offered_qos], sort_keys=False)


def bag_metadata(
    file_name: str, counts: Mapping[RecordedTopic, int], start_ns: int, end_ns: int
) -> dict[str, str]:
    """The metadata record of a file with so many messages by topic, heard between the two times."""
    span: dict[str, Any] = {
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'duration': {'nanoseconds': end_ns - start_ns},
        'message_count': sum(counts.values()),
    }
    topics = [
        {'topic_metadata': _topic_metadata(topic), 'message_count': count}
        for topic, count in counts.items()
    ]
    metadata = {
        'version': VERSION,
        'storage_identifier': 'mcap',
        **span,
        'topics_with_message_count': topics,
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file_name],
        'files': [{'path': file_name, **span}],
        'custom_data': {},
        'ros_distro': 'jazzy',
    }
    return {KEY: yaml.dump(metadata, Dumper=_PlainDumper, sort_keys=False)}


def _topic_metadata(topic: RecordedTopic) -> dict[str, Any]:
    return {
        'name': topic.name,
        'type': topic.type_name,
        'serialization_format': 'cdr',
        'offered_qos_profiles': [dict(offer) for offer in topic.offered_qos],
        'type_description_hash': topic.type_hash,
    }


class _PlainDumper(yaml.SafeDumper):
    """Writes what occurs twice twice: yaml-cpp reads references, other readers may not."""

    def ignore_aliases(self, data: object) -> bool:
        return True
