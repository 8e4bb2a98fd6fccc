"""Which column of a table is what, in which unit, and how its numbers are written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import median

from conveyor_sim.streams.box_records import BoxFileError, UnclearBoxFile
from conveyor_sim.streams.column_names import (
    KINDS,
    NamedColumn,
    hints_at,
    is_net,
    read_header,
    words_of,
)
from conveyor_sim.streams.number_columns import (
    COMMA,
    POINT,
    AmbiguousColumn,
    BadNumber,
    NumberText,
    TypedNumber,
    decimal_marks,
    number,
)
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.table import BoxTable, TableRow
from conveyor_sim.streams.units import LENGTH, PIECES, WEIGHT, in_ours, unit_of
from pack_msgs_py.values import MAX_EDGE_MM

#: Meanings of which a table can have one column only; of texts the better name is taken.
_SINGLE = ('length', 'width', 'height', 'depth', 'size', 'weight', 'quantity', 'max_top_load')
AXES = ('length', 'width', 'height')
_NUMBERS = (*AXES, 'weight', 'quantity', 'max_top_load')
_TIMES = re.compile(r'\s*[x×*хX]\s*')
#: Edges below this are rarely meant, mm.
THINNEST_MM = 2.0
#: Nothing that goes into boxes is denser, kg per litre; gold has 19.3.
DENSEST_KG_PER_LITRE = 20.0
MM3_PER_LITRE = 1e6


@dataclass(frozen=True)
class ColumnUse:
    """A column that is understood.

    Attributes
    ----------
    header : as it stands in the file.
    meaning : one of :data:`conveyor_sim.streams.column_names.MEANINGS`.
    unit : of its numbers, where they have one.
    unit_from : where the unit is from, for people, when it does not stand in the header.
    decimal : mark of its numbers, ``point`` or ``comma``.
    part : which number of three in a cell such as ``30x20x10``; ``None`` for the whole cell.
    """

    header: str
    meaning: str
    unit: str = ''
    unit_from: str = ''
    decimal: str = ''
    part: int | None = None

    def text(self, row: TableRow) -> str:
        """The text of this column in ``row``; empty when it has none."""
        cell = row.cells.get(self.header, '')
        if self.part is None or not cell:
            return cell
        parts = _TIMES.split(cell.strip())
        if len(parts) != 3:
            return cell
        own, last = NumberText.of(parts[self.part]), NumberText.of(parts[2])
        part = parts[self.part] if own.unit or not last.unit else f'{own.digits} {last.unit}'
        return TypedNumber(part) if isinstance(cell, TypedNumber) else part

    def value(self, row: TableRow) -> float | None:
        """The number in ``row`` in millimetres, kilograms or newtons; ``None`` when it has none.

        Raises
        ------
        BadNumber
            The text is no number, or has a unit that is none of this column's kind.
        """
        text = self.text(row)
        if not text:
            return None
        if self.part is not None and len(_TIMES.split(row.cells[self.header].strip())) != 3:
            msg = 'is not three edges, such as 30x20x10'
            raise BadNumber(msg)
        value, written = number(text, self.decimal)
        kind = KINDS.get(self.meaning, '')
        if not kind:
            if written and not (self.meaning == 'quantity' and written.casefold() in PIECES):
                msg = 'is not a number'
                raise BadNumber(msg)
            return value
        unit = unit_of(written, kind) if written else self.unit
        if not unit:
            msg = f'has the unknown unit {written}' if written else 'has no unit'
            raise BadNumber(msg)
        size = in_ours(unit, kind)
        # 2.54 cm are 25.4 mm and not 25.400000000000002.
        return value if size == 1 else round(value * size, 9)


@dataclass(frozen=True)
class Columns:
    """The columns of a table by their meaning, and the headers of those that mean nothing here."""

    uses: dict[str, ColumnUse]
    unused: tuple[str, ...]
    notes: tuple[str, ...] = ()


def has_sizes(headers: Iterable[str], reading: Reading) -> bool:
    """Whether columns with these headers say how large a box is."""
    headers = tuple(headers)
    meanings = {read_header(header).meaning for header in headers}
    given = {m for m, name in reading.columns.items() if column_called(name, headers)}
    return not missing_sizes(meanings | given)


def missing_sizes(meanings: set[str]) -> list[str]:
    """The edges that no column gives."""
    if 'size' in meanings and not meanings >= {*AXES}:
        return []
    missing = [axis for axis in AXES if axis not in meanings]
    return missing[1:] if 'depth' in meanings else missing


def understood_columns(table: BoxTable, file: str, reading: Reading) -> Columns:
    """Tell what each column of ``table`` is.

    Raises
    ------
    BoxFileError
        A size is missing, a meaning is claimed by two columns, or unit or separators are not clear.
    """
    try:
        named = _named(table.headers, reading)
        missing = missing_sizes({*named})
        if missing:
            found = ', '.join(header[:40] for header in table.headers[:12])
            hint = '' if named else '; the first line has to name the columns'
            msg = f'no column {", ".join(missing)}; found {found}{hint}'
            raise BoxFileError(msg)
        uses = _with_axes(named)
        uses = _with_decimals(uses, table, reading)
        uses, notes = _with_units(uses, table, reading)
        if not reading.decimal:
            _check_thin(uses, table)
        notes += _missed(table.headers, uses)
    except (AmbiguousColumn, UnclearBoxFile) as error:
        msg = f'box file {file}: {error}'
        raise UnclearBoxFile(msg) from None
    except BoxFileError as error:
        msg = f'box file {file}: {error}'
        raise BoxFileError(msg) from None
    used = {use.header for use in uses.values()}
    unused = tuple(header for header in table.headers if header not in used)
    return Columns(uses, unused, tuple(notes))


def column_called(name: str, headers: Sequence[str]) -> str:
    """The header that ``name`` means, as written or by its words; empty when there is none."""
    if name in headers:
        return name
    same = [header for header in headers if words_of(header) == words_of(name)]
    return same[0] if len(same) == 1 else ''


def _named(headers: Sequence[str], reading: Reading) -> dict[str, ColumnUse]:
    claims: dict[str, list[tuple[NamedColumn, str]]] = {}
    given = {meaning: column_called(name, headers) for meaning, name in reading.columns.items()}
    for meaning, header in given.items():
        if not header:
            msg = f'there is no column {reading.columns[meaning]!r} for {meaning}'
            raise BoxFileError(msg)
    for header in headers:
        if header in given.values():
            continue
        said = read_header(header)
        if said.meaning and said.meaning not in given:
            claims.setdefault(said.meaning, []).append((said, header))
    uses = {meaning: _given_use(meaning, header) for meaning, header in given.items()}
    for meaning, candidates in claims.items():
        candidates.sort(key=lambda claim: claim[0].rank)
        best, header = candidates[0]
        rivals = [other for said, other in candidates[1:] if said.grade == best.grade]
        if meaning in _SINGLE and rivals:
            msg = (
                f'columns {header!r} and {rivals[0]!r} may both be the {meaning}: leave one out, '
                'or name it in a file beside it (docs/box_lists.md)'
            )
            raise BoxFileError(msg)
        uses[meaning] = ColumnUse(header, meaning, best.unit)
    return uses


def _given_use(meaning: str, header: str) -> ColumnUse:
    kind = KINDS.get(meaning, '')
    units = [unit_of(word, kind) for word in words_of(header)[1:]] if kind else []
    return ColumnUse(header, meaning, next(filter(None, reversed(units)), ''))


def _with_axes(named: dict[str, ColumnUse]) -> dict[str, ColumnUse]:
    """Each edge has a column: of `depth` and the two others, or of the three in one cell."""
    uses = dict(named)
    size, depth = uses.pop('size', None), uses.pop('depth', None)
    missing = [axis for axis in AXES if axis not in uses]
    if missing and size is not None and not (depth is not None and len(missing) == 1):
        for part, axis in enumerate(AXES):
            uses[axis] = replace(size, meaning=axis, part=part)
    elif missing and depth is not None:
        # Width and depth are the edges of the base; beside length and width, depth is the height.
        if missing == ['length']:
            uses['length'] = replace(uses['width'], meaning='length')
            uses['width'] = replace(depth, meaning='width')
        else:
            uses[missing[0]] = replace(depth, meaning=missing[0])
    return uses


def _with_decimals(
    uses: dict[str, ColumnUse], table: BoxTable, reading: Reading
) -> dict[str, ColumnUse]:
    texts = {
        meaning: [text for row in table.rows if (text := uses[meaning].text(row))]
        for meaning in _NUMBERS
        if meaning in uses
    }
    by_header = {meaning: uses[meaning].header for meaning in texts}
    columns: dict[str, list[str]] = {}
    for meaning, header in by_header.items():
        columns.setdefault(header, []).extend(texts[meaning])
    marks = decimal_marks(columns, reading.decimal, points_by_format=table.points_by_format)
    return uses | {
        meaning: replace(uses[meaning], decimal=marks[header])
        for meaning, header in by_header.items()
    }


def _with_units(
    uses: dict[str, ColumnUse], table: BoxTable, reading: Reading
) -> tuple[dict[str, ColumnUse], list[str]]:
    uses, notes = dict(uses), []
    beside = {uses[axis].unit for axis in AXES} - {''}
    for axis in AXES:
        use = uses[axis]
        if use.unit or _has_own_units(use, table):
            continue
        unit, origin = reading.unit(LENGTH), '--units'
        if not unit and len(beside) == 1:
            unit, origin = next(iter(beside)), 'the other edges'
        if not unit:
            raise UnclearBoxFile(_no_length_unit([uses[name] for name in AXES], table))
        uses[axis] = replace(use, unit=unit, unit_from=origin)
    load = uses.get('max_top_load')
    if load is not None and not load.unit and not _has_own_units(load, table):
        msg = f'column {load.header} has no unit: call it max_top_load_n or max_top_load_kg'
        raise BoxFileError(msg)
    weight = uses.get('weight')
    if weight is not None and not weight.unit and not _has_own_units(weight, table):
        uses['weight'] = with_unit = _with_weight_unit(weight, uses, table, reading)
        if with_unit.unit_from != '--units':
            notes.append(f'column {weight.header} has no unit: read as {with_unit.unit}')
    return uses, notes


def _check_thin(uses: dict[str, ColumnUse], table: BoxTable) -> None:
    """Refuse `1.100` as 1.1 mm, though the other numbers have it so, where it may be 1100."""
    for axis in AXES:
        use = uses[axis]
        other = replace(use, decimal=COMMA if use.decimal == POINT else POINT)
        for row in table.rows:
            text = use.text(row)
            if isinstance(text, TypedNumber) or not NumberText.of(text).is_ambiguous:
                continue
            try:
                read, may_be = use.value(row) or 0.0, other.value(row) or 0.0
            except BadNumber:
                continue
            if 0 < read < THINNEST_MM <= may_be <= MAX_EDGE_MM:
                msg = (
                    f'column {use.header}: {text!r} is {read:g} mm as the other numbers of the '
                    f'file are written, and may be {may_be:g} mm: write it without separators, or '
                    f'say --decimal {use.decimal}'
                )
                raise UnclearBoxFile(msg)


def _missed(headers: Sequence[str], uses: dict[str, ColumnUse]) -> list[str]:
    """Notes on columns that sound like a number of boxes; one like a weight alone is refused."""
    unused = [name for name in headers if name not in {use.header for use in uses.values()}]
    weights = [name for name in unused if hints_at(name, 'weight')]
    if weights and 'weight' not in uses:
        msg = (
            f'column {weights[0]!r} may be a weight, but of what or in which unit is not clear: '
            'call the weight of one box weight_kg, or name its column in a file beside it '
            '(docs/box_lists.md)'
        )
        raise UnclearBoxFile(msg)
    notes = []
    weight = uses.get('weight')
    if weight is not None and is_net(weight.header):
        notes.append(f'column {weight.header} is without packaging, which the arm lifts too')
    if 'quantity' in uses:
        return notes
    counts = [name for name in unused if hints_at(name, 'quantity')]
    return notes + [f'column {name} is not taken for a number of boxes' for name in counts]


def _has_own_units(use: ColumnUse, table: BoxTable) -> bool:
    """Whether every number of a column has its unit behind it."""
    texts = [text for row in table.rows if (text := use.text(row))]
    return bool(texts) and all(NumberText.of(text).unit for text in texts)


def _no_length_unit(uses: Sequence[ColumnUse], table: BoxTable) -> str:
    row = next((row for row in table.rows if all(use.text(row) for use in uses)), None)
    shown = ' x '.join(use.text(row) for use in uses) if row is not None else 'the sizes'
    headers = ', '.join(dict.fromkeys(use.header for use in uses))
    return (
        f'columns {headers} have no unit: {shown} may be millimetres, centimetres or inches; '
        'say --units mm, cm or in'
    )


def _with_weight_unit(
    weight: ColumnUse, uses: dict[str, ColumnUse], table: BoxTable, reading: Reading
) -> ColumnUse:
    """Kilograms beside metric sizes, when boxes of such a weight can be; else it must be said."""
    said = reading.unit(WEIGHT)
    if said:
        return replace(weight, unit=said, unit_from='--units')
    in_kg = replace(weight, unit='kg', unit_from='guess')
    densities, shown = [], ''
    for row in table.rows:
        try:
            edges = [uses[axis].value(row) or 0.0 for axis in AXES]
            mass = in_kg.value(row) or 0.0
        except BadNumber:
            continue
        volume = edges[0] * edges[1] * edges[2] / MM3_PER_LITRE
        if volume > 0 and mass > 0:
            densities.append(mass / volume)
            shown = shown or weight.text(row)
    imperial = any(uses[axis].unit in ('in', 'ft') for axis in AXES)
    dense = bool(densities) and median(densities) > DENSEST_KG_PER_LITRE
    if imperial or dense:
        why = 'sizes are in inches' if imperial else 'boxes of so many kilograms cannot be'
        others = 'kilograms or pounds' if imperial else 'kilograms or grams'
        say = '--units kg or --units lb' if imperial else '--units kg or --units g'
        msg = f'column {weight.header} has no unit: {shown} may be {others}, and {why}; say {say}'
        raise UnclearBoxFile(msg)
    return in_kg
