#!/usr/bin/env python3
"""What errors of the scanner cost in fill and in contacts, and what a margin for them saves.

Run it in the environment of `./cell setup`; docs/scanner.md shows the table it prints:

    python benchmarks/scanner_errors.py --count 160
    python benchmarks/scanner_errors.py --count 40 --arm physics --sigmas 0,2 --margins 0,2

Each line of the table is a `cell run` of the built-in cartons into LDC bins. A contact is a box
that came to rest beside another one closer than 0 mm, by true sizes and true places: the timed arm
lets them overlap, in physics they push each other. Angles are left out of that.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

from arm_executor.arms.registry import ARMS_IN_WORDS
from pack_msgs_py.orientation import oriented_size

#: Boxes that share less height than this stand on each other, millimetres.
_SHARED_MM = 10.0

Row = dict[str, Any]


def placed_rows(folder: Path) -> list[Row]:
    """The boxes in bins, of a run's record."""
    lines = (folder / 'placements.jsonl').read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    return [row for row in rows if row['outcome'] == 'placed' and row['measured_position_mm']]


def spans(row: Row) -> list[tuple[float, float]]:
    """True extent of a box in its bin along x, y and z, millimetres."""
    size = oriented_size(row['true_size_mm'] or row['size_mm'], row['orientation'])
    centre = row['measured_position_mm']
    return [(c - edge / 2, c + edge / 2) for c, edge in zip(centre, size, strict=True)]


def contacts(rows: list[Row]) -> Iterator[float]:
    """How deep boxes that stand side by side are in each other, millimetres."""
    bins: dict[int, list[list[tuple[float, float]]]] = {}
    for row in rows:
        bins.setdefault(row['bin_serial'], []).append(spans(row))
    for boxes in bins.values():
        for one, other in combinations(boxes, 2):
            shared = [min(a[1], b[1]) - max(a[0], b[0]) for a, b in zip(one, other, strict=True)]
            if shared[2] > _SHARED_MM and min(shared[:2]) > 0:
                yield min(shared[:2])


def percent(value: float | None) -> str:
    """A fill rate, or that there is none."""
    return 'none' if value is None else f'{value:.1f}'


def run(arguments: argparse.Namespace, sigma: float, margin: float) -> str:
    """One run as a line of the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / 'run'
        command = [
            sys.executable, '-m', 'pack_cell', 'run', '--quiet', '--arm', arguments.arm,
            '--count', str(arguments.count), '--seed', str(arguments.seed), '--boxes',
            arguments.boxes, '--scan-sigma', str(sigma), '--size-sigmas', str(margin),
            '--out', str(folder),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            raise SystemExit(f'{" ".join(command)} ended with {done.returncode}: {done.stderr}')
        summary, rows = json.loads((folder / 'summary.json').read_text()), placed_rows(folder)
    for problem in summary['problems']:
        print(f'sigma {sigma:g}, k {margin:g}: {problem}', file=sys.stderr)
    deep = sorted(contacts(rows))
    codes = summary['goal_codes']
    cells = [
        f'{sigma:g}',
        f'{margin:g}',
        percent(summary['fill_closed']),
        percent(summary['fill_all']),
        f'{len(deep)} ({deep[-1]:.1f} mm)' if deep else '0',
        str(codes.get('PLACED_OUT_OF_TOLERANCE', 0) + codes.get('OTHERS_DISTURBED', 0)),
        str(summary['refused_goals']),
        f'{summary["max_pose_error_mm"] or 0.0:.1f}',
        f'{summary["placed"]} of {summary["boxes_supplied"]}',
        str(done.returncode),
    ]
    return f'| {" | ".join(cells)} |'


def numbers(text: str) -> list[float]:
    """Numbers with commas between them."""
    return [float(part) for part in text.split(',')]


def main() -> None:
    """Print the table, line by line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else '')
    parser.add_argument('--count', type=int, default=160)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--boxes', default='cartons')
    parser.add_argument('--arm', default='timed', help=ARMS_IN_WORDS)
    parser.add_argument('--sigmas', type=numbers, default=[0.0, 1.0, 2.0, 4.0])
    parser.add_argument('--margins', type=numbers, default=[0.0, 1.0, 2.0, 3.0])
    arguments = parser.parse_args()
    print('| sigma, mm | k | fill of closed bins, % | all bins, % | contacts (deepest) '
          '| out of place | refused goals | worst error, mm | placed | exit code |')  # fmt: skip
    print(f'|{" --- |" * 10}')
    for sigma in arguments.sigmas:
        for margin in arguments.margins if sigma else arguments.margins[:1]:
            print(run(arguments, sigma, margin), flush=True)


if __name__ == '__main__':
    main()
