"""Fill and time against look-ahead, a column per kind of bin, as in Fig. 2 of Ojha et al."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from pack_cell.bench.report import name, title
from pack_cell.bench.values import JsonObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colours that people who see few colours tell apart (Okabe and Ito, Color Universal Design, 2008).
_COLOURS = (
    '#0072B2', '#E69F00', '#009E73', '#CC79A7', '#D55E00', '#56B4E9', '#000000', '#8C6D31',
)  # fmt: skip
_MARKERS = ('o', 's', '^', 'D', 'v', 'P', 'X', '*', '<', '>', 'p')

#: The algorithms of the paper look the same in every figure.
_OF_PAPER = {
    'mpack_lite': 0, 'first_fit': 1, 'o_first_fit': 2, 'best_fit': 3, 'o_best_fit': 4,
    'o_jampack': 5, 'mpack': 6,
}  # fmt: skip


def draw(records: Sequence[JsonObject]) -> Figure:
    """The figure: our fill, the paper's where there is one, and time with the paper's dotted."""
    from matplotlib.figure import Figure

    bins = list(dict.fromkeys(record['bin'] for record in records))
    series = {name(record): title(record) for record in records}
    styles = _styles(records)
    with_paper = any(record['paper'] for record in records)
    rows = 3 if with_paper else 2
    figure = Figure(figsize=(max(7.0, 3.1 * len(bins)), 1.0 + 2.7 * rows), layout='constrained')
    axes = figure.subplots(rows, len(bins), squeeze=False, sharex=True)
    looks = sorted({record['look_ahead'] for record in records})
    # side by side, so that equal fills do not hide each other
    step = min(0.09, 0.5 / len(series)) if len(looks) > 1 else 0.0
    for column, bin_name in enumerate(bins):
        here = [record for record in records if record['bin'] == bin_name]
        fill, time = axes[0][column], axes[-1][column]
        for number, label in enumerate(series):
            chosen = sorted(
                (record for record in here if name(record) == label),
                key=lambda record: int(record['look_ahead']),
            )
            shift = step * (number - (len(series) - 1) / 2)
            _ours(fill, time, chosen, series[label], styles[label], shift)
            if with_paper:
                _papers(axes[1][column], time, chosen, styles[label], shift)
        fill.set_title(bin_name)
        _set_range(
            fill, [record['fill_closed'] for record in here if record['fill_closed'] is not None]
        )
        time.set_yscale('log')
        time.set_ylim(_time_range(records))
        time.set_xlabel('look-ahead, boxes')
        time.set_xticks(looks)
    for panel in axes.flat:
        panel.grid(visible=True, alpha=0.3)
        panel.spines[['top', 'right']].set_visible(False)
    axes[0][0].set_ylabel('fill of closed bins, %')
    axes[-1][0].set_ylabel('mean time of a decision, s')
    handles, labels = axes[0][0].get_legend_handles_labels()
    if with_paper:
        axes[1][0].set_ylabel("the paper's fill, %")
        handles += axes[1][0].plot([], [], ':o', color='#555555', markerfacecolor='white')
        labels.append('the paper (its own boxes but for SYN)')
    figure.legend(handles, labels, loc='outside lower center', ncols=min(8, len(labels)))
    return figure


def _set_range(axes: Axes, values: Sequence[float]) -> None:
    """Show ``values``; few collections have confidence intervals far beyond what is to be seen."""
    if values:
        axes.set_ylim(max(0.0, min(values) - 2.5), min(100.0, max(values) + 2.5))


def _time_range(records: Sequence[JsonObject]) -> tuple[float, float]:
    """Limits that hold every mean time, ours and the paper's, seconds."""
    times = [record['decision_s']['mean'] for record in records]
    times += [record['paper']['seconds'] for record in records if record['paper']]
    known = [seconds for seconds in times if seconds]
    return (min(known) / 1.7, max(known) * 1.7) if known else (1e-4, 1.0)


_Style = tuple[str, str]


def _styles(records: Sequence[JsonObject]) -> dict[str, _Style]:
    """Colour and marker of each series; no two have both in common."""
    styles: dict[str, _Style] = {}
    taken = set()
    others = 0
    for record in records:
        label, number = name(record), _OF_PAPER.get(record['algorithm'])
        if label in styles:
            continue
        if number is None or number in taken:
            number = len(_OF_PAPER) + others
            others += 1
        taken.add(number)
        # the markers go on where the colours begin again
        styles[label] = _COLOURS[number % len(_COLOURS)], _MARKERS[number % len(_MARKERS)]
    return styles


def _ours(
    fill: Axes, time: Axes, records: Sequence[JsonObject], label: str, style: _Style, shift: float
) -> None:
    """Our fill and time of one series, each point ``shift`` boxes beside its look-ahead."""
    colour, marker = style
    known = [record for record in records if record['fill_closed'] is not None]
    fill.errorbar(
        [record['look_ahead'] + shift for record in known],
        [record['fill_closed'] for record in known],
        [record['fill_closed_ci95'] or 0.0 for record in known],
        color=colour, marker=marker, markersize=4.5, elinewidth=0.7, linewidth=1.3, label=label,
    )  # fmt: skip
    timed = [record for record in records if record['decision_s']['mean'] is not None]
    time.plot(
        [record['look_ahead'] + shift for record in timed],
        [record['decision_s']['mean'] for record in timed],
        color=colour, marker=marker, markersize=4.5, linewidth=1.3,
    )  # fmt: skip


def _papers(
    fill: Axes, time: Axes, records: Sequence[JsonObject], style: _Style, shift: float
) -> None:
    colour, marker = style
    paper = [record for record in records if record['paper']]
    for axes, key in ((fill, 'fill'), (time, 'seconds')):
        axes.plot(
            [record['look_ahead'] + shift for record in paper],
            [record['paper'][key] for record in paper],
            ':', color=colour, marker=marker, markersize=4, markerfacecolor='white', linewidth=1.1,
        )  # fmt: skip


def svg(records: Sequence[JsonObject]) -> str:
    """The figure as an SVG element, to stand in a page."""
    text = StringIO()
    draw(records).savefig(text, format='svg')
    drawing = text.getvalue()
    return drawing[drawing.index('<svg') :]


def save(records: Sequence[JsonObject], path: Path) -> None:
    """The figure in a file; the suffix tells the format (svg, png, pdf)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # without a date the same records give the same file
    metadata = {'Date': None} if path.suffix == '.svg' else None
    draw(records).savefig(path, dpi=130, metadata=metadata)
