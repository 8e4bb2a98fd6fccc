"""Box lists in CSV, as people's spreadsheets write them."""

from __future__ import annotations

import csv
from collections.abc import Iterator

from conveyor_sim.streams.box_records import SIZE_COLUMNS, BoxFileError, FileRow

_DELIMITERS = ',;\t'


def csv_rows(text: str, file: str) -> Iterator[FileRow]:
    """Each line of a CSV text with a header; comma, semicolon or tab apart.

    A line is read by itself, so that a stray quotation mark costs no other line. Where fields are
    not separated by commas, a comma in a number is a decimal comma.

    Raises
    ------
    BoxFileError
        There is no header with the three size columns, or it names a column twice.
    """
    lines = text.replace('\r\n', '\n').replace('\r', '\n').split('\n')
    numbered = ((n, line) for n, line in enumerate(lines, start=1) if line.strip(' \t,;'))
    first = next(numbered, None)
    if first is None:
        msg = f'box file {file} is empty'
        raise BoxFileError(msg)
    delimiter = max(_DELIMITERS, key=first[1].count)
    header = _header(first[1], delimiter, file)
    for number, line in numbered:
        yield _row(number, line, delimiter, header)


def _header(line: str, delimiter: str, file: str) -> list[str]:
    names = [name.strip().lower() for name in next(csv.reader([line], delimiter=delimiter))]
    missing = [ours for ours, theirs in SIZE_COLUMNS if ours not in names and theirs not in names]
    if missing:
        msg = (
            f'box file {file} has no column {", ".join(missing)} in its first line; '
            f'found {", ".join(name[:40] for name in names[:12])}'
        )
        raise BoxFileError(msg)
    twice = sorted({name for name in names if name and names.count(name) > 1})
    if twice:
        msg = f'box file {file} has column {", ".join(twice)} twice'
        raise BoxFileError(msg)
    return names


def _row(number: int, line: str, delimiter: str, header: list[str]) -> FileRow:
    place = f'line {number}'
    damage = ''
    try:
        cells = next(csv.reader([line], delimiter=delimiter, strict=True))
    except csv.Error as error:
        cells, damage = [], f'cannot be read as CSV ({error}): {line[:60]!r}'
    while len(cells) > len(header) and not cells[-1].strip():
        cells.pop()
    if len(cells) > len(header):
        damage = f'{len(cells)} fields where the header has {len(header)}: {line[:60]!r}'
    values = {name: cell.strip() for name, cell in zip(header, cells, strict=False) if name}
    return FileRow(number, place, values, damage=damage, decimal_comma=delimiter != ',')
