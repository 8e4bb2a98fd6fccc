"""Fill-rate metrics, always printed together, and summaries of measured times."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from pack_msgs_py.values import Bin


def mean_fill_percent(bins: Iterable[Bin]) -> float | None:
    """Mean fill rate in percent (eq. 2 of Ojha et al.); ``None`` without a bin."""
    rates = [one.fill_rate for one in bins]
    return 100.0 * sum(rates) / len(rates) if rates else None


def fill_metrics(closed: Sequence[Bin], still_open: Sequence[Bin]) -> dict[str, float | None]:
    """The three fill rates in percent.

    ``fill_closed`` : mean over closed bins (the paper's); an empty one does not count.
    ``fill_all`` : mean over all bins that hold a box, closed or not.
    ``fill_first_failure`` : fill of the bin that was closed first, when for the first time no box
    of the look-ahead fitted (the learning papers' single-bin measure).
    """
    closed = [one for one in closed if one.boxes]
    used = [one for one in (*closed, *still_open) if one.boxes]
    return {
        'fill_closed': mean_fill_percent(closed),
        'fill_all': mean_fill_percent(used),
        'fill_first_failure': mean_fill_percent(closed[:1]),
    }


def quantile(values: Sequence[float], q: float) -> float:
    """Smallest value that at least the share ``q`` of ``values`` does not exceed (nearest rank)."""
    ordered = sorted(values)
    return ordered[max(0, math.ceil(q * len(ordered)) - 1)]


def time_summary(seconds: Sequence[float]) -> dict[str, float | None]:
    """Mean, median, 95 and 99 percent quantile and maximum; all ``None`` without a value."""
    if not seconds:
        return dict.fromkeys(('mean', 'p50', 'p95', 'p99', 'max'))
    return {
        'mean': sum(seconds) / len(seconds),
        'p50': quantile(seconds, 0.50),
        'p95': quantile(seconds, 0.95),
        'p99': quantile(seconds, 0.99),
        'max': max(seconds),
    }
