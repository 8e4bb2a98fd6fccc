#!/usr/bin/env python3
"""The home test of the learning papers: one bin of 10 x 10 x 10, boxes with edges from 1 to 5.

Run it in the environment of `./cell setup`:

    python benchmarks/home_test.py --jobs 2

Each edge of a box is drawn uniformly from the whole numbers 1 to 5, as in the set "RS" of GOPT
(Xiong et al., IEEE Robotics and Automation Letters 9(11), 2024), after Zhao et al. (AAAI 2021).
Boxes come without end, and an episode is over when none of those on offer fits: with a look-ahead
of 1 at the first box that does not. Its figure is the fill of the bin then. With a larger
look-ahead any of the boxes on offer may be next, as with the buffer of STEP (Sarawgi et al.,
arXiv 2603.07800).

A unit is 100 mm, which is also the grid. There are no margins. The rules of support are

- mechanical : the rule of profile `dense`, equilibrium all the way down, with the centre of mass
  inside the bearing polygon by a hundredth of a unit: on its edge a box would stand on a knife's
  edge;
- contact : the centre of mass inside the hull of what touches the base, which is about the rule of
  GOPT (more than half of the base, or the centre in the hull of the cells that touch);
- none : a box may lie on anything, as in the papers that leave stability out.
"""

from __future__ import annotations

import argparse
import math
import random
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, stdev

from joblib import Parallel, delayed

from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec, Box
from pack_planner import pack

UNIT_MM = 100
BIN = BinSpec('10x10x10', (10 * UNIT_MM,) * 3)
MOST_UNITS = 5
#: Nobody has weights; so every box has the same density, in kilograms for a cubic unit.
DENSITY_KG = 0.1

_GRID = Profile('home', resolution_mm=UNIT_MM, resolution_z_mm=UNIT_MM, min_vertices=0)
RULES = {
    'mechanical': replace(_GRID, stability_margin_mm=UNIT_MM / 100),
    'contact': replace(_GRID, com_margin_mm=UNIT_MM / 100),
    'none': _GRID,
}
#: Orientation rule by the number of turns.
TURNS = {'2': 'upright', '6': 'any'}
#: Fills that were published: look-ahead (or buffer), and the percentage.
PUBLISHED = (('GOPT', {1: 76.1}), ('STEP', {1: 81.8, 3: 87.8, 5: 90.0}))


@dataclass(frozen=True)
class Setting:
    """One cell of the table; ``tuned`` is the file with the weights of the algorithm, if any."""

    algorithm: str
    rule: str
    turns: str
    look_ahead: int
    tuned: str = ''


@dataclass(frozen=True)
class Result:
    """What came of a setting: fills in percent and boxes by episode, seconds of a decision."""

    setting: Setting
    fills: tuple[float, ...]
    boxes: tuple[int, ...]
    decision_s: float

    @property
    def fill_text(self) -> str:
        """Mean and half of its 95 % confidence interval."""
        half = 1.96 * stdev(self.fills) / math.sqrt(len(self.fills)) if self.fills[1:] else 0.0
        return f'{fmean(self.fills):.1f} ± {half:.1f}'


def boxes(seed: int) -> Iterator[Box]:
    """The endless stream of one episode."""
    rng, number = random.Random(seed), 0
    while True:
        number += 1
        edges = [rng.randint(1, MOST_UNITS) for _ in range(3)]
        length, breadth, height = (float(UNIT_MM * edge) for edge in edges)
        weight_kg = DENSITY_KG * math.prod(edges)
        yield Box(f'{seed}-{number}', (length, breadth, height), weight_kg=weight_kg)


def episode(setting: Setting, seed: int) -> tuple[float, int, float]:
    """Fill of the bin in percent, boxes in it, and mean seconds of a decision."""
    profile = replace(RULES[setting.rule], orientations=TURNS[setting.turns])
    packing = pack(
        boxes(seed), BIN, setting.algorithm, setting.look_ahead, 1, profile,
        tuned=setting.tuned or None,
    )  # fmt: skip
    while not packing.closings:
        next(packing)
    full = packing.closings[0]
    seconds = [packed.seconds for packed in packing.placements]
    return 100.0 * full.target.fill_rate, len(full.target.boxes), fmean(seconds)


def run(setting: Setting, seeds: Sequence[int], jobs: int) -> Result:
    """All episodes of a setting; the same seeds are the same streams in every setting."""
    done = Parallel(n_jobs=jobs)(delayed(episode)(setting, seed) for seed in seeds)
    fills, counts, seconds = zip(*done, strict=True)
    return Result(setting, fills, counts, fmean(seconds))


def table(results: Sequence[Result]) -> str:
    """Results and published figures as a table in Markdown."""
    look_aheads = sorted({result.setting.look_ahead for result in results})
    heads = [f'look-ahead {n}' for n in look_aheads]
    lines = [
        f'| support | turns | algorithm | {" | ".join(heads)} | boxes | ms a decision |',
        '| --- ' * (5 + len(heads)) + '|',
    ]
    rows: dict[tuple[str, str, str], list[Result]] = {}
    for result in results:
        setting = result.setting
        rows.setdefault((setting.rule, setting.turns, setting.algorithm), []).append(result)
    for (rule, turns, algorithm), row in rows.items():
        cells = ' | '.join(result.fill_text for result in row)
        counts = ' / '.join(f'{fmean(result.boxes):.1f}' for result in row)
        times = ' / '.join(f'{1e3 * result.decision_s:.1f}' for result in row)
        lines.append(f'| {rule} | {turns} | `{algorithm}` | {cells} | {counts} | {times} |')
    for name, known in PUBLISHED:
        cells = ' | '.join(f'{known[n]:.1f}' if n in known else '' for n in look_aheads)
        lines.append(f'| published | | {name} | {cells} | | |')
    return '\n'.join(lines)


def main() -> None:
    """Run every setting and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').partition('\n')[0])
    parser.add_argument('--episodes', type=int, default=100)
    parser.add_argument('--seed', type=int, default=1, help='of the first episode')
    parser.add_argument('--algorithms', nargs='+', default=['mpack_lite', 'rollout', 'foresight'])
    parser.add_argument('--rules', nargs='+', choices=tuple(RULES), default=['mechanical', 'none'])
    parser.add_argument('--turns', nargs='+', choices=tuple(TURNS), default=list(TURNS))
    parser.add_argument('--look-ahead', nargs='+', type=int, default=[1, 3, 5])
    parser.add_argument('--tuned', default='', metavar='FILE', help='weights of the algorithm')
    parser.add_argument('--jobs', type=int, default=1, help='processes')
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.episodes)
    results = []
    for rule in options.rules:
        for turns in options.turns:
            for algorithm in options.algorithms:
                for look_ahead in options.look_ahead:
                    setting = Setting(algorithm, rule, turns, look_ahead, options.tuned)
                    started = time.monotonic()
                    results.append(run(setting, seeds, options.jobs))
                    seconds = time.monotonic() - started
                    print(f'{setting}: {results[-1].fill_text} in {seconds:.0f} s', flush=True)
    print(f'\n{table(results)}')


if __name__ == '__main__':
    main()
