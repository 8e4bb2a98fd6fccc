"""Box lists in our own format: CSV with columns that say everything, which reads back the same."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path

from conveyor_sim.streams.box_records import Entry
from pack_msgs_py.values import Box

COLUMNS = (
    'id', 'length_mm', 'width_mm', 'height_mm', 'weight_kg', 'max_top_load_n', 'allowed_up',
    'destination',
)  # fmt: skip

#: How a spreadsheet's formula begins; apostrophes before it make it a text there.
_FORMULA = re.compile(r"'*[=+\-@\t\r]")


def write_boxes(path: Path, entries: Iterable[Entry]) -> None:
    """Write boxes as a box file; rejected rows, which are none, are left out.

    What else the file of a box said of it has columns of its own behind ours. A text that a
    spreadsheet would take for a formula has an apostrophe before it.
    """
    boxes = [entry for entry in entries if isinstance(entry, Box)]
    more = dict.fromkeys(key for box in boxes for key, _ in box.extra)
    headers = [f'{key} (in the file)' if key in COLUMNS else key for key in more]
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow([*COLUMNS, *headers])
        for box in boxes:
            extra = dict(box.extra)
            writer.writerow([*_cells(box), *(as_text(extra.get(key, '')) for key in more)])


def as_text(text: str) -> str:
    """``text`` as a cell of a CSV file that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def from_text(cell: str) -> str:
    """What :func:`as_text` made of a text, back."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def _cells(box: Box) -> list[str]:
    load = '' if box.max_top_load_n is None else repr(box.max_top_load_n)
    numbers = [repr(value) for value in (*box.size_mm, box.weight_kg)]
    up = str(box.allowed_up)
    return [as_text(box.id), *numbers, load, up, as_text(box.destination)]
