"""A table becomes boxes: each row one, several or a rejection, and what was made of it all."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from conveyor_sim.streams.box_records import (
    DEFAULT_DENSITY_KG_PER_MM3,
    BoxFileError,
    Entry,
    RejectedRow,
)
from conveyor_sim.streams.columns import (
    AXES,
    DENSEST_KG_PER_LITRE,
    MM3_PER_LITRE,
    THINNEST_MM,
    Columns,
    ColumnUse,
    column_called,
    understood_columns,
)
from conveyor_sim.streams.number_columns import BadNumber
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.table import MAX_BOXES, BoxTable, TableRow
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import MAX_EDGE_MM, MAX_WEIGHT_KG, UP_ANY, UP_POS_Z, Box, check_box

#: An id in a file may be this long; numbers of pieces and repetition of the stream append to it.
MAX_ID_LENGTH = 180

_YES = frozenset(
    ('yes', 'y', 'true', 't', '1', 'x', 'ja', 'j', 'oui', 'o', 'si', 'sì', 'sí', 's', 'sim', 'tak',
     'ano', 'evet', 'kyllä', 'igen', 'да', '是', 'はい', '예', '✓')
)  # fmt: skip
_NO = frozenset(
    ('no', 'n', 'false', 'f', '0', '-', 'nein', 'nee', 'nej', 'nei', 'non', 'nao', 'não', 'nie',
     'ne', 'ei', 'nem', 'hayır', 'нет', '否', 'いいえ', '아니오')
)  # fmt: skip
#: What is understood and stays with the box all the same.
_KEPT = ('source', 'sequence', 'target')
#: A long number as a spreadsheet shows it, and loses its last digits when it saves it so.
_SPOILT = re.compile(r'\d[.,]\d+E\+\d+')
_UP_WORDS = {'any': UP_ANY, 'upright': UP_POS_Z}


@dataclass(frozen=True)
class BoxList:
    """What a file holds, and how it was understood.

    ``columns`` are those that count, ``notes`` what people should know before they use the boxes,
    a line each.
    """

    entries: tuple[Entry, ...]
    columns: tuple[ColumnUse, ...] = ()
    notes: tuple[str, ...] = ()


class _BadCell(ValueError):
    """One cell cannot be used."""

    def __init__(self, column: str, value: str, problem: str) -> None:
        super().__init__(problem)
        self.column = column
        self.value = value


def box_list(table: BoxTable, file: str, reading: Reading | None = None) -> BoxList:
    """The boxes of ``table`` in its order, with ids that are unique.

    Raises
    ------
    BoxFileError
        See :func:`conveyor_sim.streams.columns.understood_columns`; or it asks for too many boxes.
    """
    reading = reading or Reading()
    columns = understood_columns(table, file, reading)
    maker = _BoxMaker(columns, table, file, reading)
    return BoxList(
        tuple(maker.entries()), tuple(columns.uses.values()), tuple(maker.notes(columns))
    )


class _BoxMaker:
    """Makes the boxes of one table, and counts what is worth a note."""

    def __init__(self, columns: Columns, table: BoxTable, file: str, reading: Reading) -> None:
        self._uses = columns.uses
        self._table = table
        self._file = file
        self._orders = ''
        if reading.order_by:
            named = self._uses.get(reading.order_by)
            self._orders = named.header if named else column_called(reading.order_by, table.headers)
            if not self._orders:
                msg = (
                    f'box file {file} has no column {reading.order_by!r} to keep orders apart by; '
                    f'found {", ".join(table.headers[:12])}'
                )
                raise BoxFileError(msg)
        self._others = tuple(
            header
            for header in table.headers
            if header not in {use.header for use in self._uses.values()}
        ) + tuple(
            use.header
            for name, use in self._uses.items()
            if name in ('source', 'sequence', 'target')
        )
        self._seen: Counter[str] = Counter()
        self._pieces = [self._quantity(row) for row in table.rows]
        self._stems = [self._stem(row) for row in table.rows]
        self._totals: Counter[str] = Counter()
        for stem, pieces in zip(self._stems, self._pieces, strict=True):
            self._totals[stem] += pieces if isinstance(pieces, int) else 1
        if sum(self._totals.values()) > MAX_BOXES:
            msg = f'box file {file} asks for more than {MAX_BOXES} boxes'
            raise BoxFileError(msg)

    def entries(self) -> Iterator[Entry]:
        """Each row as boxes or as a rejected row, in order."""
        reserved = {stem for stem, total in self._totals.items() if total == 1}
        taken = _Names(reserved)
        rows = zip(self._table.rows, self._stems, self._pieces, strict=True)
        for number, (row, stem, pieces) in enumerate(rows, start=1):
            unnamed = f'row-{row.line or number}'
            box: Box | None = None
            for piece in range(1, (pieces if isinstance(pieces, int) else 1) + 1):
                name = self._name(stem, unnamed, piece, pieces, taken)
                try:
                    if isinstance(pieces, _BadCell):
                        raise pieces
                    box = self._box(row, name) if box is None else replace(box, id=name)
                    entry: Entry = box
                except _BadCell as error:
                    entry = self._rejected(row, error, name, unnamed, pieces, taken)
                taken.given.add(entry.id if isinstance(entry, Box) else entry.box_id)
                yield entry
                if isinstance(entry, RejectedRow):
                    break

    def notes(self, columns: Columns) -> Iterator[str]:
        """What of the file is not as one may expect."""
        yield from self._table.notes
        yield from columns.notes
        if columns.unused:
            yield f'not used: {", ".join(columns.unused)}'
        if 'target' in self._uses:
            use = self._uses['target']
            targets = sorted({text for row in self._table.rows if (text := use.text(row))})
            yield f'not used: {use.header} ({", ".join(targets[:4])}); --bin says which bin'
        several = {stem: n for stem, n in self._totals.items() if stem and n > 1}
        if several:
            stem, count = next(iter(several.items()))
            names = '1 name stands' if len(several) == 1 else f'{len(several)} names stand'
            yield (
                f'{names} for more than one box, which are numbered: '
                f'{stem}/1 to {stem}/{count}' + (' and so on' if len(several) > 1 else '')
            )
        spoilt = [stem for stem in self._totals if _SPOILT.fullmatch(stem)]
        if spoilt:
            yield f'a spreadsheet has shortened ids such as {spoilt[0]}: which box is which?'
        none = sum(pieces == 0 for pieces in self._pieces)
        if none:
            yield f'{_rows(none, "ask", "asks")} for no box: the quantity is 0'
        if 'weight' not in self._uses:
            yield 'no column of weights: boxes weigh 1 kg per 6000 cm3'
        else:
            blank = sum(not self._uses['weight'].text(row) for row in self._table.rows)
            if blank:
                yield f'{_rows(blank, "have", "has")} no weight: the boxes weigh 1 kg per 6000 cm3'
        yield from self._size_notes()

    def _size_notes(self) -> Iterator[str]:
        thin = dense = 0
        weight = self._uses.get('weight')
        for row in self._table.rows:
            try:
                edges = [self._uses[axis].value(row) or 0.0 for axis in AXES]
                mass = (weight.value(row) if weight else None) or 0.0
            except BadNumber:
                continue
            thin += any(0 < edge < THINNEST_MM for edge in edges)
            dense += 0 < math.prod(edges) * DENSEST_KG_PER_LITRE < mass * MM3_PER_LITRE
        if thin:
            yield f'{_rows(thin, "have", "has")} an edge below {THINNEST_MM:g} mm: are units right?'
        if dense:
            yield f'{_rows(dense, "are", "is")} heavier than gold: are units right?'

    # -- names ----------------------------------------------------------------------------------

    def _stem(self, row: TableRow) -> str:
        """What the file calls the box of a row; empty when it does not."""
        if row.named:
            return row.named
        for meaning in ('id', 'sku'):
            name = self._text(row, meaning)
            if name:
                return name
        order, sequence = self._text(row, 'order'), self._text(row, 'sequence')
        if not (order and sequence):
            return ''
        return '-'.join(filter(None, (self._text(row, 'source'), order, sequence)))

    def _name(
        self, stem: str, unnamed: str, piece: int, pieces: int | _BadCell, known: _Names
    ) -> str:
        if not stem:
            name = unnamed if pieces == 1 else f'{unnamed}/{piece}'
            return known.fresh(name)
        if self._totals[stem] == 1:
            return stem
        self._seen[stem] += 1
        return known.fresh(f'{stem}/{self._seen[stem]}')

    def _rejected(
        self,
        row: TableRow,
        error: _BadCell,
        name: str,
        unnamed: str,
        pieces: int | _BadCell,
        taken: _Names,
    ) -> RejectedRow:
        cell = f', column {error.column}: {error.value!r} ' if error.column else ': '
        text = f'{self._file}, {row.place}{cell}{error}'
        if isinstance(pieces, int) and pieces > 1:
            text += f' ({pieces} boxes)'
        usable = len(name) <= MAX_ID_LENGTH and name.isprintable()
        name = name if usable else taken.fresh(unnamed)
        return RejectedRow(
            name, self._file, row.line, error.column, error.value, Reason.INVALID_DATA, text
        )

    # -- one row --------------------------------------------------------------------------------

    def _box(self, row: TableRow, name: str) -> Box:
        if row.damage:
            raise _BadCell('', '', row.damage)
        if len(name) > MAX_ID_LENGTH or not name.isprintable():
            column = next((self._uses[m].header for m in ('id', 'sku') if m in self._uses), 'id')
            problem = f'must be 1 to {MAX_ID_LENGTH} printable characters'
            raise _BadCell(column, name[:50], problem)
        length, width, height = (self._edge(row, axis) for axis in AXES)
        weight = self._positive(row, 'weight', MAX_WEIGHT_KG, 'kg')
        destination, order = self._text(row, 'destination'), self._text(row, 'order')
        kept = [('sku', self._sku(row)), ('order_id', order)]
        if self._orders:
            kept.append(('destination', destination))
            destination = row.cells.get(self._orders, '')
            if not destination:
                raise _BadCell(self._orders, '', 'is missing, so the box is of no order')
        kept += [(header, row.cells.get(header, '')) for header in self._others]
        return check_box(
            Box(
                id=name,
                size_mm=(length, width, height),
                weight_kg=weight or length * width * height * DEFAULT_DENSITY_KG_PER_MM3,
                allowed_up=self._allowed_up(row),
                max_top_load_n=self._top_load(row),
                destination=destination,
                extra=tuple((key, text) for key, text in kept if text),
            )
        )

    def _sku(self, row: TableRow) -> str:
        """The article of a box: of its own column, or the id that several boxes share."""
        own = self._text(row, 'sku')
        name = self._text(row, 'id')
        return own or (name if self._totals[name] > 1 else '')

    def _text(self, row: TableRow, meaning: str) -> str:
        use = self._uses.get(meaning)
        return use.text(row) if use else ''

    def _number(self, row: TableRow, meaning: str) -> float | None:
        use = self._uses.get(meaning)
        if use is None:
            return None
        try:
            return use.value(row)
        except BadNumber as error:
            raise _BadCell(use.header, use.text(row), str(error)) from None

    def _edge(self, row: TableRow, axis: str) -> float:
        edge = self._positive(row, axis, MAX_EDGE_MM, 'mm')
        if edge is None:
            raise _BadCell(self._uses[axis].header, '', 'is missing')
        return edge

    def _positive(self, row: TableRow, meaning: str, limit: float, unit: str) -> float | None:
        """The number, above 0 and at most ``limit``; ``None`` when the row has none."""
        value = self._number(row, meaning)
        if value is None:
            return None
        use = self._uses[meaning]
        if value <= 0:
            raise _BadCell(use.header, use.text(row), f'must be above 0 {unit}')
        if value > limit:
            is_ours = use.unit == unit
            found = '' if is_ours else f'is {value:g} {unit} and '
            raise _BadCell(use.header, use.text(row), f'{found}must be at most {limit:g} {unit}')
        return value

    def _quantity(self, row: TableRow) -> int | _BadCell:
        """How many boxes a row stands for, or why that cannot be told."""
        try:
            value = self._number(row, 'quantity')
        except _BadCell as error:
            return error
        if value is None:
            return 1
        if value < 0 or value != math.floor(value) or value > MAX_BOXES:
            use = self._uses['quantity']
            return _BadCell(use.header, use.text(row), f'must be a whole number up to {MAX_BOXES}')
        return int(value)

    def _flag(self, row: TableRow, meaning: str) -> bool | None:
        """Yes or no; ``None`` when the row says neither."""
        text = self._text(row, meaning).casefold()
        if not text:
            return None
        if text not in _YES | _NO:
            use = self._uses[meaning]
            raise _BadCell(use.header, use.text(row), 'is neither yes nor no')
        return text in _YES

    def _allowed_up(self, row: TableRow) -> int:
        text = self._text(row, 'allowed_up')
        mask = UP_ANY
        if text:
            mask = _UP_WORDS.get(text.lower()) or (
                int(text) if re.fullmatch('[0-9]{1,2}', text) else 0
            )
        upright = self._flag(row, 'upright') or self._flag(row, 'tiltable') is False
        if upright:
            mask &= UP_POS_Z
        if not 1 <= mask <= UP_ANY:
            words = ', '.join(_UP_WORDS)
            use = self._uses.get('allowed_up') or self._uses['upright']
            raise _BadCell(use.header, use.text(row), f'must be 1 to {UP_ANY}, or one of {words}')
        return mask

    def _top_load(self, row: TableRow) -> float | None:
        load = self._number(row, 'max_top_load')
        if load is not None and load < 0:
            use = self._uses['max_top_load']
            raise _BadCell(use.header, use.text(row), 'must not be negative')
        bare = self._flag(row, 'fragile'), self._flag(row, 'unstackable')
        if any(bare) or self._flag(row, 'stackable') is False:
            return 0.0
        return load


def _rows(count: int, many: str, one: str) -> str:
    return f'1 row {one}' if count == 1 else f'{count} rows {many}'


@dataclass(frozen=True)
class _Names:
    """Names of boxes: those that rows will have, and those that are given."""

    reserved: set[str]
    given: set[str] = field(default_factory=set)

    def fresh(self, wanted: str) -> str:
        """``wanted``, or the like of it that no other box has."""
        while wanted in self.reserved or wanted in self.given:
            wanted += '_'
        return wanted
