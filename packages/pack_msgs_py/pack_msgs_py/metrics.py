"""Fill-rate metrics, always printed together, and summaries of measured times."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pack_msgs_py.values import Bin


def fill_metrics(closed: Sequence[Bin], still_open: Sequence[Bin]) -> dict[str, float | None]:
    """The three fill rates (eq. 2 of Ojha et al.) in percent; an empty bin does not count.

    ``fill_closed`` : mean over closed bins (the paper's).
    ``fill_all`` : mean over all bins that hold a box, closed or not.
    ``fill_first_failure`` : fill of the bin that was closed first, when for the first time no box
    of the look-ahead fitted (the learning papers' single-bin measure).
    """
    return fill_metrics_of(
        [bin_.fill_rate for bin_ in closed if bin_.boxes],
        [bin_.fill_rate for bin_ in still_open if bin_.boxes],
    )


def fill_metrics_of(
    closed: Sequence[float], still_open: Sequence[float]
) -> dict[str, float | None]:
    """:func:`fill_metrics` of the fill rates, 0 to 1, of bins that hold a box."""
    return {
        'fill_closed': _mean_percent(closed),
        'fill_all': _mean_percent([*closed, *still_open]),
        'fill_first_failure': _mean_percent(closed[:1]),
    }


def _mean_percent(rates: Sequence[float]) -> float | None:
    return 100.0 * sum(rates) / len(rates) if rates else None


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
