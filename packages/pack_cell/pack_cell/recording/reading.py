"""Recordings read back, also one whose recorder was killed."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import yaml
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap.records import Channel, Schema

from pack_cell.recording.messages import RecordedMessage, RecordedTopic

#: Name of the recording in the folder of a run.
RUN_FILE = 'run.mcap'
#: What every MCAP file begins with.
_MAGIC = b'\x89MCAP0\r\n'
#: What the reader of a file without its end may raise where it ends.
_TORN = (McapError, EOFError, struct.error)


class NoRecording(ValueError):
    """There is no recording, or what there is cannot be read; the message says which."""


def next_recording(folder: Path) -> Path:
    """Where a run in ``folder`` is to be recorded: one that was resumed goes on in a new file."""
    path, number = folder / RUN_FILE, 2
    while path.exists():
        path, number = folder / f'run-{number}.mcap', number + 1
    return path


def find_recordings(place: Path) -> list[Path]:
    """The recordings that ``place`` is or, as the folder of a run or of a fault, holds, in order.

    Raises
    ------
    NoRecording
        There is none.
    """
    if place.is_file():
        return [place]
    if not place.is_dir():
        msg = f'{place}: there is no such file or folder'
        raise NoRecording(msg)
    found = sorted(place.glob('*.mcap'), key=lambda path: (len(path.name), path.name))
    if not found:
        msg = f'{place} holds no recording (a run writes {RUN_FILE} unless --record says otherwise)'
        raise NoRecording(msg)
    return found


def read_messages(path: Path, topics: Collection[str] | None = None) -> Iterator[RecordedMessage]:
    """Every message, or those on ``topics``, in the order in which they were written.

    A file without its end, as a killed recorder leaves it, is read up to its last whole chunk.

    Raises
    ------
    NoRecording
        The file cannot be opened, or is no MCAP file.
    """
    try:
        stream = path.open('rb')
    except OSError as error:
        msg = f'{path}: {error.strerror}'
        raise NoRecording(msg) from None
    with stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            msg = f'{path} is no MCAP file'
            raise NoRecording(msg)
        stream.seek(0)
        with suppress(*_TORN):
            yield from _messages(stream, topics)


def _messages(stream: BinaryIO, topics: Collection[str] | None) -> Iterator[RecordedMessage]:
    known: dict[int, RecordedTopic] = {}
    # The order of the file needs no index, and so no end of the file.
    reader = NonSeekingReader(stream)
    for schema, channel, message in reader.iter_messages(topics, log_time_order=False):
        if channel.id not in known:
            known[channel.id] = _topic(schema, channel)
        yield RecordedMessage(
            known[channel.id], message.log_time, message.publish_time, message.data
        )


def _topic(schema: Schema | None, channel: Channel) -> RecordedTopic:
    offers = yaml.safe_load(channel.metadata.get('offered_qos_profiles', '')) or ()
    return RecordedTopic(
        channel.topic,
        schema.name if schema else '',
        schema.data.decode() if schema else '',
        tuple(offers),
        channel.metadata.get('topic_type_hash', ''),
    )
