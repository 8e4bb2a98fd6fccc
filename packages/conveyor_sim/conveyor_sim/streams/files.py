"""Read a box file of any known format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from conveyor_sim.streams.box_records import BoxFileError, Entry, FileRow, entries_from
from conveyor_sim.streams.csv_file import csv_rows
from conveyor_sim.streams.json_file import json_rows

#: The stream that ships with the cell: 40 cartons of public sizes.
BUILT_IN = Path(__file__).parent.parent / 'data' / 'cartons.csv'

_MAX_BYTES = 100_000_000


def read_entries(path: str | Path = '') -> tuple[Entry, ...]:
    """Rows of a box file in their order, each a box or rejected; the built-in one by default.

    Raises
    ------
    BoxFileError
        The file cannot be read, is empty, or has no size columns.
    """
    source = Path(path).expanduser() if str(path) else BUILT_IN
    text = _text(source)
    entries = entries_from(_rows(text, source), source.name)
    if not entries:
        msg = f'box file {source} holds no boxes'
        raise BoxFileError(msg)
    return entries


def _rows(text: str, source: Path) -> Iterator[FileRow]:
    is_json = source.suffix.lower() == '.json' or text.lstrip()[:1] in ('{', '[')
    return json_rows(text, str(source)) if is_json else csv_rows(text, str(source))


def _text(source: Path) -> str:
    """The file's text: UTF-8 with or without a byte order mark, UTF-16 with, else Windows-1252."""
    try:
        if source.is_dir():
            msg = f'box file {source} is a folder'
            raise BoxFileError(msg)
        if source.exists() and not source.is_file():
            msg = f'box file {source} is not a regular file'
            raise BoxFileError(msg)
        if source.stat().st_size > _MAX_BYTES:
            msg = f'box file {source} is larger than {_MAX_BYTES // 1_000_000} MB: split it'
            raise BoxFileError(msg)
        data = source.read_bytes()
    except OSError as error:
        msg = f'box file {source} cannot be read: {error.strerror or error}'
        raise BoxFileError(msg) from None
    if data.startswith((b'\xff\xfe', b'\xfe\xff')):
        text = data.decode('utf-16', errors='replace')
    else:
        try:
            text = data.decode('utf-8-sig')
        except UnicodeDecodeError:
            text = data.decode('cp1252', errors='replace')
    if '\0' in text:
        msg = f'box file {source} is not text'
        raise BoxFileError(msg)
    if not text.strip():
        msg = f'box file {source} is empty'
        raise BoxFileError(msg)
    return text
