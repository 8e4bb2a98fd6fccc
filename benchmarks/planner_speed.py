#!/usr/bin/env python3
"""How long the planner takes per decision, on streams that fill and close bins.

Run it in the environment of `./cell setup`:

    python benchmarks/planner_speed.py
    python benchmarks/planner_speed.py --bins PAL --look-ahead 1 3 5 --profile cell
"""

from __future__ import annotations

import argparse
import csv
import random
import sys
import time
from pathlib import Path

from pack_msgs_py.metrics import fill_metrics, quantile
from pack_msgs_py.profiles import PROFILES, find_profile
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import BinSpec, Box, parse_bin
from pack_planner.algorithms import ALGORITHMS
from pack_planner.decide import Planner, Settings
from pack_planner.simulate import Run, cut_bin, pack_stream

CARTONS = Path(__file__).parents[1] / 'packages/conveyor_sim/conveyor_sim/data/cartons.csv'


def boxes_for(spec: BinSpec, cartons: list[Box], volume_bins: int, rng: random.Random) -> list[Box]:
    """Boxes of the volume of so many bins: cut from SYN bins, else drawn from ``cartons``."""
    if spec.name == 'SYN':
        pieces = [piece for _ in range(volume_bins) for piece in cut_bin(spec, rng)]
        rng.shuffle(pieces)
        return [
            Box(f'syn-{i}', (float(x), float(y), float(z))) for i, (x, y, z) in enumerate(pieces)
        ]
    found: list[Box] = []
    volume = 0.0
    while volume < volume_bins * spec.volume_mm3:
        carton = rng.choice(cartons)
        found.append(Box(f'{carton.id}-{len(found)}', carton.size_mm, carton.weight_kg))
        volume += carton.volume_mm3
    return found


def read_cartons(path: Path) -> list[Box]:
    """Sizes and weights of a CSV file with the columns of the built-in list."""
    with path.open(newline='') as file:
        return [
            Box(
                row.get('id') or f'row-{number}',
                (float(row['length_mm']), float(row['width_mm']), float(row['height_mm'])),
                float(row['weight_kg']),
            )
            for number, row in enumerate(csv.DictReader(file), 1)
        ]


def line(spec: BinSpec, look_ahead: int, run: Run, violations: int) -> str:
    """One row of the table."""
    fills = fill_metrics(run.closed, run.still_open)
    milliseconds = [1000 * one for one in run.seconds]
    fill = fills['fill_closed']
    per_bin = sum(len(one.boxes) for one in run.closed) / max(1, len(run.closed))
    return (
        f'| {spec.name} | {look_ahead} | {len(run.seconds)} | {per_bin:.1f} '
        f'| {quantile(milliseconds, 0.5):.2f} | {quantile(milliseconds, 0.95):.2f} '
        f'| {quantile(milliseconds, 0.99):.2f} | {max(milliseconds):.2f} '
        f'| {len(run.closed)} | {"-" if fill is None else f"{fill:.1f}"} '
        f'| {len(run.rejected)} | {violations} |'
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', nargs='+', default=['SYN', 'LDC', 'PAL'])
    parser.add_argument('--look-ahead', nargs='+', type=int, default=[5])
    parser.add_argument('--open-bins', type=int, default=3)
    parser.add_argument('--profile', choices=tuple(PROFILES), default='paper')
    parser.add_argument('--algorithm', choices=tuple(ALGORITHMS), default='mpack_lite')
    parser.add_argument('--volume-bins', type=int, default=10, help='stream volume in bins')
    parser.add_argument('--boxes', type=Path, default=CARTONS, help='CSV of cartons')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument(
        '--clock',
        choices=('wall', 'cpu'),
        default='wall',
        help='cpu leaves out what other processes take on a busy machine',
    )
    options = parser.parse_args()
    clock = time.perf_counter if options.clock == 'wall' else time.thread_time
    cartons = read_cartons(options.boxes)
    profile = find_profile(options.profile)
    sys.stdout.write(
        '| bin | look-ahead | decisions | boxes/bin | median ms | p95 ms | p99 ms | max ms '
        '| closed | fill % | rejected | violations |\n' + '|---' * 12 + '|\n'
    )
    for name in options.bins:
        spec = parse_bin(name)
        boxes = boxes_for(spec, cartons, options.volume_bins, random.Random(options.seed))
        for look_ahead in options.look_ahead:
            planner = Planner(Settings(options.algorithm, profile), clock)
            run = pack_stream(
                planner, boxes, spec, look_ahead=look_ahead, open_bins=options.open_bins
            )
            broken = validate_bins([*run.closed, *run.still_open], profile)
            sys.stdout.write(line(spec, look_ahead, run, len(broken)) + '\n')
            sys.stdout.flush()


if __name__ == '__main__':
    main()
