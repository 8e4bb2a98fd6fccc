"""A recording on disk: MCAP with the profile `ros2`, compressed, readable after a crash."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from mcap.writer import CompressionType, Writer

from pack_cell.recording.messages import RecordedMessage, RecordedTopic
from pack_cell.recording.rosbag2_metadata import RECORD, bag_metadata, offers_text

#: What is said in so many seconds is compressed together; a crash loses at most that.
CHUNK_S = 10.0
#: A chunk ends earlier when it holds so many bytes: snapshots that repeat themselves compress well.
CHUNK_BYTES = 4 * 1024 * 1024


class McapFile:
    """Appends messages to a new file at ``path``.

    Raises
    ------
    OSError
        From every method: the file cannot be written.
    """

    def __init__(self, path: Path, chunk_s: float = CHUNK_S) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._chunk_ns = round(1e9 * chunk_s)
        self._stream = path.open('wb')
        self._writer = Writer(
            self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD
        )
        self._channels: dict[RecordedTopic, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[RecordedTopic] = Counter()
        self._span_ns = (0, 0)
        self._chunk_began_ns = 0
        self._writer.start(profile='ros2', library='pack_cell')
        # The one that counts is written last; this one serves a file that has no end.
        self._writer.add_metadata(RECORD, bag_metadata(path.name, {}, 0, 0))
        self._stream.flush()

    def add(self, message: RecordedMessage) -> None:
        """Append one message."""
        heard_ns = message.heard_ns
        start_ns, end_ns = self._span_ns if self._counts else (heard_ns, heard_ns)
        self._span_ns = min(start_ns, heard_ns), max(end_ns, heard_ns)
        self._chunk_began_ns = self._chunk_began_ns or heard_ns
        self._writer.add_message(
            self._channel(message.topic), heard_ns, message.data, message.published_ns
        )
        self._counts[message.topic] += 1
        self.end_chunk(heard_ns)

    def end_chunk(self, now_ns: int) -> None:
        """Write out what is old enough by ``now_ns``, nanoseconds since the epoch."""
        if self._chunk_began_ns and now_ns - self._chunk_began_ns > self._chunk_ns:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._chunk_began_ns = 0

    def close(self) -> None:
        """End the file with its index."""
        self._writer.add_metadata(
            RECORD, bag_metadata(self._path.name, self._counts, *self._span_ns)
        )
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.close()

    def _channel(self, topic: RecordedTopic) -> int:
        if topic not in self._channels:
            schema = self._schemas.get(topic.type_name)
            if schema is None:
                schema = self._writer.register_schema(
                    topic.type_name, 'ros2msg', topic.definition.encode()
                )
                self._schemas[topic.type_name] = schema
            metadata = {
                'offered_qos_profiles': offers_text(topic),
                'topic_type_hash': topic.type_hash,
            }
            self._channels[topic] = self._writer.register_channel(
                topic.name, 'cdr', schema, metadata
            )
        return self._channels[topic]


def write_mcap(path: Path, messages: Iterable[RecordedMessage]) -> None:
    """Write a whole recording."""
    file = McapFile(path)
    for message in messages:
        file.add(message)
    file.close()
