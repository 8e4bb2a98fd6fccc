"""What stands beside the scene: figures, bins, the decision, alarms, as pieces of HTML."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pack_cell.pages.rendering import render
from pack_cell.view.banner import for_the_page
from pack_cell.view.cell_view import CellView
from pack_cell.view.plain_words import REASONS, runner_up_lines
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import PlacementStatus

#: Happenings that are shown.
SHOWN = 5
_HOW = {
    PlacementStatus.OPTIMAL: 'the best that the rules allow',
    PlacementStatus.BUDGET: 'the best found in the time there was',
    PlacementStatus.FALLBACK: 'by the simpler rule, as the algorithm gave no answer',
}


def figures_html(view: CellView) -> str:
    """Figures, and the fill of every open bin."""
    figures, scan = view.figures, view.scan
    total = None if scan is None or scan.remaining < 0 else scan.supplied + scan.remaining
    rejects = ''.join(
        f', {count} {REASONS[reason]}' for reason, count in figures.rejects.most_common()
    )
    return render(
        'view/figures.html',
        tiles=(
            ('placed', f'{figures.placed}' + (f' of {total}' if total else '')),
            ('boxes an hour', _number(figures.boxes_per_hour)),
            ('fill of open bins', _percent(view.fill_now)),
            (f'fill of {len(figures.closed)} closed', _percent(figures.fill_closed)),
            ('ms planning, p95', _number(figures.planning_p95_s, 1000)),
            (f's to spare{_late(view)}', _number(figures.mean_slack_s, 1, 2)),
            (f'rejected{rejects}', str(sum(figures.rejects.values()))),
        ),
        bins=[
            (found.station, found.id, found.destination, len(found.boxes), 100 * found.fill_rate)
            for found in sorted(view.bins, key=lambda standing: standing.station)
        ],
        closing=view.last_closing,
    )


def why_html(view: CellView) -> str:
    """Why this box: the newest decision, and what the arm said."""
    decision = view.decision or next(iter(view.planned), None)
    return render(
        'view/why.html',
        decision=decision,
        lines=why_lines(decision),
        others=runner_up_lines(decision),
    )


def why_lines(decision: Decision | None) -> list[str]:
    """Why ``decision`` was made, a sentence each."""
    if decision is None:
        return []
    if decision.status is PlacementStatus.REJECT:
        return [f'To the reject lane: {decision.reason}']
    lines = [f'Chosen as {_HOW[decision.status]}']
    if decision.reason:
        lines.append(decision.reason)
    if not decision.candidates_checked:
        lines.append('The arm was not asked before')
    return lines


def alarms_html(view: CellView) -> str:
    """What stands and waits for a person."""
    return render(
        'view/alarms.html',
        alarms=[
            (_time(alarm.raised_s), alarm, for_the_page(alarm.action)) for alarm in view.alarms
        ],
    )


def lately_html(view: CellView) -> str:
    """What happened lately that was not as it should be."""
    return render(
        'view/lately.html',
        happenings=[(_time(one.stamp_s), one) for one in view.happenings][:SHOWN],
    )


def state_of(view: CellView) -> dict[str, Any]:
    """What the banner shows, and whoever asks over HTTP gets."""
    banner = view.banner()
    return {
        'tone': banner.tone.value,
        'word': banner.word,
        'action': banner.action,
        'now': banner.now,
        'alarms': len(view.alarms),
        'placed': view.figures.placed,
    }


def _time(stamp_s: float) -> str:
    return datetime.fromtimestamp(stamp_s).strftime('%H:%M:%S')


def _late(view: CellView) -> str:
    least = view.figures.least_slack_s
    if least is None:
        return ''
    late = f', {view.figures.late} late' if view.figures.late else ''
    return f', least {least:.2f}{late}'


def _number(value: float | None, factor: float = 1.0, digits: int = 0) -> str:
    return '–' if value is None else f'{factor * value:.{digits}f}'


def _percent(share: float | None) -> str:
    return '–' if share is None else f'{100 * share:.1f} %'
