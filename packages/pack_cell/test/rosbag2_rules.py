"""A recording as the reader of rosbag2 takes it, step by step, in ROS 2 Jazzy.

After `MCAPStorage::read_metadata` of `rosbag2_storage_mcap/src/mcap_storage.cpp` and the `decode`
functions of `rosbag2_storage/yaml.hpp` and `qos.cpp`; where those throw, this raises.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from mcap.reader import make_reader

#: What `rmw_qos_..._policy_from_str` of rmw knows.
POLICIES = {
    'history': {'system_default', 'keep_last', 'keep_all', 'unknown'},
    'reliability': {'system_default', 'reliable', 'best_effort', 'best_available', 'unknown'},
    'durability': {'system_default', 'transient_local', 'volatile', 'best_available', 'unknown'},
    'liveliness': {'system_default', 'automatic', 'manual_by_topic', 'best_available', 'unknown'},
}
TIMES = ('deadline', 'lifespan', 'liveliness_lease_duration')


@dataclass(frozen=True)
class BagTopic:
    """What `ros2 bag info` tells of a topic, and `ros2 bag play` publishes it with."""

    name: str
    type_name: str
    messages: int
    offers: tuple[dict[str, Any], ...]
    type_hash: str


def bag_topics(path: Path) -> list[BagTopic]:
    """Topics of a file that has its end."""
    with path.open('rb') as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == 'ros2'
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None, 'the file has no end'
        assert all(chunk.message_index_length for chunk in summary.chunk_indexes), (
            'cannot be sorted'
        )
        version = 8  # without a record the reader takes it for an older file
        for record in reader.iter_metadata():
            if record.name == 'rosbag2':
                version = _bag_metadata(record.metadata['serialized_metadata'])
        topics = []
        for number, channel in summary.channels.items():
            schema = summary.schemas[channel.schema_id]
            assert channel.message_encoding == 'cdr' and schema.encoding == 'ros2msg'
            offers = yaml.safe_load(channel.metadata['offered_qos_profiles'])
            topics.append(
                BagTopic(
                    channel.topic,
                    schema.name,
                    summary.statistics.channel_message_counts.get(number, 0),
                    tuple(_offer(offer, version) for offer in offers),
                    _type_hash(channel.metadata['topic_type_hash']),
                )
            )
        return topics


def _bag_metadata(text: str) -> int:
    """Decode the record as `convert<BagMetadata>::decode` does; its version."""
    bag = yaml.safe_load(text)
    version = _whole(bag['version'])
    assert isinstance(bag['storage_identifier'], str)
    for topic in bag['topics_with_message_count']:
        _whole(topic['message_count'])
        of_topic = topic['topic_metadata']
        for key in ('name', 'type', 'serialization_format'):
            assert isinstance(of_topic[key], str)
        for offer in of_topic['offered_qos_profiles']:
            _offer(offer, version)
        _type_hash(of_topic['type_description_hash'])
    _span(bag)
    for file in bag['files']:
        assert file['path'] in bag['relative_file_paths']
        _span(file)
    assert (bag['compression_format'], bag['compression_mode']) == ('', '')
    assert isinstance(bag['custom_data'], dict) and isinstance(bag['ros_distro'], str)
    return version


def _span(of: dict[str, Any]) -> None:
    _whole(of['starting_time']['nanoseconds_since_epoch'])
    _whole(of['duration']['nanoseconds'])
    _whole(of['message_count'])


def _offer(offer: dict[str, Any], version: int) -> dict[str, Any]:
    assert version >= 9, 'policies are words since version 9'
    for policy, words in POLICIES.items():
        assert offer[policy] in words, f'{policy} {offer[policy]!r}'
    _whole(offer['depth'])
    for key in TIMES:
        _whole(offer[key]['sec'])
        assert _whole(offer[key]['nsec']) < 1_000_000_000
    assert isinstance(offer['avoid_ros_namespace_conventions'], bool)
    return offer


def _whole(value: object) -> int:
    """An unsigned number of 64 bits."""
    assert type(value) is int and 0 <= value < 2**64, value
    return value


def _type_hash(text: str) -> str:
    assert re.fullmatch(r'RIHS01_[0-9a-f]{64}', text), text
    return text
