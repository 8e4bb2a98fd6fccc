"""Recordings read back, also one whose recorder was killed."""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, TypeAlias

import yaml
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Channel, Message, Schema

from pack_cell.recording.messages import RecordedMessage, RecordedTopic

#: Name of the recording in the folder of a run.
RUN_FILE = 'run.mcap'
#: What every MCAP file begins with.
_MAGIC = b'\x89MCAP0\r\n'
#: What the reader of a file without its end may raise where it ends.
_TORN = (McapError, EOFError, struct.error)
_Row: TypeAlias = tuple[Schema | None, Channel, Message]


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
    """Every message, or those on ``topics``, in the order in which they were heard.

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
        if _has_end(stream):
            with suppress(*_TORN):
                yield from _values(SeekingReader(stream).iter_messages(topics))
        else:
            yield from _values(_torn(stream, topics))


def _has_end(stream: BinaryIO) -> bool:
    """Whether the file was ended; leaves ``stream`` at its beginning."""
    stream.seek(-len(_MAGIC), os.SEEK_END)
    has_end = stream.read() == _MAGIC and stream.tell() > len(_MAGIC)
    stream.seek(0)
    return has_end


def _torn(stream: BinaryIO, topics: Collection[str] | None) -> list[_Row]:
    rows: list[_Row] = []
    # The order of the file needs no index, and so no end of the file.
    with suppress(*_TORN):
        rows.extend(NonSeekingReader(stream).iter_messages(topics, log_time_order=False))
    return sorted(rows, key=lambda row: row[2].log_time)


def _values(rows: Iterable[_Row]) -> Iterator[RecordedMessage]:
    known: dict[int, RecordedTopic] = {}
    for schema, channel, message in rows:
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
