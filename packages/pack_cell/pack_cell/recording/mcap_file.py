"""A recording on disk: MCAP with the profile `ros2`, compressed, readable after a crash."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from mcap.writer import CompressionType, Writer

from pack_cell.recording.messages import RecordedMessage, RecordedTopic
from pack_cell.recording.rosbag2_metadata import RECORD, bag_metadata, offers_text

#: What is said in so many seconds is compressed together; a crash loses at most that.
CHUNK_S = 30.0
#: A chunk ends earlier when it holds so many bytes: snapshots that repeat themselves compress well.
CHUNK_BYTES = 4 * 1024 * 1024


class McapFile:
    """Appends messages to a new file at ``path``.

    In a chunk the messages of a topic stand together, oldest first: what repeats itself is near
    what it repeats, so it compresses better. Readers go by the index, which is in order of time.

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
        # Chunks are ended here alone: a topic that is new may end none either.
        self._writer = Writer(
            self._stream, chunk_size=sys.maxsize, compression=CompressionType.ZSTD
        )
        self._channels: dict[RecordedTopic, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[RecordedTopic] = Counter()
        self._span_ns = (0, 0)
        self._waiting: dict[int, list[RecordedMessage]] = {}
        self._waiting_bytes = 0
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
        self._waiting.setdefault(self._channel(message.topic), []).append(message)
        self._waiting_bytes += len(message.data)
        self._counts[message.topic] += 1
        self.end_chunk(heard_ns)

    def end_chunk(self, now_ns: int) -> None:
        """Write out what is old enough by ``now_ns``, nanoseconds since the epoch."""
        is_old = self._chunk_began_ns and now_ns - self._chunk_began_ns > self._chunk_ns
        if is_old or self._waiting_bytes > CHUNK_BYTES:
            self._write_chunk()

    def _write_chunk(self) -> None:
        waiting, self._waiting = self._waiting, {}
        self._waiting_bytes = self._chunk_began_ns = 0
        for channel, messages in waiting.items():
            for message in sorted(messages, key=lambda one: one.heard_ns):
                self._writer.add_message(
                    channel, message.heard_ns, message.data, message.published_ns
                )
        self._writer.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """End the file with its index."""
        self._write_chunk()
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
