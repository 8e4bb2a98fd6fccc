"""One row of a box file becomes a :class:`Box`, or a :class:`RejectedRow` that says why not."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pack_msgs_py.codes import Reason
from pack_msgs_py.values import MAX_EDGE_MM, MAX_WEIGHT_KG, UP_ANY, UP_POS_Z, Box, check_box

#: Weight of a box whose file gives none: one kilogram per 6000 cm3, the volumetric divisor of the
#: IATA air cargo tariff (The Air Cargo Tariff, rule 3.9.3), about 167 kg/m3.
DEFAULT_DENSITY_KG_PER_MM3 = 1.0 / 6.0e6

#: An id in a file may be this long; repetition of the stream appends to it.
MAX_ID_LENGTH = 180

#: Names under which box files hold what the cell needs, ours first, then BED-BPP's.
SIZE_COLUMNS = (('length_mm', 'length/mm'), ('width_mm', 'width/mm'), ('height_mm', 'height/mm'))
WEIGHT_COLUMNS = ('weight_kg', 'weight/kg')
_OTHER_COLUMNS = ('id', 'max_top_load_n', 'allowed_up', 'destination')
USED_COLUMNS = frozenset(
    name for group in (*SIZE_COLUMNS, WEIGHT_COLUMNS, _OTHER_COLUMNS) for name in group
)

_NUMBER = re.compile(r'[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?', re.ASCII)
_NOT_FINITE = re.compile(r'[+-]?(nan|inf|infinity)', re.IGNORECASE)
_UP_WORDS = {'any': UP_ANY, 'upright': UP_POS_Z}


class BoxFileError(ValueError):
    """A box file as a whole cannot be used; the text names the file and says why."""


@dataclass(frozen=True)
class RejectedRow:
    """A row that cannot be a box. It counts as supplied and as rejected.

    ``box_id`` is unique in the file. ``line`` counts from 1; 0 in a JSON file, where ``text``
    names order and item. ``text`` names file, place, column and value.
    """

    box_id: str
    file: str
    line: int
    column: str
    value: str
    reason: Reason
    text: str


Entry = Box | RejectedRow


@dataclass(frozen=True)
class FileRow:
    """One row as it stands in the file: where, and column name to text.

    ``named`` is the id that the place gives the box when no ``id`` column does; ``damage`` says
    what is wrong with the row as a whole.
    """

    line: int
    place: str
    values: Mapping[str, str]
    named: str = ''
    damage: str = ''
    decimal_comma: bool = False


class _BadCell(ValueError):
    """One cell cannot be used."""

    def __init__(self, column: str, value: str, problem: str) -> None:
        super().__init__(problem)
        self.column = column
        self.value = value


def entries_from(file_rows: Iterable[FileRow], file: str) -> tuple[Entry, ...]:
    """Each row as a box or as a rejected row, in order; ids are unique over all of them."""
    rows = list(file_rows)
    given = {_given_id(row) for row in rows}
    taken: set[str] = set()
    entries: list[Entry] = []
    for number, row in enumerate(rows, start=1):
        unnamed = _fresh(f'row-{row.line or number}', given | taken)
        box_id = _given_id(row) or unnamed
        if box_id in taken:
            text = f'{file}, {row.place}, column id: {box_id!r} is there twice'
            spare = _fresh(f'{box_id}@{row.line or number}', given | taken)
            entry: Entry = RejectedRow(
                spare, file, row.line, 'id', box_id, Reason.DUPLICATE_ID, text
            )
        else:
            entry = _entry(row, box_id, unnamed, file)
        taken.add(entry.id if isinstance(entry, Box) else entry.box_id)
        entries.append(entry)
    return tuple(entries)


def _given_id(row: FileRow) -> str:
    """The id that the file gives a row, usable as a name or not; empty when it gives none."""
    values = row.values
    if values.get('id') and not row.named:
        return values['id']
    if row.named:
        return row.named
    parts = [values.get(name, '') for name in ('source', 'order_id', 'sequence')]
    return '-'.join(part for part in parts if part) if parts[1] and parts[2] else ''


def _fresh(wanted: str, taken: set[str]) -> str:
    while wanted in taken:
        wanted += '_'
    return wanted


def _entry(row: FileRow, box_id: str, unnamed: str, file: str) -> Entry:
    try:
        return _box(row, box_id)
    except _BadCell as error:
        cell = f', column {error.column}: {error.value!r} ' if error.column else ': '
        name = unnamed if error.column == 'id' else box_id
        text = f'{file}, {row.place}{cell}{error}'
        return RejectedRow(
            name, file, row.line, error.column, error.value, Reason.INVALID_DATA, text
        )


def _box(row: FileRow, box_id: str) -> Box:
    if row.damage:
        raise _BadCell('', '', row.damage)
    if len(box_id) > MAX_ID_LENGTH or not box_id.isprintable():
        raise _BadCell('id', box_id[:50], f'must be 1 to {MAX_ID_LENGTH} printable characters')
    length, width, height = (
        _positive(row, names, MAX_EDGE_MM, 'mm', required=True) for names in SIZE_COLUMNS
    )
    weight = _positive(row, WEIGHT_COLUMNS, MAX_WEIGHT_KG, 'kg', required=False)
    return check_box(
        Box(
            id=box_id,
            size_mm=(length, width, height),
            weight_kg=weight or length * width * height * DEFAULT_DENSITY_KG_PER_MM3,
            allowed_up=_allowed_up(row),
            max_top_load_n=_top_load(row),
            destination=row.values.get('destination', ''),
            extra=tuple((k, v) for k, v in row.values.items() if k not in USED_COLUMNS),
        )
    )


def _number(row: FileRow, column: str) -> float | None:
    """The number in a cell; ``None`` when it is empty or not there."""
    text = row.values.get(column, '')
    if not text:
        return None
    plain = text.replace(',', '.') if row.decimal_comma else text
    if _NOT_FINITE.fullmatch(plain):
        raise _BadCell(column, text, 'is not finite')
    if not _NUMBER.fullmatch(plain):
        raise _BadCell(column, text, 'is not a number')
    value = float(plain)
    if not math.isfinite(value):
        raise _BadCell(column, text, 'is too large')
    return value


def _positive(
    row: FileRow, names: tuple[str, ...], limit: float, unit: str, *, required: bool
) -> float:
    """The number in the first of ``names`` that the row has; 0.0 when none and not required."""
    column = next((name for name in names if name in row.values), names[0])
    value = _number(row, column)
    if value is None:
        if required:
            raise _BadCell(column, '', 'is missing')
        return 0.0
    if value <= 0:
        raise _BadCell(column, row.values[column], f'must be above 0 {unit}')
    if value > limit:
        raise _BadCell(column, row.values[column], f'must be at most {limit:g} {unit}')
    return value


def _allowed_up(row: FileRow) -> int:
    text = row.values.get('allowed_up', '')
    if not text:
        return UP_ANY
    mask = _UP_WORDS.get(text.lower()) or (int(text) if re.fullmatch('[0-9]{1,2}', text) else 0)
    if not 1 <= mask <= UP_ANY:
        words = ', '.join(_UP_WORDS)
        raise _BadCell('allowed_up', text, f'must be 1 to {UP_ANY}, or one of {words}')
    return mask


def _top_load(row: FileRow) -> float | None:
    value = _number(row, 'max_top_load_n')
    if value is not None and value < 0:
        raise _BadCell('max_top_load_n', row.values['max_top_load_n'], 'must not be negative')
    return value
