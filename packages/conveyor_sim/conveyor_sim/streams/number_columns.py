"""How the numbers of a table are written: with a decimal point or comma, decided by whole columns.

`1.100` is 1100 in a column of decimal commas and 1.1 in one of decimal points. A column says which
by the numbers that can be read in one way only; where none of its numbers does, the other columns
of the file say it. Where nothing does, the file is refused, and both readings are shown.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

POINT, COMMA = 'point', 'comma'
_PLAIN = str.maketrans(
    {'\u00a0': ' ', '\u202f': ' ', '\u2009': ' ', '’': "'"}
    # the digits, points and commas of East Asian keyboards
    | {chr(code): chr(code - 0xFEE0) for code in (*range(0xFF10, 0xFF1A), 0xFF0C, 0xFF0E)}
)
_UNIT = re.compile(r'\s*([^\W\d_]+|["″])\.?$')
_NOT_FINITE = re.compile(r'[+-]?(nan|inf|infinity)', re.IGNORECASE)


class TypedNumber(str):
    """The text of a number that its file holds as a number: it has a decimal point."""

    __slots__ = ()


class BadNumber(ValueError):
    """A text that is no number; the message says what is wrong with it."""


class AmbiguousColumn(ValueError):
    """The numbers of a column can be read in two ways."""


def _pattern(decimal: str, group: str) -> re.Pattern[str]:
    grouped = '|'.join(rf'[1-9]\d{{0,2}}(?:{mark}\d{{3}})+' for mark in (group, ' ', "'"))
    fraction = rf'(?:{decimal}\d*)?'
    return re.compile(
        rf'[+-]?(?:(?:{grouped}|\d+){fraction}|{decimal}\d+)(?:[eE][+-]?\d+)?', re.ASCII
    )


_PATTERNS = {POINT: _pattern(r'\.', ','), COMMA: _pattern(',', r'\.')}


@dataclass(frozen=True)
class NumberText:
    """A number as it is written, and the unit behind it, if there is one."""

    digits: str
    unit: str

    @classmethod
    def of(cls, text: str) -> NumberText:
        """The parts of a cell."""
        plain = text.translate(_PLAIN).strip()
        unit = _UNIT.search(plain)
        if unit is None or unit.start() == 0 or _NOT_FINITE.fullmatch(plain):
            return cls(plain, '')
        return cls(plain[: unit.start()], unit.group(1))

    def reads(self, decimal: str) -> bool:
        """Whether the digits are a number with this decimal mark."""
        return _PATTERNS[decimal].fullmatch(self.digits) is not None

    def value(self, decimal: str) -> float:
        """The number; :class:`BadNumber` says why there is none."""
        if _NOT_FINITE.fullmatch(self.digits):
            msg = 'is not finite'
            raise BadNumber(msg)
        if not self.reads(decimal):
            other = COMMA if decimal == POINT else POINT
            msg = 'is not a number'
            if self.reads(other):
                msg = f'has no decimal {decimal}, which the other numbers of the column have'
            raise BadNumber(msg)
        mark, group = ('.', ',') if decimal == POINT else (',', '.')
        plain = re.sub(rf"[{group} ']", '', self.digits).replace(mark, '.')
        value = float(plain)
        if not math.isfinite(value):
            msg = 'is too large'
            raise BadNumber(msg)
        return value

    @property
    def is_ambiguous(self) -> bool:
        """Whether both marks read it, as different numbers."""
        if not all(map(self.reads, _PATTERNS)):
            return False
        try:
            return self.value(POINT) != self.value(COMMA)
        except BadNumber:
            return False


def number(text: str, decimal: str) -> tuple[float, str]:
    """The number in a cell and the unit behind it; :class:`BadNumber` when there is none."""
    if isinstance(text, TypedNumber):
        decimal = POINT
    parts = NumberText.of(text)
    return parts.value(decimal), parts.unit


def decimal_marks(
    columns: Mapping[str, Sequence[str]], given: str = '', *, points_by_format: bool = False
) -> dict[str, str]:
    """The decimal mark of each column.

    Parameters
    ----------
    columns : texts of each column of numbers.
    given : the mark that someone named; then it holds for all.
    points_by_format : a point is a decimal point where nothing else is known, as in files that
        separate columns by commas.

    Raises
    ------
    AmbiguousColumn
        A column can be read in two ways, or numbers in it contradict each other.
    """
    if given:
        return dict.fromkeys(columns, given)
    found = {name: _own_mark(name, texts) for name, texts in columns.items()}
    known = {mark for mark in found.values() if mark}
    return {
        name: mark or _mark_by_others(name, columns[name], known, points=points_by_format)
        for name, mark in found.items()
    }


def _own_mark(name: str, texts: Sequence[str]) -> str:
    only: dict[str, str] = {}
    votes = {POINT: 0, COMMA: 0}
    for text in texts:
        parts = NumberText.of(text)
        reads = [mark for mark in _PATTERNS if parts.reads(mark)]
        if len(reads) == 1 and not isinstance(text, TypedNumber):
            votes[reads[0]] += 1
            only.setdefault(reads[0], text)
    if votes[POINT] == votes[COMMA] and votes[POINT]:
        msg = (
            f'column {name} has both {only[POINT]!r} with a decimal point and {only[COMMA]!r} '
            'with a decimal comma: say --decimal point or --decimal comma'
        )
        raise AmbiguousColumn(msg)
    return max(votes, key=votes.__getitem__) if any(votes.values()) else ''


def _mark_by_others(name: str, texts: Sequence[str], known: set[str], *, points: bool) -> str:
    if len(known) == 1:
        return next(iter(known))
    written = [text for text in texts if not isinstance(text, TypedNumber)]
    ambiguous = [text for text in written if NumberText.of(text).is_ambiguous]
    if not ambiguous or (points and not known and all('.' in text for text in ambiguous)):
        return POINT
    parts = NumberText.of(ambiguous[0])
    msg = (
        f'column {name}: {ambiguous[0]!r} may be {parts.value(POINT):g} or {parts.value(COMMA):g}, '
        'and the other numbers of the file do not say which: say --decimal point or '
        '--decimal comma'
    )
    raise AmbiguousColumn(msg)
