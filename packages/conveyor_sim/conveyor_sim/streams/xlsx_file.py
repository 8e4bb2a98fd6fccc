"""Box lists in workbooks of Excel and LibreOffice (.xlsx)."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.columns import has_sizes
from conveyor_sim.streams.number_columns import TypedNumber
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.table import MAX_BOXES, BoxTable, TableRow

_HEADER_WITHIN = 20


def xlsx_table(path: Path, reading: Reading) -> BoxTable:
    """The first sheet that has a header with sizes in its first lines.

    Raises
    ------
    BoxFileError
        The workbook cannot be read, or no sheet has such a header.
    """
    # Takes 0.2 s to import, which only those should wait for who need it.
    from openpyxl import load_workbook
    from openpyxl.utils.exceptions import InvalidFileException

    try:
        book = load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: list(_lines(sheet)) for sheet in book.worksheets}
        book.close()
    except (InvalidFileException, zipfile.BadZipFile, KeyError, ValueError, OSError) as error:
        msg = f'box file {path} cannot be read as a workbook: {error}'
        raise BoxFileError(msg) from None
    for title, lines in sheets.items():
        for place, (_, cells) in enumerate(lines[:_HEADER_WITHIN]):
            if has_sizes(cells, reading):
                notes = [f'sheet {name} is not read' for name in sheets if name != title]
                notes += [
                    f'line {n} is above the header: {" ".join(c)[:60]}' for n, c in lines[:place]
                ]
                return _table(cells, lines[place + 1 :], notes, path)
    shown = '; '.join(
        f'{name}: {", ".join(lines[0][1][:12])}' for name, lines in sheets.items() if lines
    )
    msg = f'box file {path} has no sheet with columns of length, width and height; found {shown}'
    raise BoxFileError(msg)


#: A line of a sheet: its number, its cells.
_Line = tuple[int, list[str]]


def _lines(sheet: Any) -> Iterator[_Line]:  # noqa: ANN401 - openpyxl does not name it
    """The lines of a sheet that hold anything."""
    for number, values in enumerate(sheet.iter_rows(values_only=True), start=1):
        cells = [_text(value) for value in values]
        if any(cells):
            yield number, cells
        if number > MAX_BOXES:
            return


def _text(value: object) -> str:
    if isinstance(value, float) and value.is_integer():
        return TypedNumber(int(value))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return TypedNumber(value)
    return '' if value is None else str(value).strip()


def _table(header: Sequence[str], lines: Sequence[_Line], notes: list[str], path: Path) -> BoxTable:
    names = [name or f'column {place}' for place, name in enumerate(header, start=1)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        msg = f'box file {path} has column {", ".join(twice)} twice'
        raise BoxFileError(msg)
    rows = []
    for number, cells in lines:
        damage = ''
        if any(cells[len(names) :]):
            damage = f'{len(cells)} fields where the header has {len(names)}'
        values = dict(zip(names, cells, strict=False))
        rows.append(TableRow(number, f'line {number}', values, damage=damage))
    filled = {name for row in rows for name, cell in row.cells.items() if cell}
    headers = tuple(n for n, given in zip(names, header, strict=True) if given or n in filled)
    return BoxTable(headers, tuple(rows), tuple(notes))
