"""Box lists in CSV, as people's spreadsheets write them."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.column_names import read_header
from conveyor_sim.streams.columns import has_sizes
from conveyor_sim.streams.own_format import from_text
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.table import BoxTable, TableRow

#: What a column without a header is called, with its number.
UNNAMED = 'column'
_DELIMITERS = ',;\t|'
#: A header stands within so many lines; what is above it is a title.
_HEADER_WITHIN = 20

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
    header = _unique(_cells(numbered[place][1], delimiter), file)
    notes = tuple(
        f'line {number} is above the header: {line[:60]}' for number, line in numbered[:place]
    )
    rows = _rows(lines, numbered[place + 1 :], delimiter, header)
    filled = {name for row in rows for name, cell in row.cells.items() if cell}
    headers = tuple(name for name in header if name in filled or not name.startswith(UNNAMED))
    return BoxTable(headers, tuple(rows), notes, points_by_format=delimiter == ',')


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


def _unique(header: list[str], file: str) -> list[str]:
    twice = sorted({name for name in header if name and header.count(name) > 1})
    needed = [name for name in twice if read_header(name).meaning]
    if needed:
        msg = f'box file {file} has column {", ".join(needed)} twice'
        raise BoxFileError(msg)
    counts: dict[str, int] = {}
    names = []
    for place, given in enumerate(header, start=1):
        name = given or f'{UNNAMED} {place}'
        counts[name] = counts.get(name, 0) + 1
        names.append(f'{name} ({counts[name]})' if name in twice and counts[name] > 1 else name)
    return names


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


def _row_of(number: int, cells: list[str], header: list[str], damage: str) -> TableRow:
    cells = [from_text(cell.strip()) for cell in cells]
    while len(cells) > len(header) and not cells[-1]:
        cells.pop()
    if len(cells) > len(header):
        damage = f'{len(cells)} fields where the header has {len(header)}: {" ".join(cells)[:60]!r}'
    values = dict(zip(header, cells, strict=False))
    return TableRow(number, f'line {number}', values, damage=damage)
