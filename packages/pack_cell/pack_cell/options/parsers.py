"""What turns the text of an option into its value, for any command; errors say what to write."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from pack_msgs_py.parameter_fields import Value
from pack_msgs_py.values import BinSpec, parse_bin


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr, with exit code 2."""

    def error(self, message: str) -> NoReturn:
        """Print ``message`` and where to look, and leave with code 2."""
        self.exit(2, f'{self.prog}: {message} (see {self.prog} --help)\n')


class BadValue(argparse.ArgumentTypeError, ValueError):
    """A text that is no value of its option; the message says why, argparse adds the option."""


@dataclass(frozen=True)
class NumberRange:
    """Reads a finite number from ``low``, or above it, to ``high``; as text it names the range."""

    low: float
    high: float
    unit: str = ''
    whole: bool = False
    above: bool = False

    def __call__(self, text: str) -> float:
        """The number; :class:`BadValue` when ``text`` is none or lies outside."""
        try:
            value = int(text) if self.whole else float(text)
        except ValueError:
            kind = 'a whole number' if self.whole else 'a number'
            msg = f'{text!r} is not {kind}'
            raise BadValue(msg) from None
        too_low = value <= self.low if self.above else value < self.low
        if not math.isfinite(value) or too_low or value > self.high:
            msg = f'{text} is out of range: it must be {self}'
            raise BadValue(msg)
        return value

    def __str__(self) -> str:
        low, high = (f'{limit:.15g}' for limit in (self.low, self.high))
        if self.above:
            span = f'above {low} and at most {high}'
        elif self.whole and self.high - self.low == 2:
            span = f'{low}, {self.low + 1:.15g} or {high}'
        else:
            span = f'{low} to {high}'
        return f'{span} {self.unit}'.rstrip()


def whole(low: int, high: int, unit: str = '') -> NumberRange:
    """Reads a whole number from ``low`` to ``high``."""
    return NumberRange(low, high, unit, whole=True)


#: Margins that replace those of a profile, in `cell run` and `cell bench` alike.
CLEARANCE, RESOLUTION = NumberRange(0, 100, 'mm'), whole(1, 100, 'mm')


@dataclass(frozen=True)
class OneOf:
    """Reads one of several words; ``words`` are given when they are first asked for.

    Either the words alone, or each with a few words on what it means.
    """

    find_words: Callable[[], Mapping[str, str] | tuple[str, ...]]

    @property
    def words(self) -> tuple[str, ...]:
        """What can be chosen."""
        return tuple(self.find_words())

    @property
    def meanings(self) -> Mapping[str, str]:
        """What the words mean, as far as it is told."""
        words = self.find_words()
        return words if isinstance(words, Mapping) else {}

    def __call__(self, text: str) -> str:
        """``text``; :class:`BadValue` when it is none of the words."""
        if text not in self.words:
            msg = f'{text!r} is unknown: use one of {", ".join(self.words)}'
            raise BadValue(msg)
        return text

    def __str__(self) -> str:
        return ', '.join(self.words)


def checked(check: Callable[[str], object]) -> Callable[[str], str]:
    """Reads the text itself, once ``check`` has found nothing wrong with it."""

    def read(text: str) -> str:
        check(text)
        return text

    return read


def bin_kind(text: str) -> BinSpec:
    """Read a kind of bin."""
    try:
        return parse_bin(text)
    except ValueError as error:
        raise BadValue(str(error)) from None


def optional_path(text: str) -> Path | None:
    """Read a path; the empty text is none."""
    return Path(text) if text else None


def typed_value(kind: Any, written: str) -> Value:  # noqa: ANN401 - a type among Value
    """What was ``written`` for a parameter of type ``kind``; the text itself where it is none."""
    if kind is bool:
        return {'true': True, 'false': False}.get(written.lower(), written)
    try:
        value: Value = kind(written)
    except ValueError:
        return written
    return value
