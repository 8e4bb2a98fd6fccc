"""A recording is what ROS 2 tools expect, also when nobody could end it."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recorded_messages import HASH, KEPT, message, topic
from rosbag2_rules import bag_topics
from rosbags.highlevel import AnyReader

from pack_cell.recording.mcap_file import McapFile, write_mcap
from pack_cell.recording.reading import NoRecording, find_recordings, next_recording, read_messages


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / 'deep' / 'run.mcap'
    written = [message('a', 1.0), message('b', 2.0, topic('/clock')), message('c', 3.0)]
    write_mcap(path, written)
    assert list(read_messages(path)) == written
    assert list(read_messages(path, {'/clock'})) == written[1:2]


def test_readers_of_others_read_messages_types_and_quality_of_service(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    write_mcap(path, [message('a', 1.0), message('b', 2.0)])
    with path.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == 'ros2'
        words = [decoded.data for _, _, _, decoded in reader.iter_decoded_messages()]
    assert words == ['a', 'b']
    with AnyReader([path]) as bag:
        [connection] = bag.connections
        assert connection.topic == '/cell_1/words'
        [offer] = connection.ext.offered_qos_profiles
        assert (offer.durability.name, offer.reliability.name) == ('TRANSIENT_LOCAL', 'RELIABLE')
        words = [
            bag.deserialize(data, connection.msgtype).data for connection, _, data in bag.messages()
        ]
    assert words == ['a', 'b']


def test_rosbag2_takes_the_file_alone_with_its_quality_of_service(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    write_mcap(path, [message('a', 1.0), message('b', 2.5), message('c', 3.0, topic('/clock'))])
    words, clock = sorted(bag_topics(path), key=lambda each: each.messages, reverse=True)
    assert (words.name, words.type_name) == ('/cell_1/words', 'std_msgs/msg/String')
    assert (words.messages, words.offers, words.type_hash) == (2, (KEPT,), HASH)
    assert (clock.name, clock.messages) == ('/clock', 1)


def test_the_metadata_of_rosbag2_tell_the_span(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    write_mcap(path, [message('a', 1.0), message('b', 2.5)])
    with path.open('rb') as stream:
        records = [each for each in make_reader(stream).iter_metadata() if each.name == 'rosbag2']
    # The reader of rosbag2 goes through all of them: the last one counts.
    bag = yaml.safe_load(records[-1].metadata['serialized_metadata'])
    assert (bag['version'], bag['storage_identifier'], bag['message_count']) == (9, 'mcap', 2)
    assert bag['starting_time'] == {'nanoseconds_since_epoch': 1_000_000_000}
    assert bag['duration'] == {'nanoseconds': 1_500_000_000}


def test_a_file_that_nobody_ended_is_read_up_to_its_last_chunk(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    file = McapFile(path, chunk_s=1.0)
    for number in range(22):
        other = topic('/clock') if number % 2 else None
        file.add(message(str(number), 1.0 + 0.3 * number, other))
    torn = path.read_bytes()
    known = list(read_messages(path))
    assert 8 <= len(known) < 22
    assert known == sorted(known, key=lambda one: one.heard_ns), 'by time, whatever the topic'
    for cut in range(len(torn) - 40, len(torn)):
        path.write_bytes(torn[:cut])
        read = list(read_messages(path))
        assert read == known[: len(read)]
    file.close()


def test_silence_ends_a_chunk_too(tmp_path: Path) -> None:
    path = tmp_path / 'run.mcap'
    file = McapFile(path, chunk_s=1.0)
    file.add(message('the last word for long', 1.0))
    file.end_chunk(round(1.5e9))
    assert list(read_messages(path)) == []
    file.end_chunk(round(2.5e9))
    assert len(list(read_messages(path))) == 1
    file.close()


def test_a_run_that_was_resumed_goes_on_in_a_new_file(tmp_path: Path) -> None:
    made = []
    for _ in range(11):
        made.append(next_recording(tmp_path))
        made[-1].touch()
    assert made[1].name == 'run-2.mcap'
    assert find_recordings(tmp_path) == made


def test_what_is_no_recording_is_told(tmp_path: Path) -> None:
    with pytest.raises(NoRecording, match='no such file'):
        find_recordings(tmp_path / 'nowhere')
    with pytest.raises(NoRecording, match='no recording'):
        find_recordings(tmp_path)
    text = tmp_path / 'run.mcap'
    text.write_text('boxes')
    assert find_recordings(tmp_path) == [text]
    with pytest.raises(NoRecording, match='is no MCAP file'):
        list(read_messages(text))
