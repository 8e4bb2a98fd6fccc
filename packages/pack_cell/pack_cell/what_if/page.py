"""The page and the CSV of ``cell compare``."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from pack_cell.pages.rendering import render
from pack_cell.report_page.charts import Plot, legend
from pack_cell.report_page.csv_file import as_text
from pack_cell.what_if.outcomes import Outcome
from pack_cell.what_if.recommendation import by_bins, called, chosen, recommendations

_COLUMNS = (
    'bin', 'algorithm', 'open_bins', 'look_ahead', 'fill_closed', 'fill_closed_ci95', 'fill_all',
    'closed_bins', 'by_hand', 'decision_p95_s', 'boxes_per_hour', 'deadline_misses',
)  # fmt: skip


def compare_page(
    outcomes: Sequence[Outcome], most_by_hand: float, command: str, about: Sequence[str]
) -> str:
    """The page: the recommendation, a chart for each kind of bin, every combination.

    ``about`` are sentences on what was packed and how.
    """
    groups = by_bins(outcomes)
    return render(
        'what_if/compare.html',
        title='Which setting for these boxes',
        command=command,
        about=about,
        sentences=recommendations(outcomes, most_by_hand),
        charts=[
            (called(group[0].combination.spec), _chart(group))
            for group in groups.values()
            if len({outcome.combination.look_ahead for outcome in group}) > 1
        ],
        outcomes=outcomes,
        picked={id(chosen(group, most_by_hand)) for group in groups.values()},
        with_arm=any(outcome.boxes_per_hour is not None for outcome in outcomes),
        identity=id,
        short=lambda algorithm: Path(algorithm).name,
    )


def _chart(group: Sequence[Outcome]) -> Markup:
    """Fill against look-ahead, a line for each algorithm and number of open bins."""
    known = [outcome for outcome in group if outcome.fill is not None]
    if not known:
        return Markup('')
    looks = [outcome.combination.look_ahead for outcome in known]
    fills = [outcome.fill or 0.0 for outcome in known]
    low, high = max(0.0, min(fills) - 5), min(100.0, max(fills) + 5)
    plot = Plot(
        (min(looks), max(looks)), (low, high), 'look-ahead, boxes', 'fill of closed bins, %',
        whole_x=True,
    )  # fmt: skip
    names, marks = [], []
    series = dict.fromkeys((o.combination.algorithm, o.combination.open_bins) for o in known)
    for number, (algorithm, open_bins) in enumerate(series):
        style, name = f's{number % 6}', f'{Path(algorithm).name}, {open_bins} open'
        points = sorted(
            (float(o.combination.look_ahead), o.fill or 0.0)
            for o in known
            if (o.combination.algorithm, o.combination.open_bins) == (algorithm, open_bins)
        )
        marks += [plot.line(points, style, name), plot.dots(points, style)]
        names.append((style, name))
    return legend(names) + plot.svg(marks, 'Fill of closed bins against look-ahead')


def write_outcomes(path: Path, outcomes: Sequence[Outcome]) -> None:
    """A line per combination as CSV."""
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for outcome in outcomes:
            combination = outcome.combination
            values = (
                outcome.fill, outcome.fill_ci, outcome.fill_all, outcome.closed_bins,
                outcome.by_hand, outcome.decision_p95_s, outcome.boxes_per_hour,
                outcome.deadline_misses,
            )  # fmt: skip
            writer.writerow(
                (
                    as_text(combination.spec.name), as_text(combination.algorithm),
                    combination.open_bins, combination.look_ahead,
                    *('' if value is None else value for value in values),
                )
            )  # fmt: skip
