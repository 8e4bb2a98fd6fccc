"""Fill and time against look-ahead, a column per kind of bin, as in Fig. 2 of Ojha et al."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from pack_planner.bench.paper import NAMES
from pack_planner.bench.values import JsonObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = (
    '#1b5e9c', '#d1495b', '#2e8b57', '#e09f3e', '#7b4fa3', '#3a9fb0', '#8c5a3c', '#6b7280',
)  # fmt: skip


def draw(records: Sequence[JsonObject]) -> Figure:
    """The figure; solid lines are ours, dotted ones the paper's."""
    from matplotlib.figure import Figure

    bins = list(dict.fromkeys(one['bin'] for one in records))
    algorithms = list(dict.fromkeys(one['algorithm'] for one in records))
    figure = Figure(figsize=(max(7.0, 3.1 * len(bins)), 6.4), layout='constrained')
    axes = figure.subplots(2, len(bins), squeeze=False, sharex=True, sharey='row')
    for column, bin_name in enumerate(bins):
        fill, time = axes[0][column], axes[1][column]
        for number, algorithm in enumerate(algorithms):
            chosen = sorted(
                (one for one in records if (one['bin'], one['algorithm']) == (bin_name, algorithm)),
                key=lambda one: int(one['look_ahead']),
            )
            _lines(fill, time, chosen, algorithm, _COLOURS[number % len(_COLOURS)])
        fill.set_title(bin_name)
        time.set_yscale('log')
        time.set_xlabel('look-ahead, boxes')
        looks = sorted({one['look_ahead'] for one in records})
        time.set_xticks(looks)
        for one in (fill, time):
            one.grid(visible=True, alpha=0.3)
            one.spines[['top', 'right']].set_visible(False)
    fills = [one['fill_closed'] for one in records if one['fill_closed'] is not None]
    fills += [one['paper']['fill'] for one in records if one['paper']]
    if fills:
        # a few collections have confidence intervals far beyond what is to be seen
        axes[0][0].set_ylim(max(0.0, min(fills) - 4.0), min(100.0, max(fills) + 4.0))
    axes[0][0].set_ylabel('fill of closed bins, %')
    axes[1][0].set_ylabel('mean time of a decision, s')
    handles, labels = axes[0][0].get_legend_handles_labels()
    if any(one['paper'] for one in records):
        handles.append(axes[0][0].plot([], [], ':', color='#555555')[0])
        labels.append('dotted: the paper')
    figure.legend(handles, labels, loc='outside lower center', ncols=min(6, len(labels)))
    return figure


def _lines(
    fill: Axes, time: Axes, records: Sequence[JsonObject], algorithm: str, colour: str
) -> None:
    known = [one for one in records if one['fill_closed'] is not None]
    looks = [one['look_ahead'] for one in known]
    fill.errorbar(
        looks,
        [one['fill_closed'] for one in known],
        [one['fill_closed_ci95'] or 0.0 for one in known],
        color=colour, marker='o', markersize=3.5, capsize=2, linewidth=1.4,
        label=NAMES.get(algorithm, algorithm),
    )  # fmt: skip
    timed = [one for one in records if one['decision_s']['mean'] is not None]
    time.plot(
        [one['look_ahead'] for one in timed],
        [one['decision_s']['mean'] for one in timed],
        color=colour, marker='o', markersize=3.5, linewidth=1.4,
    )  # fmt: skip
    paper = [one for one in records if one['paper']]
    for axes, key in ((fill, 'fill'), (time, 'seconds')):
        axes.plot(
            [one['look_ahead'] for one in paper], [one['paper'][key] for one in paper],
            ':', color=colour, linewidth=1.2,
        )  # fmt: skip


def svg(records: Sequence[JsonObject]) -> str:
    """The figure as an SVG element, to stand in a page."""
    text = StringIO()
    draw(records).savefig(text, format='svg')
    found = text.getvalue()
    return found[found.index('<svg') :]


def save(records: Sequence[JsonObject], path: Path) -> None:
    """The figure in a file; the suffix tells the format (svg, png, pdf)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # without a date the same records give the same file
    metadata = {'Date': None} if path.suffix == '.svg' else None
    draw(records).savefig(path, dpi=130, metadata=metadata)
