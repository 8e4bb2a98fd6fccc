"""Box lists in workbooks of Excel and LibreOffice (.xlsx)."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.columns import has_sizes
from conveyor_sim.streams.number_columns import TypedNumber
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.sheet_layout import header_lines, unique_names
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
        book = load_workbook(path, data_only=True)
        sheets = {sheet.title: list(_lines(sheet)) for sheet in book.worksheets}
        hidden = {sheet.title: _hidden(sheet) for sheet in book.worksheets}
        book.close()
    except (InvalidFileException, zipfile.BadZipFile, KeyError, ValueError, OSError) as error:
        msg = f'box file {path} cannot be read as a workbook: {error}'
        raise BoxFileError(msg) from None
    for title, lines in sheets.items():
        for place, (_, cells) in enumerate(lines[:_HEADER_WITHIN]):
            if has_sizes(cells, reading):
                notes = [f'sheet {name} is not read' for name in sheets if name != title]
                begin = [cells for _, cells in lines[: place + 2]]
                header, first, after = header_lines(begin, place)
                notes += [
                    f'line {n} is above the header: {" ".join(filter(None, cells))[:60]}'
                    for n, cells in lines[:first]
                ]
                rows = lines[after:]
                unseen = sum(number in hidden[title] for number, _ in rows)
                if unseen:
                    lines_are = '1 line is' if unseen == 1 else f'{unseen} lines are'
                    notes.append(f'{lines_are} hidden in sheet {title}, and read all the same')
                return _table(header, rows, notes, path)
    shown = '; '.join(
        f'{name}: {", ".join(lines[0][1][:12])}' for name, lines in sheets.items() if lines
    )
    msg = f'box file {path} has no sheet with columns of length, width and height; found {shown}'
    raise BoxFileError(msg)


#: A line of a sheet: its number, its cells.
_Line = tuple[int, list[str]]


def _lines(sheet: Any) -> Iterator[_Line]:  # noqa: ANN401 - openpyxl does not name it
    """The lines of a sheet that hold anything."""
    spread = {
        (line, area.min_col): sheet.cell(area.min_row, area.min_col)
        for area in sheet.merged_cells.ranges
        for line in range(area.min_row + 1, min(area.max_row, sheet.max_row) + 1)
    }
    for number, row in enumerate(sheet.iter_rows(), start=1):
        # A cell that goes over several lines says the same of each.
        cells = [_text(spread.get((cell.row, cell.column), cell)) for cell in row]
        if any(_text(cell) for cell in row):
            yield number, cells
        if number > MAX_BOXES:
            return


def _hidden(sheet: Any) -> set[int]:  # noqa: ANN401 - openpyxl does not name it
    return {number for number, line in sheet.row_dimensions.items() if line.hidden}


def _text(cell: Any) -> str:  # noqa: ANN401 - openpyxl does not name it
    value, shown = cell.value, cell.number_format
    if isinstance(value, int) and len(shown) > 1 and set(shown) == {'0'}:
        return TypedNumber(f'{value:0{len(shown)}d}')
    if isinstance(value, datetime) and not (value.hour or value.minute or value.second):
        return str(value.date())
    if isinstance(value, float) and value.is_integer():
        return TypedNumber(int(value))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return TypedNumber(value)
    return '' if value is None else str(value).strip()


def _table(header: Sequence[str], lines: Sequence[_Line], notes: list[str], path: Path) -> BoxTable:
    names = unique_names(header, str(path))
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
