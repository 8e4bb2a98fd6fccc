"""The report of one run, and the comparison of several, as pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pack_cell.pages.rendering import render
from pack_cell.report.closings import closings_text
from pack_cell.report_page.charts import shares
from pack_cell.report_page.comparison import (
    boxes_text,
    findings,
    measured,
    settings_that_differ,
)
from pack_cell.report_page.key_figures import key_figures, refusals, verdict
from pack_cell.report_page.run_charts import (
    MOST_BINS,
    cycle_times,
    decision_times,
    fill_over_time,
    planning_text,
    planning_under_motion,
)
from pack_cell.report_page.run_folder import FinishedRun, RunBin
from pack_cell.report_page.run_settings import run_settings
from pack_cell.report_page.work_order import packing_layers, packing_steps, scene
from pack_msgs_py.values import Vec3

#: Work orders of more boxes than this make a page too heavy; the last bins are shown then.
MOST_BOXES = 2000
#: Lines on what went wrong.
MOST_PROBLEMS = 20


def run_page(run: FinishedRun) -> str:
    """The page: figures, charts, bins in 3D, work orders, and how the run was made."""
    shown = _shown_bins(run)
    steps = [packing_steps(of_run) for of_run in shown]
    rejected = refusals(run)
    problems = [str(line) for line in run.summary.get('problems') or ()]
    if len(problems) > MOST_PROBLEMS:
        more = f'and {len(problems) - MOST_PROBLEMS} more, see summary.json'
        problems = [*problems[:MOST_PROBLEMS], more]
    return render(
        'report_page/run.html',
        title=f'Packing report: {run.name}',
        run=run,
        began='',
        verdict=verdict(run),
        problems=problems,
        figures=key_figures(run),
        charts={
            'fill': fill_over_time(run),
            'fill_note': f', of the last {MOST_BINS}' if len(run.bins) > MOST_BINS else '',
            'cycle': cycle_times(run),
            'planning': planning_text(run),
            'gantt': planning_under_motion(run),
            'decisions': decision_times(run),
        },
        refused=shares(rejected.most_common(), len(run.boxes)) if rejected else '',
        first_choices=_first_choices(run.summary),
        sorted_bins=any(of_run.destination for of_run in run.bins),
        hidden=len(run.bins) - len(shown),
        orders=[
            {
                'bin': of_run,
                'steps': of_bin,
                'layers': packing_layers(of_run, of_bin),
                'has_articles': any(step.placed.box.article for step in of_bin),
            }
            for of_run, of_bin in zip(shown, steps, strict=True)
        ],
        scenes=[scene(of_run) for of_run in shown],
        options=_options(run),
        why_closed=_why_closed(run.summary),
        everything=[(key, _plain(value)) for key, value in run.summary.items()],
        bin_state=_state,
        size=_size,
        weight=lambda kg: '' if kg is None else f'{kg:.2f}',
    )


def _shown_bins(run: FinishedRun) -> list[RunBin]:
    """The last bins, as many as the page can hold, at least one."""
    count, boxes = 0, 0
    for of_run in reversed(run.bins):
        boxes += len(of_run.boxes)
        if count and boxes > MOST_BOXES:
            break
        count += 1
    return list(run.bins[len(run.bins) - count :])


def _state(of_run: RunBin) -> str:
    """Whether the bin was closed and, as far as it is known, why."""
    if of_run.closed is None:
        return ''
    if not of_run.closed:
        return 'open at the end'
    return f'closed: {of_run.why_closed}' if of_run.why_closed else 'closed'


def _size(size_mm: Vec3) -> str:
    return ' × '.join(f'{round(edge, 1):g}' for edge in size_mm)


def _first_choices(summary: Mapping[str, Any]) -> dict[str, Any] | None:
    """What the arm could not do of the planner's first choices, by code."""
    asked = summary.get('arm_asked') or {}
    refused = asked.get('first_refusals')
    if not refused:
        return None
    count = asked['decisions_asked']
    text = (
        f'Of {count} first choices of the planner the arm could do '
        f'{asked["first_choices_possible"]:.1f} %; for the others the next best place was taken. '
        'What it said:'
    )
    rows = [(code.replace('_', ' ').lower(), number) for code, number in refused.items()]
    return {'text': text, 'chart': shares(rows, count)}


def _options(run: FinishedRun) -> list[tuple[str, str]]:
    """What was asked for, and with which versions."""
    options = [(name, value) for name, value in run_settings(run.folder).items() if value]
    versions = run.summary.get('versions') or {}
    return [*options, ('versions', ', '.join(f'{name} {v}' for name, v in versions.items()))]


def _why_closed(summary: Mapping[str, Any]) -> str:
    """What kept the boxes out when bins were closed, over all bins; empty where nobody knows."""
    try:
        return closings_text(summary.get('closings') or ())
    except (KeyError, TypeError, ValueError):  # of another release
        return ''


def _plain(value: Any) -> str:  # noqa: ANN401 - whatever a summary holds
    """A value of the summary for people."""
    if isinstance(value, float):
        return f'{value:.6g}'
    if isinstance(value, dict):
        return ', '.join(f'{key} {_plain(inner)}' for key, inner in value.items()) or 'none'
    if isinstance(value, list):
        return '; '.join(map(_plain, value)) or 'none'
    return 'none' if value is None else str(value)


def comparison_page(runs: Sequence[FinishedRun]) -> str:
    """The page of several runs; all are held against the first."""
    first = runs[0]
    return render(
        'report_page/comparison.html',
        title=f'Runs compared: {", ".join(run.name for run in runs)}',
        runs=runs,
        boxes=[boxes_text(first, run) for run in runs[1:]],
        findings=findings(runs),
        settings=settings_that_differ(runs),
        rows=measured(runs),
        parts=[
            {
                'run': run,
                'verdict': verdict(run),
                'figures': key_figures(run),
                'fill': fill_over_time(run),
                'cycle': cycle_times(run),
            }
            for run in runs
        ],
    )
