"""When the belt jams, in robot time: it stands still and nothing is fed until the jam is over.

Like the arrivals, jams depend on nothing but their description and the seed.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

#: What the parameter `jams` may be, for messages and help.
FORMS = 'empty, random:PER_HOUR,SECONDS or at:START_S+SECONDS,START_S+SECONDS'


class Jams:
    """Intervals of robot time in which the belt stands, one after the other."""

    def __init__(self, intervals: Iterator[tuple[float, float]]) -> None:
        self._intervals = intervals
        self._begin_s, self._end_s = next(intervals, (math.inf, math.inf))

    def jammed(self, robot_s: float) -> bool:
        """Whether the belt is jammed; ``robot_s`` must not be earlier than in the call before."""
        while robot_s >= self._end_s:
            self._begin_s, self._end_s = next(self._intervals, (math.inf, math.inf))
        return self._begin_s <= robot_s

    def next_change_s(self, robot_s: float) -> float:
        """When the next jam begins, or the one that is there ends; infinite for never."""
        return self._end_s if self.jammed(robot_s) else self._begin_s


def find_jams(text: str, seed: int = 0) -> Jams:
    """The jams that the parameter `jams` asks for.

    Raises
    ------
    ValueError
        The text or a number in it cannot be used.
    """
    text = text.strip()
    if not text:
        return Jams(iter(()))
    kind, _, rest = text.partition(':')
    if kind == 'random':
        per_hour, _, seconds = rest.partition(',')
        rate = _number('jams per hour', per_hour)
        return Jams(_random(rate / 3600.0, _number('seconds of a jam', seconds), seed))
    if kind == 'at':
        return Jams(iter(_listed(rest)))
    msg = f'jams is {text!r}; it must be {FORMS}'
    raise ValueError(msg)


def _random(per_second: float, seconds: float, seed: int) -> Iterator[tuple[float, float]]:
    draws, free_s = random.Random(f'jams/{seed}'), 0.0
    while True:
        begin_s = free_s + draws.expovariate(per_second)
        free_s = begin_s + seconds
        yield begin_s, free_s


def _listed(rest: str) -> list[tuple[float, float]]:
    intervals: list[tuple[float, float]] = []
    for part in rest.split(','):
        begin, _, seconds = part.partition('+')
        begin_s = _number('start of a jam', begin, zero=True)
        end_s = begin_s + _number('seconds of a jam', seconds)
        if intervals and begin_s < intervals[-1][1]:
            msg = f'jams: the one at {begin_s:g} s begins before the one before it is over'
            raise ValueError(msg)
        intervals.append((begin_s, end_s))
    return intervals


def _number(what: str, text: str, *, zero: bool = False) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not zero):
        msg = f'jams: {text!r} as {what} must be a finite number above 0; the form is {FORMS}'
        raise ValueError(msg)
    return value
