"""What a figure of the summary is, and the kinds of figures that come more than once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pack_cell.report.ended_run import EndedRun
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.metrics import time_summary

Summary = dict[str, Any]


@dataclass(frozen=True)
class SummaryFigure:
    """One figure of the summary.

    Attributes
    ----------
    key : in ``summary.json``.
    text : what it is, with its unit, in Markdown.
    of : computes it; the value must go into JSON.
    line : the printed line that it is part of; empty where it is not printed.
    shown : its part of that line, from the whole summary; empty where there is nothing to say.
    is_clean : whether a run with this value is as it should be.
    """

    key: str
    text: str
    of: Callable[[EndedRun], Any]
    line: str = ''
    shown: Callable[[Summary], str] | None = None
    is_clean: Callable[[Any], bool] | None = None

    def part(self, summary: Summary) -> str:
        """What is printed of it."""
        return str(summary[self.key]) if self.shown is None else self.shown(summary)


def counted(key: str, what: str) -> Callable[[Summary], str]:
    """Print a number and ``what`` it counts."""
    return lambda summary: f'{summary[key]} {what}'


def is_zero(number: float) -> bool:
    """Whether a figure that must be 0 is so."""
    return number == 0


def boxes_now(
    key: str, text: str, kind: BoxEventKind, is_clean: Callable[[Any], bool] | None = None
) -> SummaryFigure:
    """Boxes whose last event is ``kind``."""
    return SummaryFigure(
        key, text, lambda run: run.record.count(kind), 'boxes', counted(key, key), is_clean
    )


def fill_rate(key: str, text: str, what: str) -> SummaryFigure:
    """A fill rate."""

    def shown(summary: Summary) -> str:
        value = summary[key]
        return f'{what} no bin' if value is None else f'{what} {value:.1f} %'

    return SummaryFigure(key, text, lambda run: run.fills[key], 'fill rate', shown)


def times(
    key: str,
    text: str,
    seconds: Callable[[EndedRun], Any],
    line: str = '',
    scale: tuple[float, str, int] = (1.0, 's', 2),
) -> SummaryFigure:
    """Times of which mean and quantiles count; printed by ``scale``: factor, unit, digits."""
    factor, unit, digits = scale

    def shown(summary: Summary) -> str:
        values = summary[key]
        if values['p50'] is None:
            return 'none'
        parts = [
            f'{name} {factor * values[name]:.{digits}f}' for name in ('mean', 'p50', 'p95', 'max')
        ]
        return f'{", ".join(parts)} {unit}'

    return SummaryFigure(key, text, lambda run: time_summary(seconds(run)), line, shown)
