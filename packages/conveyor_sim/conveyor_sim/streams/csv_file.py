"""Box lists in CSV, as people's spreadsheets write them."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.column_names import read_header
from conveyor_sim.streams.columns import has_sizes
from conveyor_sim.streams.own_format import from_text
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.sheet_layout import UNNAMED, header_lines, unique_names
from conveyor_sim.streams.table import BoxTable, TableRow

_DELIMITERS = ',;\t|'
#: A header stands within so many lines; what is above it is a title.
_HEADER_WITHIN = 20
_GUARDED = re.compile(r'="([^"]*)"')

#: A line of the file: its number, its text.
_Line = tuple[int, str]


def csv_table(text: str, file: str, reading: Reading) -> BoxTable:
    """A CSV text with a header; comma, semicolon, tab or bar apart, which `sep=` may say.

    A field in quotation marks may hold line breaks. Where that makes no rows that fit the header,
    each line is read by itself, so that a stray quotation mark costs no other line.

    Raises
    ------
    BoxFileError
        There is no header with sizes, or it names a column twice.
    """
    lines = text.replace('\r\n', '\n').replace('\r', '\n').split('\n')
    numbered = [(n, line) for n, line in enumerate(lines, start=1) if line.strip(' \t,;|')]
    if not numbered:
        msg = f'box file {file} is empty'
        raise BoxFileError(msg)
    said = ''
    if numbered[0][1].strip().lower().startswith('sep=') and len(numbered[0][1].strip()) <= 5:
        said = numbered.pop(0)[1].strip('\n')[4:5] or '\t'
    place, delimiter = _header_place(numbered, said, reading)
    begin = [_cells(line, delimiter) for _, line in numbered[: place + 2]]
    names, first, after = header_lines(begin, place)
    header = unique_names(names, file)
    notes = tuple(
        f'line {number} is above the header: {line[:60]}' for number, line in numbered[:first]
    )
    rows = _rows(lines, numbered[after:], delimiter, header)
    filled = {name for row in rows for name, cell in row.cells.items() if cell}
    headers = tuple(name for name in header if name in filled or not name.startswith(UNNAMED))
    return BoxTable(headers, tuple(rows), notes, points_by_format=delimiter == ',')


def names_sizes(text: str, reading: Reading) -> bool:
    """Whether one of the first lines is a header with sizes, whatever separates its columns."""
    return any(
        has_sizes(_cells(line, delimiter), reading)
        for line in text.splitlines()[:_HEADER_WITHIN]
        for delimiter in _DELIMITERS
    )


def _header_place(lines: Sequence[_Line], said: str, reading: Reading) -> tuple[int, str]:
    """Which line is the header, and what separates its columns.

    Where no line has sizes, the first one: what it lacks is told later.
    """
    for place, (_, line) in enumerate(lines[:_HEADER_WITHIN]):
        for delimiter in sorted(said or _DELIMITERS, key=line.count, reverse=True):
            if has_sizes(_cells(line, delimiter), reading):
                return place, delimiter
    first = lines[0][1]
    known = {
        mark: sum(bool(read_header(cell).meaning) for cell in _cells(first, mark))
        for mark in said or _DELIMITERS
    }
    return 0, max(known, key=lambda mark: (known[mark], first.count(mark)))


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _rows(
    lines: Sequence[str], numbered: Sequence[_Line], delimiter: str, header: list[str]
) -> list[TableRow]:
    if not numbered:
        return []
    start = numbered[0][0]
    rest = '\n'.join(lines[start - 1 :])
    if '"' in rest:
        whole = _rows_with_breaks(lines[start - 1 :], start, delimiter, header)
        if whole is not None:
            return whole
    return [_row(number, line, delimiter, header) for number, line in numbered]


def _rows_with_breaks(
    lines: Sequence[str], start: int, delimiter: str, header: list[str]
) -> list[TableRow] | None:
    """Rows, when some go over several lines and all of these fit the header; else ``None``."""
    reader = csv.reader((f'{line}\n' for line in lines), delimiter=delimiter, strict=True)
    rows, begins, broken = [], start, False
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                spans = start + reader.line_num - 1 > begins
                if spans and len(cells) != len(header):
                    return None
                broken = broken or spans
                rows.append(_row_of(begins, [' '.join(c.split()) for c in cells], header, ''))
            begins = start + reader.line_num
    except csv.Error:
        return None
    return rows if broken else None


def _row(number: int, line: str, delimiter: str, header: list[str]) -> TableRow:
    damage = ''
    try:
        cells = next(csv.reader([line], delimiter=delimiter, strict=True))
    except csv.Error as error:
        cells, damage = [], f'cannot be read as CSV ({error}): {line[:60]!r}'
    return _row_of(number, cells, header, damage)


def _text_of(cell: str) -> str:
    """The text of a cell that a spreadsheet may have guarded: `="007"` keeps its zeros there."""
    guarded = _GUARDED.fullmatch(cell)
    return guarded.group(1) if guarded else from_text(cell)


def _row_of(number: int, cells: list[str], header: list[str], damage: str) -> TableRow:
    cells = [_text_of(cell.strip()) for cell in cells]
    while len(cells) > len(header) and not cells[-1]:
        cells.pop()
    if len(cells) > len(header):
        damage = f'{len(cells)} fields where the header has {len(header)}: {" ".join(cells)[:60]!r}'
    values = dict(zip(header, cells, strict=False))
    return TableRow(number, f'line {number}', values, damage=damage)
