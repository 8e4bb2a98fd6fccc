"""The figures of a run that a manager asks for, in words."""

from __future__ import annotations

import statistics
from collections import Counter
from dataclasses import dataclass

from pack_cell.report_page.run_folder import FinishedRun

#: Hours of a shift, for the bins that it fills.
SHIFT_H = 8


@dataclass(frozen=True)
class KeyFigure:
    """A value that is read from afar, what it is, and what else belongs to it.

    ``tone`` is ``good``, ``bad`` or, where nothing is to be judged, empty.
    """

    value: str
    what: str
    more: str = ''
    tone: str = ''


def key_figures(run: FinishedRun) -> list[KeyFigure]:
    """How full, how many an hour, bins a day, what was refused, whether all is accounted for."""
    figures = [_fill(run), _rate(run), _bins_a_day(run), _bins(run), _refused(run), _accounted(run)]
    return [figure for figure in figures if figure is not None]


def _fill(run: FinishedRun) -> KeyFigure:
    fill = run.summary.get('fill_closed')
    if fill is None:
        everything = run.summary.get('fill_all')
        value = '–' if everything is None else f'{everything:.1f} %'
        return KeyFigure(value, 'full, the bins so far', 'no bin was closed')
    fills = sorted(of_run.fill for of_run in run.closed_bins)
    closed = run.summary.get('closed_bins', len(fills))
    spread = f', {fills[0]:.1f} to {fills[-1]:.1f} %' if len(fills) > 1 else ''
    bins = 'bin' if closed == 1 else 'bins'
    return KeyFigure(f'{fill:.1f} %', 'full, the closed bins', f'{closed} {bins}{spread}')


def _rate(run: FinishedRun) -> KeyFigure:
    hourly = run.summary.get('boxes_per_hour')
    if not hourly:
        return KeyFigure('–', 'boxes an hour', 'no box was placed')
    misses = run.summary.get('deadline_misses', 0)
    deadline_s = run.summary.get('deadline_s')
    late = f'; {misses} missed the deadline of {deadline_s:g} s' if deadline_s else ''
    return KeyFigure(
        f'{hourly:,.0f}', 'boxes an hour', f'{3600 / hourly:.2f} s a box{late}',
        'bad' if misses else '',
    )  # fmt: skip


def boxes_per_bin(run: FinishedRun) -> float | None:
    """Mean over the closed bins; ``None`` where none was, or where it was not written down."""
    closed = run.closed_bins
    return statistics.fmean(len(of_run.boxes) for of_run in closed) if closed else None


def _bins_a_day(run: FinishedRun) -> KeyFigure:
    hourly, per_bin = run.summary.get('boxes_per_hour'), boxes_per_bin(run)
    if not hourly or not per_bin:
        unknown = run.summary.get('closed_bins') and not run.closed_bins
        why = 'which bins were closed is not known' if unknown else 'no bin was closed'
        return KeyFigure('–', 'bins a day at this rate', why)
    hourly_bins = hourly / per_bin
    return KeyFigure(
        f'{24 * hourly_bins:,.0f}',
        'bins a day at this rate',
        f'{SHIFT_H * hourly_bins:,.0f} in a shift of {SHIFT_H} hours; {per_bin:.1f} boxes a bin',
    )


def _bins(run: FinishedRun) -> KeyFigure | None:
    """Bins used, and how many would do without a belt; ``None`` where that is not known."""
    used, offline = run.summary.get('bins_used'), run.summary.get('bins_offline')
    if not used or not offline:
        return None
    packed = f', {offline["packed"]} by an offline packer' if offline.get('packed') else ''
    more = f'without a belt {offline["least"]} at least{packed}'
    return KeyFigure(f'{used}', 'bins used' if used > 1 else 'bin used', more)


def refusals(run: FinishedRun) -> Counter[str]:
    """Rejected boxes by reason."""
    return Counter(
        (box.reason or 'no reason told').split(':')[0].replace('_', ' ')
        for box in run.boxes
        if box.outcome == 'rejected'
    )


def _refused(run: FinishedRun) -> KeyFigure:
    supplied, rejected = run.summary.get('boxes_supplied', 0), run.summary.get('rejected', 0)
    share = f' ({100 * rejected / supplied:.1f} %)' if rejected and supplied else ''
    reasons = ', '.join(f'{count} {reason}' for reason, count in refusals(run).most_common())
    return KeyFigure(
        f'{rejected}', f'of {supplied} boxes refused{share}', reasons or 'none to be packed by hand'
    )


def _accounted(run: FinishedRun) -> KeyFigure:
    lost, unknown = run.summary.get('lost', 0), run.summary.get('unaccounted', 0)
    broken = run.summary.get('rule_violations', 0)
    more = f'{unknown} unaccounted for, {broken} packing rules broken'
    return KeyFigure(f'{lost}', 'boxes lost', more, 'bad' if lost or unknown or broken else 'good')


def verdict(run: FinishedRun) -> str:
    """The run in one sentence."""
    summary = run.summary
    fill = summary.get('fill_closed')
    closed = summary.get('closed_bins', 0)
    bins = f'{closed} {"bin" if closed == 1 else "bins"} closed'
    full = '' if fill is None else f', on average {fill:.1f} % full'
    hourly = summary.get('boxes_per_hour')
    rate = f', {hourly:,.0f} boxes an hour' if hourly else ''
    return (
        f'{summary.get("placed", 0)} of {summary.get("boxes_supplied", 0)} boxes packed into '
        f'{summary.get("bin", "")} bins; {bins}{full}{rate}.'
    )
