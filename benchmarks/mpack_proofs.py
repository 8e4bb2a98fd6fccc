#!/usr/bin/env python3
"""How often and how fast `mpack` proves its decisions, on states of whole runs.

A run of `mpack_lite` fills and closes bins; some of the states it meets are decided once more by
`mpack`. Run it in the environment of `./cell setup`:

    python benchmarks/mpack_proofs.py
    python benchmarks/mpack_proofs.py --bins RC PAL --look-ahead 5 6 --states 40 --cep
    python benchmarks/mpack_proofs.py --look-ahead 2 --backends search,cp_sat,milp --budget 30
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections.abc import Sequence

from growth import boxes_for

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.metrics import quantile
from pack_msgs_py.profiles import PROFILES, find_profile
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, BinSpec, Box, parse_bin
from pack_planner.algorithms import Choice, Problem
from pack_planner.algorithms.base import BACKENDS
from pack_planner.algorithms.mpack import mpack, warm_up
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.engine import Engine

State = tuple[tuple[Box, ...], tuple[Bin, ...]]


def states_of_a_run(
    engine: Engine, boxes: Sequence[Box], spec: BinSpec, look_ahead: int, open_bins: int
) -> list[State]:
    """Every look-ahead and open bins that MPackLite meets while it packs ``boxes``."""
    stream = [box for box in boxes if engine.fits_empty_bin(box, spec)]
    bins = [Bin(f'bin-{i}', i, spec) for i in range(1, open_bins + 1)]
    serial, states = open_bins, []
    while stream:
        ahead = tuple(stream[:look_ahead])
        states.append((ahead, tuple(bins)))
        choice = mpack_lite(Problem(engine, ahead, tuple(engine.model(target) for target in bins)))
        if choice is None:
            bins.remove(max(bins, key=lambda target: target.fill_rate))
            serial += 1
            bins.append(Bin(f'bin-{serial}', serial, spec))
            continue
        index = choice.candidate.bin_index
        bins[index] = with_box(bins[index], choice.candidate.placed)
        stream.remove(choice.candidate.placed.box)
    return states


def decide(
    engine: Engine, state: State, options: argparse.Namespace, backend: str
) -> tuple[Choice | None, float]:
    """What `mpack` answers, and its seconds."""
    clock = time.perf_counter if options.clock == 'wall' else time.thread_time
    boxes, bins = state
    models = tuple(engine.model(target) for target in bins)
    started = clock()
    choice = mpack(
        Problem(
            engine, boxes, models, budget_s=options.budget, node_limit=options.budget_nodes,
            backend=backend, cep=options.cep,
        )
    )  # fmt: skip
    return choice, clock() - started


def joint_objective(choice: Choice | None) -> str:
    """Joint objective of a decision and how many boxes it is of; '-' without."""
    if choice is None or not choice.reason.startswith('joint objective'):
        return '-'
    words = choice.reason.split()
    return f'{words[2]} ({words[4]} boxes)'


def proof_row(name: str, look_ahead: int, answers: list[tuple[Choice | None, float]]) -> str:
    """One row of the table of proofs."""
    seconds = [spent for _, spent in answers]
    proven = sum(c is None or c.status is PlacementStatus.OPTIMAL for c, _ in answers)
    gaps = [c.gap for c, _ in answers if c is not None and c.gap != float('inf')]
    unknown = sum(c is not None and c.gap == float('inf') for c, _ in answers)
    return (
        f'| {name} | {look_ahead} | {len(answers)} | {100 * proven / len(answers):.1f} '
        f'| {sum(seconds) / len(seconds):.3f} | {quantile(seconds, 0.5):.3f} '
        f'| {quantile(seconds, 0.95):.3f} | {max(seconds):.3f} '
        f'| {100 * sum(gaps) / max(1, len(gaps)):.2f} | {unknown} |'
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', nargs='+', default=['SYN', 'LDC', 'RC', 'PAL', 'EQ'])
    parser.add_argument('--look-ahead', nargs='+', type=int, default=[5])
    parser.add_argument('--open-bins', type=int, default=3)
    parser.add_argument('--states', type=int, default=20, help='states per bin and look-ahead')
    parser.add_argument('--profile', choices=tuple(PROFILES), default='paper')
    parser.add_argument('--budget', type=float, default=5.0, help='seconds per decision')
    parser.add_argument('--budget-nodes', type=int, default=None)
    parser.add_argument('--cep', action='store_true', help='with contact constraints')
    parser.add_argument(
        '--backends', default='search', help='some of search,cp_sat,milp; several: side by side'
    )
    parser.add_argument('--volume-bins', type=int, default=10, help='stream volume in bins')
    parser.add_argument('--boxes', default='', help='box file; default: the built-in cartons')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument(
        '--clock',
        choices=('wall', 'cpu'),
        default='wall',
        help='cpu leaves out what other processes take; the budget is wall time all the same',
    )
    options = parser.parse_args()
    backends = options.backends.split(',')
    if not set(backends) <= set(BACKENDS):
        parser.error(f'--backends {options.backends}: choose from {",".join(BACKENDS)}')
    engine = Engine(find_profile(options.profile))
    warm_up(engine)
    head = (
        'bin | look-ahead | decisions | proven % | mean s | median s | p95 s | max s '
        '| mean gap % | gap unknown'
        if len(backends) == 1
        else 'bin | look-ahead | state | '
        + ' | '.join(f'{name} objective | {name} status | {name} s' for name in backends)
    )
    sys.stdout.write(f'| {head} |\n' + '|---' * (head.count('|') + 1) + '|\n')
    for name in options.bins:
        spec, rng = parse_bin(name), random.Random(options.seed)
        boxes = boxes_for(spec, options.volume_bins, rng, options.boxes)
        for look_ahead in options.look_ahead:
            states = states_of_a_run(engine, boxes, spec, look_ahead, options.open_bins)
            chosen = sorted(rng.sample(range(len(states)), min(options.states, len(states))))
            if len(backends) == 1:
                answers = [decide(engine, states[at], options, backends[0]) for at in chosen]
                sys.stdout.write(proof_row(name, look_ahead, answers) + '\n')
            for at in chosen if len(backends) > 1 else ():
                cells = []
                for backend in backends:
                    choice, seconds = decide(engine, states[at], options, backend)
                    status = 'optimal' if choice is None else choice.status.name.lower()
                    cells.append(f'{joint_objective(choice)} | {status} | {seconds:.2f}')
                sys.stdout.write(f'| {name} | {look_ahead} | {at} | {" | ".join(cells)} |\n')
                sys.stdout.flush()
            sys.stdout.flush()


if __name__ == '__main__':
    main()
