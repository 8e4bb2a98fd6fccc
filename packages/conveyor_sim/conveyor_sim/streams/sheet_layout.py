"""What of a sheet is header, what is boxes, and what is neither: second lines, totals, remarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.column_names import KINDS, read_header, words_of
from conveyor_sim.streams.table import BoxTable, TableRow
from conveyor_sim.streams.units import unit_of

#: What a column without a header is called, with its number.
UNNAMED = 'column'
#: What the line under the boxes begins with that adds them up.
_TOTALS = frozenset(
    word
    for text in (
        'total', 'totals', 'subtotal', 'grand', 'sub', 'sum', 'overall', 'Summe', 'Gesamt',
        'Gesamtsumme', 'Zwischensumme', 'somme', 'totale', 'totaux', 'suma', 'razem', 'celkem',
        'totaal', 'summa', 'toplam', 'итого', 'всего', '合計', '合计', '总计', '합계',
    )
    for word in words_of(text)
)  # fmt: skip
_SIZES = ('length', 'width', 'height', 'depth', 'size')


def header_lines(lines: Sequence[Sequence[str]], place: int) -> tuple[list[str], int, int]:
    """The header that stands in line ``place`` and perhaps the one below it or above it.

    Below may stand units, or what the parts of a merged cell are: `L`, `W`, `H` under `Dimensions`.

    Returns
    -------
    names : a name for each column, as the lines say together.
    first, after : the first line of the header and the first one behind it.
    """
    header = list(lines[place])
    below = list(lines[place + 1]) if place + 1 < len(lines) else []
    if _goes_on(below):
        return _joined(header, below), place, place + 2
    above = list(lines[place - 1]) if place else []
    named = [cell for cell in above if cell]
    bare = [cell for cell, own in zip(above, header, strict=False) if cell and not own]
    if bare and len(named) > 1:
        return _joined(above, header), place - 1, place + 1
    return header, place, place + 1


def _goes_on(cells: Sequence[str]) -> bool:
    """Whether a line says units and edges, and nothing else."""
    words = [words_of(cell) for cell in cells]
    said = [cell for cell in words if cell]
    return len(said) > 1 and all(
        all(_is_unit(word) for word in cell) or read_header(' '.join(cell)).meaning in KINDS
        for cell in said
    )


def _is_unit(word: str) -> bool:
    return any(unit_of(word, kind) for kind in set(KINDS.values()))


def _joined(above: Sequence[str], below: Sequence[str]) -> list[str]:
    names = []
    over = ''
    for place in range(max(len(above), len(below))):
        upper = above[place] if place < len(above) else ''
        lower = below[place] if place < len(below) else ''
        over = upper or over
        # A merged cell names the columns on its right too, where the line below goes on.
        upper = upper or (over if lower else '')
        name = f'{upper} {lower}'.strip() if words_of(lower) else upper
        if not read_header(name).meaning and read_header(lower).meaning:
            units = [word for word in words_of(upper) if _is_unit(word)]
            name = ' '.join([lower, *units[:1]])
        names.append(name)
    return names


def unique_names(header: Sequence[str], file: str) -> list[str]:
    """A name for each column, also for those without; of several alike the later have a number.

    Raises
    ------
    BoxFileError
        A name that means something stands twice.
    """
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


def boxes_alone(table: BoxTable) -> BoxTable:
    """``table`` without lines that are no boxes: the header again, totals, remarks at the end."""
    sizes = [name for name in table.headers if read_header(name).meaning in _SIZES]
    rows = list(table.rows)
    notes = []
    while len(rows) > 1 and (what := _at_the_end(rows[-1], rows[-2].line, len(table.headers))):
        notes.append(_note(rows.pop(), what))
    kept = []
    for row in rows:
        what = _in_between(row, sizes)
        if what:
            notes.append(_note(row, what))
        else:
            kept.append(row)
    return replace(table, rows=tuple(kept), notes=(*table.notes, *notes))


def _note(row: TableRow, what: str) -> str:
    shown = ' '.join(text for text in row.cells.values() if text)[:60]
    return f'{row.place} {what}, not a box: {shown}'


def _filled(row: TableRow) -> list[str]:
    return [text for text in row.cells.values() if text]


def _at_the_end(row: TableRow, line_before: int, columns: int) -> str:
    filled = _filled(row)
    if not row.line or not filled or row.damage:
        return ''
    words = words_of(filled[0])
    if words and all(word in _TOTALS for word in words):
        return 'adds up'
    alone = len(filled) == 1 and columns > 3 and row.line > line_before + 1
    return 'is a remark' if alone else ''


def _in_between(row: TableRow, sizes: Sequence[str]) -> str:
    filled = _filled(row)
    if not row.line or not filled or row.damage:
        return ''
    names = [name for name, text in row.cells.items() if text]
    if len(filled) > 1 and [*map(words_of, filled)] == [*map(words_of, names)]:
        return 'is the header again'
    words = words_of(filled[0])
    sized = any(row.cells.get(name) for name in sizes)
    return 'adds up' if words and words[0] in _TOTALS and not sized else ''
