"""``cell layout``: print the layout of the cell, judge it, draw it."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from arm_executor.model.layout import Layout, LayoutError, check_layout
from arm_executor.reach.layout_file import find_layout
from arm_executor.reach.reach import LEAST_REACH
from pack_cell.layout.verdict import Verdict, judge
from pack_cell.options.parsers import NumberRange, bin_kind, whole
from pack_cell.options.shared import add_cell_layout
from pack_msgs_py.values import BIN_KINDS, BIN_TYPES

if TYPE_CHECKING:
    from arm_executor.reach.reach_motion import StationReach

EXIT_OK, EXIT_UNFIT = 0, 1
PICTURES = ('.png', '.svg', '.pdf')


def add_layout(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell layout`` to the command line."""
    parser = verbs.add_parser(
        'layout',
        help='print, check and draw the layout of the cell',
        description='Without options: print the layout as YAML, a start for a file of your own. '
        'With --check: what the robot reaches of each bin, without collision and in time, as a '
        'table. Exit code 0: the layout can be packed; 1: it cannot, and why; 2: wrong option.',
    )
    parser.add_argument('--check', action='store_true', help='judge the layout')
    add_cell_layout(parser)
    parser.add_argument(
        '--bin',
        type=bin_kind,
        action='append',
        dest='bins',
        metavar='KIND',
        help=f'kind of bin to judge, may be given again: {BIN_KINDS}; default: all with a name',
    )
    parser.add_argument(
        '--samples',
        type=whole(0, 10_000),
        default=12,
        metavar='N',
        help='placements of each bin to plan as whole motions (default 12)',
    )
    parser.add_argument(
        '--deadline',
        type=NumberRange(0, 3600, 's', above=True),
        default=5.5,
        dest='deadline_s',
        metavar='S',
        help='seconds a placement may take (default 5.5)',
    )
    parser.add_argument(
        '--least',
        type=NumberRange(0, 100),
        default=100 * LEAST_REACH,
        metavar='PERCENT',
        help='share of each bin that must be in reach without collision (default 50)',
    )
    parser.add_argument(
        '--png',
        type=_picture,
        metavar='FILE',
        help='draw the cell from above with a map of its reach; .png, .svg or .pdf (with --check)',
    )


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in PICTURES:
        msg = f'{text!r} must end in {", ".join(PICTURES)}'
        raise argparse.ArgumentTypeError(msg)
    return path


def run_layout(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    try:
        layout = find_layout(options.layout, options.robot)
        check_layout(layout, {})
    except LayoutError as error:
        print(f'cell layout: {error}', file=sys.stderr)
        return EXIT_UNFIT
    if not options.check:
        print(yaml.safe_dump(asdict(layout), sort_keys=False), end='')
        return EXIT_OK
    specs = options.bins or list(BIN_TYPES.values())
    verdicts = [judge(layout, spec, options.samples, options.least / 100) for spec in specs]
    print_table(layout, verdicts, options.deadline_s)
    if options.png:
        from pack_cell.layout.picture import draw

        options.png.parent.mkdir(parents=True, exist_ok=True)
        draw(options.png, layout, verdicts, options.deadline_s)
        print(f'picture: {options.png}')
    return EXIT_UNFIT if any(verdict.refusal for verdict in verdicts) else EXIT_OK


def print_table(layout: Layout, verdicts: Sequence[Verdict], deadline_s: float) -> None:
    """The verdicts as a table, and every refusal as a line below it."""
    rows: list[tuple[str, ...]] = [
        ('bin', 'station', 'places', 'free', f'in {deadline_s:g} s', 'median', 'in the way')
    ]
    for verdict in verdicts:
        if not verdict.stations:
            rows.append((verdict.spec.name, '', '', '', '', '', 'refused, see below'))
        rows += [_row(station, deadline_s) for station in verdict.stations]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    print(f'{layout.robot}: share of an empty bin that the arm reaches with a box in its gripper')
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        print('  '.join(cells).rstrip())
    for verdict in verdicts:
        if verdict.refusal:
            print(f'refused: {verdict.refusal}')


def _row(reach: StationReach, deadline_s: float) -> tuple[str, ...]:
    worst = sorted(reach.blocked_by.items(), key=lambda item: -item[1])[:2]
    return (
        reach.spec.name,
        reach.station,
        str(len(reach.places)),
        f'{reach.share:.0%}',
        _share(reach.within(deadline_s)),
        f'{reach.median_s:.1f} s' if math.isfinite(reach.median_s) else '-',
        ', '.join(f'{what} ({count})' for what, count in worst),
    )


def _share(value: float) -> str:
    return '-' if math.isnan(value) else f'{value:.0%}'
