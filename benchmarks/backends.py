#!/usr/bin/env python3
"""The backends of `mpack_lite` side by side: objectives and times on the same states.

A run of `mpack_lite` by our own search fills the open bins; some of its states are decided once
more by each backend. Run it in the environment of `./cell setup`:

    python benchmarks/backends.py
    python benchmarks/backends.py --bins LDC --look-ahead 5 --states 20

Equal: on so many states each box of the look-ahead, placed alone, has the objective that our own
search found. `benchmarks/mpack_proofs.py` does the same for `mpack`.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from dataclasses import replace

from growth import PROFILE, State, boxes_for, filled

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.metrics import quantile
from pack_msgs_py.values import parse_bin
from pack_planner.algorithms import Problem
from pack_planner.algorithms.base import BACKENDS
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.engine import Engine


def problem_of(engine: Engine, state: State, look_ahead: int, budget_s: float) -> Problem:
    """The decision of ``state``."""
    models = tuple(engine.model(target) for target in state.bins)
    return Problem(engine, state.boxes[:look_ahead], models, budget_s=budget_s)


def objectives(problem: Problem) -> list[float]:
    """Least objective of each box alone, which does not depend on ties; infinite for no place."""
    choices = [mpack_lite(replace(problem, boxes=(box,))) for box in problem.boxes]
    return [
        math.inf if choice is None else round(choice.candidate.objective, 6) for choice in choices
    ]


def line(backend: str, problems: list[Problem], wanted: list[list[float]]) -> str:
    """One row of the table."""
    seconds, proven, equal = [], 0, 0
    for problem, expected in zip(problems, wanted, strict=True):
        asked = replace(problem, backend=backend)
        started = time.perf_counter()
        choice = mpack_lite(asked)
        seconds.append(time.perf_counter() - started)
        proven += choice is None or choice.status is PlacementStatus.OPTIMAL
        equal += objectives(asked) == expected
    count = len(problems)
    return (
        f'| {backend} | {count} | {equal} | {proven} | {1e3 * quantile(seconds, 0.5):.2f} '
        f'| {1e3 * quantile(seconds, 0.95):.2f} | {1e3 * max(seconds):.2f} |\n'
    )


def main() -> None:
    """Print a table for each kind of bin."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', nargs='+', default=['SYN', 'LDC'])
    parser.add_argument('--look-ahead', type=int, default=3)
    parser.add_argument('--states', type=int, default=10)
    parser.add_argument('--open-bins', type=int, default=2)
    parser.add_argument('--budget', type=float, default=60.0, help='seconds per decision')
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    engine = Engine(PROFILE)
    for name in options.bins:
        rng, spec = random.Random(f'{options.seed}/{name}'), parse_bin(name)
        states = filled(engine, spec, boxes_for(spec, 3, rng), options.open_bins)
        chosen = rng.sample(states, min(options.states, len(states)))
        problems = [
            problem_of(engine, state, options.look_ahead, options.budget) for state in chosen
        ]
        wanted = [objectives(problem) for problem in problems]
        sys.stdout.write(
            f'\n{name}, look-ahead {options.look_ahead}, {options.open_bins} open bins\n\n'
            '| backend | states | equal | proven | median ms | 95 % ms | max ms |\n'
            '|---|---|---|---|---|---|---|\n'
        )
        for backend in BACKENDS:
            warm_up('mpack_lite', PROFILE, backend)
            sys.stdout.write(line(backend, problems, wanted))
            sys.stdout.flush()


if __name__ == '__main__':
    main()
