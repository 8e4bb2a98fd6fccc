"""Boxes of an earlier run, in the order in which they were fed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from conveyor_sim.streams.box_list import box_list
from conveyor_sim.streams.box_records import BoxFileError, Entry
from conveyor_sim.streams.files import read_entries
from conveyor_sim.streams.own_format import COLUMNS
from conveyor_sim.streams.table import BoxTable, TableRow

#: What `cell run` writes: the true boxes in the order of the feed.
BOXES_FILE = 'boxes.csv'
_RECORD_FILE = 'placements.jsonl'


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
    rows = tuple(_rows(lines, path))
    entries = box_list(BoxTable(COLUMNS[:5], rows, points_by_format=True), str(path)).entries
    if not entries:
        msg = f'{path} holds no boxes'
        raise BoxFileError(msg)
    return entries


def _rows(lines: Iterable[str], path: Path) -> Iterator[TableRow]:
    for number, line in enumerate(lines, start=1):
        place = f'line {number}'
        try:
            row = json.loads(line)
            box_id, size = row['box_id'], row['size_mm']
        except (ValueError, KeyError, TypeError):
            yield TableRow(number, place, {}, damage=f'is not a box of a run: {line[:60]!r}')
            continue
        if size is None:
            continue  # rejected before it was measured
        values = dict(zip(COLUMNS[1:4], map(str, size), strict=True))
        weight = row.get('weight_kg')
        values |= {'id': str(box_id)} | ({} if weight is None else {'weight_kg': str(weight)})
        yield TableRow(number, place, values)
