#!/usr/bin/env python3
"""Draws the figures of docs/benchmarks.md from the tables in docs/benchmarks/.

    python benchmarks/figures.py

The tables are the only source, so that a figure cannot say anything else. `benchmark.svg` and
`growth.svg` come with their measurements: see `cell bench --figure` and `benchmarks/growth.py`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure

TABLES = Path(__file__).resolve().parents[1] / 'docs' / 'benchmarks'
IMAGES = TABLES.parent / 'images'
BINS = ('SYN', 'LDC', 'RC', 'PAL', 'EQ')

#: Colours that people who see few colours tell apart (Okabe and Ito, Color Universal Design, 2008).
COLOURS = ('#0072B2', '#E69F00', '#009E73', '#CC79A7', '#D55E00', '#56B4E9')

Row = dict[str, str]


def read_table(page: str, header: str) -> list[Row]:
    """The first table of ``docs/benchmarks/<page>.md`` whose header starts with ``header``.

    An empty first cell means the one above.
    """
    lines = (TABLES / f'{page}.md').read_text().splitlines()
    starts = [number for number, line in enumerate(lines) if line.startswith(header)]
    if not starts:
        raise SystemExit(f'docs/benchmarks/{page}.md has no table that starts with {header!r}')
    names = split(lines[starts[0]])
    rows: list[Row] = []
    for line in lines[starts[0] + 2 :]:
        if not line.startswith('|'):
            break
        row = dict(zip(names, split(line), strict=True))
        row[names[0]] = row[names[0]] or rows[-1][names[0]]
        rows.append(row)
    return rows


def split(line: str) -> list[str]:
    """The cells of a table's row."""
    return [cell.strip() for cell in line.strip().strip('|').split('|')]


def numbers(text: str) -> list[float]:
    """Every number of a cell, such as 74.8 and 0.6 of '74.8 ± 0.6'."""
    return [float(number) for number in re.findall(r'\d+(?:\.\d+)?', text)]


def first(text: str) -> float:
    """The first number of a cell."""
    return numbers(text)[0]


def bars(
    axes: Axes, names: Sequence[str], series: dict[str, list[float]], *, labels: bool = True
) -> None:
    """Groups of bars side by side, a group for each of ``names``."""
    width = 0.8 / len(series)
    for place, (label, values) in enumerate(series.items()):
        shift = (place - (len(series) - 1) / 2) * width
        at = [position + shift for position in range(len(names))]
        drawn = axes.bar(at, values, width, color=COLOURS[place], label=label)
        if labels:
            axes.bar_label(drawn, fmt='%.3g', fontsize=7)
    axes.set_xticks(range(len(names)), names)


def paper() -> Figure:
    """Fill against look-ahead of three algorithms, ours and the paper's."""
    figure = Figure(figsize=(11, 3.4), layout='constrained')
    syn = read_table('paper', '| look-ahead | FF')
    industrial = read_table('paper', '| bin | look-ahead | FF')
    for axes, kind in zip(figure.subplots(1, len(BINS)), BINS, strict=True):
        rows = syn if kind == 'SYN' else [row for row in industrial if row['bin'] == kind]
        for place, name in enumerate(('MPackLite', 'O-FF', 'O-BF')):
            cells = [(first(row['look-ahead']), row[name]) for row in rows]
            ours = [(look, first(cell)) for look, cell in cells]
            theirs = [(look, numbers(cell)[-1]) for look, cell in cells if '[' in cell]
            axes.plot(*zip(*ours, strict=True), 'o-', color=COLOURS[place], label=name)
            axes.plot(*zip(*theirs, strict=True), 'o:', color=COLOURS[place], mfc='w')
        axes.set_title(kind)
        axes.set_xticks(range(1, 6))
        axes.set_xlabel('look-ahead, boxes')
    figure.axes[0].set_ylabel('fill of closed bins, %')
    handles, labels = figure.axes[0].get_legend_handles_labels()
    handles += figure.axes[0].plot([], [], 'o:', color='#555555', mfc='w')
    labels.append('the paper (its own boxes but for SYN)')
    figure.legend(handles, labels, loc='outside lower center', ncols=4)
    return figure


def mpack() -> Figure:
    """Fill of MPack against look-ahead, with MPackLite and the paper's MPack."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    syn = read_table('mpack', '| look-ahead | MPack with CEP')
    others = read_table('mpack', '| bin | look-ahead | MPack with CEP')
    lite_syn = read_table('paper', '| look-ahead | FF')
    lite = read_table('paper', '| bin | look-ahead | FF')
    for axes, kind in zip(figure.subplots(1, len(BINS)), BINS, strict=True):
        ours = syn if kind == 'SYN' else [row for row in others if row['bin'] == kind]
        cells = [numbers(row['MPack with CEP [paper]']) for row in ours]
        looks = [first(row['look-ahead']) for row in ours]
        theirs = lite_syn if kind == 'SYN' else [row for row in lite if row['bin'] == kind]
        fills, intervals = [cell[0] for cell in cells], [cell[1] for cell in cells]
        axes.errorbar(looks, fills, intervals, fmt='o-', color=COLOURS[4], label='MPack')
        axes.plot(
            [first(row['look-ahead']) for row in theirs],
            [first(row['MPackLite']) for row in theirs],
            's-', color=COLOURS[0], label='MPackLite',
        )  # fmt: skip
        papers = [(look, cell[2]) for look, cell in zip(looks, cells, strict=True) if cell[2:]]
        axes.plot(*zip(*papers, strict=True), 'o:', color='#555555', mfc='w', label='paper, MPack')
        axes.set_title(kind)
        axes.set_xticks(looks)
        axes.set_xlabel('look-ahead, boxes')
    figure.axes[0].set_ylabel('fill of closed bins, %')
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    return figure


def rules() -> Figure:
    """`rollout` beside the paper's algorithms, on built-in cartons and on supermarket cases."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    cartons, cases = figure.subplots(1, 2, sharey=True)
    rows = read_table('peers', '| bin | `rollout` | MPackLite')
    bars(cartons, [row['bin'] for row in rows], {
        'MPackLite': [first(row['MPackLite']) for row in rows],
        'best other of the paper': [first(row['best other']) for row in rows],
        'rollout': [first(row['`rollout`']) for row in rows],
    })  # fmt: skip
    cartons.set_title('SYN and built-in cartons')
    rows = read_table('peers', '| bin | `rollout` | best of the four')
    lite = read_table('peers', '| bin | look-ahead | O-FF')
    at_five = {row['bin']: first(row['MPackLite']) for row in lite if row['look-ahead'] == '5'}
    bars(cases, [row['bin'] for row in rows], {
        'MPackLite': [at_five[row['bin']] for row in rows],
        'best of the paper': [first(row['best of the four']) for row in rows],
        'rollout': [first(row['`rollout`']) for row in rows],
    })  # fmt: skip
    cases.set_title('supermarket cases')
    cartons.set_ylim(50, 85)
    cartons.set_ylabel('fill of closed bins, %, look-ahead 5')
    figure.legend(*cartons.get_legend_handles_labels(), loc='outside lower center', ncols=3)
    return figure


def proofs() -> Figure:
    """Mean and 95 % of the seconds until MPack's answer is proven, and the share that is."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    table = read_table('proofs', '| bin | look-ahead | decisions')
    for axes, look in zip(figure.subplots(1, 2, sharey=True), ('5', '6'), strict=True):
        rows = [row for row in table if row['look-ahead'] == look]
        names = [f'{row["bin"]}\n{row["proven %"]} %' for row in rows]
        bars(axes, names, {
            'mean': [first(row['mean s']) for row in rows],
            '95 %': [first(row['p95 s']) for row in rows],
        })  # fmt: skip
        axes.set_title(f'look-ahead {look} (below the bin: proven)')
    figure.axes[0].set_ylabel('seconds of a decision')
    figure.axes[0].legend()
    return figure


def backends() -> Figure:
    """Median time of a decision of MPackLite by backend."""
    figure = Figure(figsize=(5.5, 3.2), layout='constrained')
    axes = figure.subplots()
    table = read_table('backends', '| bin | backend')
    kinds = list(dict.fromkeys(row['bin'] for row in table))
    bars(axes, kinds, {
        name: [first(row['median ms']) for row in table if row['backend'] == name]
        for name in dict.fromkeys(row['backend'] for row in table)
    })  # fmt: skip
    axes.set_yscale('log')
    axes.set_ylim(0.1, 3000)
    axes.set_ylabel('ms of a decision, median')
    axes.legend(ncols=3)
    return figure


def arm() -> Figure:
    """Fill and cycle time of the whole cell with physics."""
    figure = Figure(figsize=(11, 3.4), layout='constrained')
    fill, cycle = figure.subplots(1, 2)
    table = read_table('arm', '| boxes | bin | placed of')
    lite = {
        row['bin']: first(row['MPackLite'])
        for row in read_table('paper', '| bin | look-ahead | FF')
        if row['look-ahead'] == '5'
    }
    lite['SYN'] = first(read_table('paper', '| look-ahead | FF')[-1]['MPackLite'])
    streams = list(dict.fromkeys(row['boxes'] for row in table))
    series = {'packing alone, rules of the paper': [lite[kind] for kind in BINS]}
    for stream in streams:
        by_bin = {row['bin']: row for row in table if row['boxes'] == stream}
        series[f'in the cell: {stream}'] = [
            first(by_bin[kind]['closed fill (bins)']) for kind in BINS
        ]
    bars(fill, BINS, series)
    fill.set_ylabel('fill of closed bins, %')
    fill.set_ylim(0, 105)
    fill.legend(fontsize=7)
    by_bin = {row['bin']: row for row in table if row['boxes'] == streams[0]}
    times = [numbers(by_bin[kind]['cycle median / p95 / max, s']) for kind in BINS]
    bars(cycle, BINS, {
        name: [seconds[place] for seconds in times]
        for place, name in enumerate(('median', '95 %', 'longest'))
    })  # fmt: skip
    cycle.axhline(5.5, color='black', linestyle=':')
    cycle.set_ylim(0, 7)
    cycle.set_ylabel('cycle, s (dotted: deadline)')
    cycle.set_title(streams[0])
    cycle.legend(ncols=3)
    return figure


def execution() -> Figure:
    """Fill of the bins that the arm packs, by profile and algorithm."""
    figure = Figure(figsize=(11, 3.0), layout='constrained')
    axes = figure.subplots()
    table = read_table('execution', '| bin | profile, algorithm')
    bins = list(dict.fromkeys(row['bin'] for row in table))
    names = list(dict.fromkeys(row['profile, algorithm'] for row in table))
    fills = {
        (row['bin'], row['profile, algorithm']): first(row['closed fill, % (bins)'])
        for row in table
    }
    bars(axes, bins, {
        name.replace('`', ''): [fills[kind, name] for kind in bins] for name in names
    })  # fmt: skip
    axes.set_ylabel('fill of closed bins, %')
    axes.set_ylim(0, 100)
    axes.legend(ncols=3)
    return figure


def front_grasps() -> Figure:
    """What boxes taken by the front change in fill and in cycle time."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    table = read_table('front_grasps', '| boxes | bin | grasp faces')
    groups: dict[str, dict[str, Row]] = {}
    kind = ''
    for row in table:
        kind = row['bin'] or kind
        faces = row['grasp faces'].split(',')[0]
        groups.setdefault(f'{row["boxes"].split(",")[0]}\n{kind}', {})[faces] = row
    columns: tuple[tuple[str, str, Callable[[str], float]], ...] = (
        ('closed fill (bins)', 'fill of closed bins, %', first),
        ('cycle median / p95 / max, s', 'cycle, 95 %, s', lambda cell: numbers(cell)[1]),
    )
    for axes, (column, label, value) in zip(figure.subplots(1, 2), columns, strict=True):
        bars(axes, list(groups), {
            faces: [value(rows[faces][column]) for rows in groups.values()]
            for faces in ('top', 'any')
        })  # fmt: skip
        axes.set_ylabel(label)
        axes.legend(loc='lower right')
    return figure


def scanner_error() -> Figure:
    """Fill, and boxes out of place, against the scanner's error."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    fill, worst = figure.subplots(1, 2)
    table = read_table('scanner_error', '| sigma, mm | k | fill')
    for place, k in enumerate(sorted({row['k'] for row in table})):
        rows = [row for row in table if row['k'] == k or row['sigma, mm'] == '0']
        sigmas = [first(row['sigma, mm']) for row in rows]
        fills = [first(row['fill of closed bins, %']) for row in rows]
        fill.plot(sigmas, fills, 'o-', color=COLOURS[place], label=f'margin of {k} sigma')
    rows = [row for row in table if row['k'] == '0']
    sigmas = [first(row['sigma, mm']) for row in rows]
    worst.plot(sigmas, [first(row['worst error, mm']) for row in rows], 'o-', color=COLOURS[4])
    worst.axhline(5.0, color='black', linestyle=':')
    worst.set_ylabel('worst error of a placed box, mm\n(dotted: out of place)')
    fill.set_ylabel('fill of closed bins, %')
    fill.legend()
    for axes in (fill, worst):
        axes.set_xlabel('standard deviation of an edge, mm')
    return figure


def destinations() -> Figure:
    """Fill against the number of destinations."""
    figure = Figure(figsize=(5.5, 3.2), layout='constrained')
    axes = figure.subplots()
    table = read_table('destinations', '| destinations | SYN')
    bars(axes, [row['destinations'] for row in table], {
        kind: [first(row[kind]) for row in table] for kind in ('SYN', 'LDC')
    })  # fmt: skip
    axes.set_xlabel('destinations, three open bins')
    axes.set_ylabel('fill of closed bins, %')
    axes.legend(loc='lower left')
    return figure


def scan_delay() -> Figure:
    """How long a scan is on its way to the planner."""
    figure = Figure(figsize=(11, 3.2), layout='constrained')
    axes = figure.subplots()
    table = read_table('whole_cell', '| scans per second')
    bars(axes, [row[''].replace(', ', ',\n') for row in table], {
        name: [first(row[column]) for row in table]
        for name, column in (
            ('median', 'scan to planner, median'), ('99 %', '99 %'), ('longest', 'longest')
        )
    })  # fmt: skip
    axes.set_yscale('log')
    axes.set_ylim(1, 400)
    axes.set_ylabel('ms from scan to planner')
    axes.legend(loc='upper left')
    return figure


FIGURES = (
    paper, mpack, proofs, rules, backends,
    arm, execution, front_grasps, scanner_error, destinations, scan_delay,
)  # fmt: skip


def main() -> None:
    """Write every figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--format', default='svg', help='svg (default) or png')
    parser.add_argument('--folder', type=Path, default=IMAGES)
    options = parser.parse_args()
    rcParams['svg.hashsalt'] = 'cell'  # the same file every time
    for draw in FIGURES:
        figure = draw()
        for axes in figure.axes:
            axes.spines[['top', 'right']].set_visible(False)
        path = options.folder / f'bench_{draw.__name__}.{options.format}'
        figure.savefig(path, metadata={'Date': None} if options.format == 'svg' else None)
        print(path)


if __name__ == '__main__':
    main()
