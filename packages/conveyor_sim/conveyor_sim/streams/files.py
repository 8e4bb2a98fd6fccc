"""Read a box file of any known format."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from conveyor_sim.streams.box_list import BoxList, box_list
from conveyor_sim.streams.box_records import BoxFileError, Entry
from conveyor_sim.streams.csv_file import csv_table, names_sizes
from conveyor_sim.streams.json_file import json_table
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.sheet_layout import boxes_alone
from conveyor_sim.streams.table import BoxTable
from conveyor_sim.streams.xlsx_file import xlsx_table

#: The stream that ships with the cell: 40 cartons of public sizes.
BUILT_IN = Path(__file__).parent.parent / 'data' / 'cartons.csv'

#: The list that was read last, by its path, its content and how it was read.
_READ: dict[tuple[Path, bytes, str], BoxList] = {}
#: What spreadsheets wrote before Unicode, by Python's name and by that for people.
_CODINGS = {
    'cp1252': 'Windows-1252',
    'cp1250': 'Windows-1250',
    'cp1251': 'Windows-1251',
    'cp1254': 'Windows-1254',
    'cp932': 'Shift JIS',
    'gb18030': 'GB 18030',
    'cp949': 'Korean (949)',
    'mac_roman': 'Mac Roman',
}
_MAX_BYTES = 100_000_000
#: How a workbook begins (a ZIP archive), and one of Excel before 2007.
_ZIP, _OLD_EXCEL = b'PK\x03\x04', b'\xd0\xcf\x11\xe0'


def read_boxes(path: str | Path = '', reading: Reading | None = None) -> BoxList:
    """What a box file holds, and how it was understood; the built-in one by default.

    Raises
    ------
    BoxFileError
        The file cannot be read, is empty, or is not clear without more of ``reading``.
    """
    source = Path(path).expanduser() if str(path) else BUILT_IN
    data = _bytes(source)
    reading = (reading or Reading()).beside(source)
    key = (source, hashlib.sha256(data).digest(), repr(reading))
    if key in _READ:
        return _READ[key]
    found = box_list(boxes_alone(_table(data, source, reading)), source.name, reading)
    if not found.entries:
        msg = f'box file {source} holds no boxes'
        raise BoxFileError(msg)
    # Who checks options, starts nodes and writes reports asks for the same list again and again.
    _READ.clear()
    _READ[key] = found
    return found


def read_entries(path: str | Path = '', reading: Reading | None = None) -> tuple[Entry, ...]:
    """Rows of a box file in their order, each a box or rejected; see :func:`read_boxes`."""
    return read_boxes(path, reading).entries


def _table(data: bytes, source: Path, reading: Reading) -> BoxTable:
    if data.startswith(_ZIP):
        return xlsx_table(source, reading)
    if data.startswith(_OLD_EXCEL):
        msg = f'box file {source} is a workbook of Excel before 2007: save it as .xlsx or .csv'
        raise BoxFileError(msg)
    text, note = _text(data, source, reading)
    if source.suffix.lower() in ('.json', '.jsonl', '.ndjson') or text.lstrip()[:1] in ('{', '['):
        return _noted(json_table(text, str(source), reading), note)
    words = text.split(maxsplit=8)
    if len(words) > 6 and all(word.isdecimal() for word in words[:8]):
        msg = f'box file {source} looks like a thpack file: name a problem of it, br:{source}#1'
        raise BoxFileError(msg)
    return _noted(csv_table(text, str(source), reading), note)


def _noted(table: BoxTable, note: str) -> BoxTable:
    return replace(table, notes=(*filter(None, (note,)), *table.notes))


def _bytes(source: Path) -> bytes:
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
        return source.read_bytes()
    except OSError as error:
        msg = f'box file {source} cannot be read: {error.strerror or error}'
        raise BoxFileError(msg) from None


def _text(data: bytes, source: Path, reading: Reading) -> tuple[str, str]:
    """The file's text, and a note when it is no Unicode.

    UTF-8 with or without a byte order mark, UTF-16 with; else that of :data:`_CODINGS` in which a
    header has names that are known, or else the first one.
    """
    note = ''
    if data.startswith((b'\xff\xfe', b'\xfe\xff')):
        text = data.decode('utf-16', errors='replace')
    else:
        try:
            text = data.decode('utf-8-sig')
        except UnicodeDecodeError:
            text, coding = _by_header(data, reading)
            note = f'not in UTF-8: read as {coding}'
    if '\0' in text:
        msg = f'box file {source} is not text'
        raise BoxFileError(msg)
    if not text.strip():
        msg = f'box file {source} is empty'
        raise BoxFileError(msg)
    return text, note


def _by_header(data: bytes, reading: Reading) -> tuple[str, str]:
    for coding, name in _CODINGS.items():
        try:
            text = data.decode(coding)
        except UnicodeDecodeError:
            continue
        if names_sizes(text, reading):
            return text, name
    coding, name = next(iter(_CODINGS.items()))
    return data.decode(coding, errors='replace'), name
