"""When boxes come to the induct, in robot time.

A model is a sequence of times that depends on nothing but its own description and the seed, so a
restart at any robot time goes on with the same boxes at the same times. A box that has come waits
upstream until the belt has room for it.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

#: What the parameter `arrivals` may be, for messages and help.
FORMS = 'saturated, poisson:BOXES_PER_HOUR, bursts:SIZE,GAP_S or recorded:FILE'


class Arrivals:
    """A sequence of arrival times, each not earlier than the one before."""

    def __init__(self, times: Iterator[float] | None, description: str) -> None:
        self.description = description
        self._times = times
        self._count = 0
        self._next_s = math.inf if times is None else next(times)

    def arrived(self, robot_s: float) -> float:
        """How many boxes have come until then; infinite when there is always another one.

        ``robot_s`` must not be earlier than in the call before.
        """
        if self._times is None:
            return math.inf
        while self._next_s <= robot_s:
            self._count += 1
            self._next_s = next(self._times)
        return self._count

    def next_s(self, number: float, robot_s: float) -> float | None:
        """When there will be more than ``number`` boxes; ``None`` when there are already."""
        if self.arrived(robot_s) > number:
            return None
        return self._next_s


def find_arrivals(text: str, seed: int = 0) -> Arrivals:
    """The model that the parameter `arrivals` asks for.

    Raises
    ------
    ValueError
        The text, a number in it, or the file cannot be used.
    """
    kind, _, rest = text.strip().partition(':')
    makers: dict[str, Callable[[str, int], Iterator[float] | None]] = {
        'saturated': _saturated,
        'poisson': _poisson,
        'bursts': _bursts,
        'recorded': _recorded,
    }
    if kind not in makers:
        msg = f'arrivals is {text!r}; it must be {FORMS}'
        raise ValueError(msg)
    return Arrivals(makers[kind](rest, seed), text.strip())


def _saturated(rest: str, seed: int) -> None:
    if rest:
        msg = f'arrivals saturated takes nothing, {rest!r} was given'
        raise ValueError(msg)


def _poisson(rest: str, seed: int) -> Iterator[float]:
    per_hour = _number('poisson', 'boxes per hour', rest)
    return _exponential_sums(per_hour / 3600.0, f'arrivals/{seed}')


def _exponential_sums(per_second: float, seed: str) -> Iterator[float]:
    draws, at_s = random.Random(seed), 0.0
    while True:
        at_s += draws.expovariate(per_second)
        yield at_s


def _bursts(rest: str, seed: int) -> Iterator[float]:
    size, comma, gap = rest.partition(',')
    if not comma or not size.strip().isdecimal() or int(size) < 1:
        msg = f'arrivals bursts:{rest} must be a whole number of boxes from 1 on, and the seconds'
        raise ValueError(msg)
    gap_s, boxes = _number('bursts', 'seconds', gap), int(size)
    return (burst * gap_s for burst in count() for _ in range(boxes))


def _recorded(rest: str, seed: int) -> Iterator[float]:
    times = read_times(Path(rest).expanduser())
    return (turn * times[-1] + time_s for turn in count() for time_s in times)


def read_times(path: Path) -> list[float]:
    """Time stamps of a file, seconds since the first line, one in a line.

    Empty lines, and lines that begin with ``#``, are passed over; a first line without a digit is
    a header, whose unit (`ms`, `min`, `h`) counts. Where there are more columns the first one
    counts. Semicolons, tabs and bars separate columns; a comma does, or is a decimal comma, as the
    header says (one name or more) or as only one of the two is possible.

    Raises
    ------
    ValueError
        The file cannot be read, holds no time after 0, its times do not grow, or its commas may
        mean either.
    """
    try:
        lines = path.read_text(encoding='utf-8-sig').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        msg = f'arrivals: {path} cannot be read: {error}'
        raise ValueError(msg) from error
    fields = [
        (number, re.split(r'[;\t|]', line)[0].strip())
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith('#')
    ]
    header = fields.pop(0)[1] if fields and not re.search('[0-9]', fields[0][1]) else ''
    if _has_decimal_commas(fields, header, path):
        fields = [(number, field.replace(',', '.')) for number, field in fields]
    else:
        fields = [(number, field.split(',')[0].strip()) for number, field in fields]
    words = re.findall('[a-z]+', header.split(',')[0].lower())
    unit_s = next((_UNITS_S[word] for word in reversed(words) if word in _UNITS_S), 1.0)
    return [time * unit_s for time in _checked_times(fields, path)]


_UNITS_S = {
    'ms': 0.001, 'milliseconds': 0.001, 'min': 60.0, 'minutes': 60.0, 'minuten': 60.0,
    'h': 3600.0, 'hours': 3600.0, 'stunden': 3600.0,
}  # fmt: skip
_THOUSANDS = re.compile(r'\d{1,3}(\.\d{3})+,\d+', re.ASCII)


_WITH_POINT = re.compile(r'[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?', re.ASCII)
_WITH_COMMA = re.compile(r'[+-]?\d+(,\d+)?', re.ASCII)


def _has_decimal_commas(fields: list[tuple[int, str]], header: str, path: Path) -> bool:
    """Whether a comma is a decimal comma and not between two columns."""
    with_comma = [(number, field) for number, field in fields if ',' in field]
    for number, field in with_comma:
        if _THOUSANDS.fullmatch(field):
            msg = (
                f'arrivals: {path}, line {number}: {field!r} seems to have a decimal comma and '
                'points between thousands: write it without these'
            )
            raise ValueError(msg)
    possible = all(_WITH_COMMA.fullmatch(field) for _, field in fields)
    if not with_comma or not possible or ',' in header:
        return False
    if header or any(re.search(r',0\d', field) for _, field in with_comma):
        return True
    number, field = with_comma[-1]
    whole, _, fraction = field.partition(',')
    msg = (
        f'arrivals: {path}, line {number}: {field!r} may be the time {whole}.{fraction} s, or the '
        f'time {whole} s and a second column {fraction}: put a header above the times, time_s for '
        'decimal commas or time_s,box for columns'
    )
    raise ValueError(msg)


def _checked_times(fields: list[tuple[int, str]], path: Path) -> list[float]:
    times: list[float] = []
    first: float | None = None
    for number, field in fields:
        finite = field.lower() not in ('nan', 'inf', '-inf')
        if finite and not _WITH_POINT.fullmatch(field):
            msg = f'arrivals: {path}, line {number}: {field!r} is not a number of seconds'
            raise ValueError(msg)
        value = float(field)
        if not math.isfinite(value):
            msg = f'arrivals: {path}, line {number}: {field} is not finite'
            raise ValueError(msg)
        first = value if first is None else first
        if times and value - first < times[-1]:
            msg = f'arrivals: {path}, line {number}: {field} s is before the line above'
            raise ValueError(msg)
        times.append(value - first)
    if not times or times[-1] <= 0.0:
        msg = f'arrivals: {path} must hold at least two different times'
        raise ValueError(msg)
    return times


def _number(kind: str, unit: str, text: str) -> float:
    """A finite number above zero."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value <= 0.0:
        msg = f'arrivals {kind}: {text!r} must be {unit}, a finite number above 0'
        raise ValueError(msg)
    return value
