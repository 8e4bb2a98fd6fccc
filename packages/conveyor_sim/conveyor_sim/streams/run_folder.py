"""Boxes of an earlier run, in the order in which they were fed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from conveyor_sim.streams.box_records import BoxFileError, Entry, FileRow, RejectedRow, entries_from
from conveyor_sim.streams.files import read_entries
from pack_msgs_py.values import Box

#: What `cell run` writes: the true boxes in the order of the feed.
BOXES_FILE = 'boxes.csv'
_RECORD_FILE = 'placements.jsonl'
_COLUMNS = (
    'id', 'length_mm', 'width_mm', 'height_mm', 'weight_kg', 'max_top_load_n', 'allowed_up',
    'destination',
)  # fmt: skip


def read_run(folder: Path) -> tuple[Entry, ...]:
    """The boxes of the run in ``folder``: of its ``boxes.csv``, else of its ``placements.jsonl``.

    Raises
    ------
    BoxFileError
        There is neither, or it cannot be used.
    """
    if (folder / BOXES_FILE).exists():
        return read_entries(folder / BOXES_FILE)
    path = folder / _RECORD_FILE
    try:
        lines = path.read_text(encoding='utf-8').splitlines()
    except OSError as error:
        msg = f'{folder} is no folder of a run: {path.name}: {error.strerror or error}'
        raise BoxFileError(msg) from None
    entries = entries_from(_rows(lines, path), str(path))
    if not entries:
        msg = f'{path} holds no boxes'
        raise BoxFileError(msg)
    return entries


def _rows(lines: Iterable[str], path: Path) -> Iterator[FileRow]:
    for number, line in enumerate(lines, start=1):
        place = f'line {number}'
        try:
            row = json.loads(line)
            box_id, size = row['box_id'], row['size_mm']
        except (ValueError, KeyError, TypeError):
            yield FileRow(number, place, {}, damage=f'is not a box of a run: {line[:60]!r}')
            continue
        if size is None:
            continue  # rejected before it was measured
        values = dict(zip(_COLUMNS[1:4], map(str, size), strict=True))
        weight = row.get('weight_kg')
        values |= {'id': str(box_id)} | ({} if weight is None else {'weight_kg': str(weight)})
        yield FileRow(number, place, values)


def write_boxes(path: Path, entries: Iterable[Entry]) -> None:
    """Write boxes as a box file; rejected rows, which are none, are left out."""
    with path.open('w', encoding='utf-8', newline='') as file:
        file.write(','.join(_COLUMNS) + '\n')
        for entry in entries:
            if not isinstance(entry, RejectedRow):
                file.write(','.join(_cell(value) for value in _values(entry)) + '\n')


def _values(box: Box) -> tuple[object, ...]:
    load = '' if box.max_top_load_n is None else box.max_top_load_n
    return (box.id, *box.size_mm, box.weight_kg, load, box.allowed_up, box.destination)


def _cell(value: object) -> str:
    text = repr(value) if isinstance(value, float) else str(value)
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',;"\t') else text
