#!/usr/bin/env python3
"""What each term of the waste is worth: the fill of `foresight` with one of them changed.

Run it in the environment of `./cell setup`; docs/benchmarks/foresight.md shows the table it prints:

    python benchmarks/waste_terms.py --bins LDC EQ
    python benchmarks/waste_terms.py --boxes draw:cartons draw:cases.csv --set above=0.6 beside=0
    python benchmarks/waste_terms.py --boxes draw:cases.csv --open-bins 3 --set room=0

Every line packs the same streams of boxes as the scanner measures them, by the weights of
`foresight` itself but for what the line says; its cells hold the mean and each stream.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import islice

from conveyor_sim.streams import Stream
from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import Box
from pack_planner import pack
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.foresight import foresight, weights_by
from pack_planner.algorithms.waste_weights import WasteWeights

#: What is changed where nothing else is asked for.
CHANGES = (
    '', 'above=0 beside=0 level_mm=0', 'beside=0 level_mm=0', 'above=0 level_mm=0',
    'above=0 beside=0', 'level_mm=0', 'beside=0', 'above=0', 'snug=0', 'hollow=0.3', 'room=0',
)  # fmt: skip


def changed(own: WasteWeights, text: str) -> WasteWeights:
    """``own`` but for ``text``: pairs name=value."""
    kinds = {each.name: type(getattr(own, each.name)) for each in fields(own)}
    pairs = [pair.split('=') for pair in text.split()]
    return replace(own, **{name: kinds[name](float(value)) for name, value in pairs})


def fill(boxes: Sequence[Box], bin_name: str, profile: Profile, bins: int, text: str) -> float:
    """Mean fill rate of the closed bins, percent, of one stream."""
    weights = changed(weights_by(profile, bins), text)

    def with_these_weights(problem: Problem) -> Choice | None:
        return foresight(replace(problem, weights=weights))

    figures = pack(boxes, bin_name, with_these_weights, 5, bins, profile, budget_s=600.0).finish()
    if figures.fill_closed is None:
        msg = f'{len(boxes)} boxes close no bin {bin_name}: use --count'
        raise SystemExit(msg)
    return figures.fill_closed


def measured(name: str, count: int, seed: int, sigma_mm: float) -> list[Box]:
    """The first ``count`` boxes of the stream ``name``, as a scanner with this error knows them."""
    stream = islice(Stream.open(name, count=count, seed=seed), count)
    return [
        replace(box, id=f'{index}', size_stddev_mm=(sigma_mm,) * 3)
        for index, box in enumerate(stream)
        if isinstance(box, Box)
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else '')
    parser.add_argument('--bins', nargs='+', default=['LDC', 'RC', 'EQ', 'PAL'])
    parser.add_argument('--boxes', nargs='+', default=['draw:cartons'], metavar='BOXES')
    parser.add_argument('--seeds', nargs='+', type=int, default=[1, 2, 3])
    parser.add_argument('--count', type=int, default=160, help='boxes of a stream')
    parser.add_argument('--sigma-mm', type=float, default=2.0, help='error of the scanner')
    parser.add_argument('--profile', choices=PROFILES, default='dense')
    parser.add_argument('--orientations', choices=ORIENTATION_RULES, default='any')
    parser.add_argument('--open-bins', type=int, default=2)
    parser.add_argument('--set', nargs='+', metavar='NAME=VALUE', help='one line with these alone')
    args = parser.parse_args()
    profile = replace(PROFILES[args.profile], orientations=args.orientations)
    lines = ['', ' '.join(args.set)] if args.set else list(CHANGES)
    print('| changed |', ' | '.join(args.bins), '|')
    print('| --- |', ' | '.join(['---'] * len(args.bins)), '|', flush=True)
    for text in lines:
        means = []
        for bin_name in args.bins:
            fills = [
                fill(
                    measured(name, args.count, seed, args.sigma_mm), bin_name, profile,
                    args.open_bins, text,
                )
                for name in args.boxes
                for seed in args.seeds
            ]  # fmt: skip
            each = ', '.join(f'{one:.1f}' for one in fills)
            means.append(f'{sum(fills) / len(fills):.1f} ({each})')
        print('|', text or 'nothing', '|', ' | '.join(means), '|', flush=True)


if __name__ == '__main__':
    main()
