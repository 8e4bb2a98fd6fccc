"""The backends of MPackLite: the same objective on the same state, and how they are recorded."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace

import pytest

from pack_cell.bench.report import HEADINGS, row, table1
from pack_cell.bench.results import ResultFile
from pack_cell.bench.runner import Workers, run
from pack_cell.bench.streams import cut_collection
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, Box, parse_bin
from pack_planner.algorithms import Problem
from pack_planner.algorithms.base import BACKENDS
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.engine import Engine

PAPER = replace(PROFILES['paper'], orientations='any')
#: The cell's rules on a coarse grid, without those that need many rounds of asking again.
CELL = replace(PROFILES['cell'], resolution_mm=20, check_top_load=False)


def states(engine, spec, boxes, look_ahead, open_bins):
    """Every decision of a whole run: closed-bin protocol, MPackLite by our own search."""
    bins = [Bin(f'bin-{i}', i, spec) for i in range(1, open_bins + 1)]
    belt, opened = list(boxes), open_bins
    while belt:
        models = tuple(engine.model(standing) for standing in bins)
        problem = Problem(engine, tuple(belt[:look_ahead]), models, budget_s=60.0)
        choice = mpack_lite(problem)
        yield problem, choice
        if choice is None:
            fullest = max(bins, key=lambda standing: standing.fill_rate)
            bins.remove(fullest)
            opened += 1
            bins.append(Bin(f'bin-{opened}', opened, spec))
            continue
        placed = choice.candidate.placed
        index = choice.candidate.bin_index
        bins[index] = with_box(bins[index], placed)
        belt.remove(placed.box)


def carton(rng, number):
    edges = [float(rng.choice((97, 120, 148, 196, 243))) for _ in range(3)]
    return Box(f'carton-{number}', (edges[0], edges[1], edges[2]), weight_kg=2.0)


@pytest.mark.parametrize('backend', ['cp_sat', 'milp'])
@pytest.mark.parametrize('profile', ['paper', 'cell'])
def test_on_sampled_states_of_whole_runs_every_backend_has_the_objective_of_the_search(
    backend, profile
):
    rng = random.Random(f'{backend} {profile}')
    if profile == 'paper':
        spec, engine = parse_bin('SYN'), Engine(PAPER)
        boxes = list(cut_collection(spec, 23, rng))[:70]
    else:
        spec, engine = parse_bin('60x40x40'), Engine(CELL)
        boxes = [carton(rng, number) for number in range(60)]
    every_state = list(states(engine, spec, boxes, look_ahead=3, open_bins=2))
    assert any(choice is None for _, choice in every_state), 'no bin was closed'
    sampled = rng.sample(every_state, 5 if backend == 'cp_sat' else 3)
    sampled += [state for state in every_state if state[1] is None][:1]
    for problem, choice in sampled:
        answer = mpack_lite(replace(problem, backend=backend))
        if choice is None:
            assert answer is None
            continue
        assert answer is not None and answer.status is PlacementStatus.OPTIMAL
        assert first_objectives(problem, backend) == pytest.approx(
            first_objectives(problem, 'search')
        )


def first_objectives(problem, backend):
    """Objective of each box of the look-ahead alone: what PACKRULE minimises, without ties."""
    objectives = []
    for box in problem.boxes:
        choice = mpack_lite(replace(problem, boxes=(box,), backend=backend))
        objectives.append(math.inf if choice is None else choice.candidate.objective)
    return objectives


def case(backend, algorithm='mpack_lite'):
    boxes = tuple(Box(f'b{i}', (200.0, 150.0 + 10 * i, 100.0)) for i in range(4))
    source = CollectionSource('test', boxes, in_order=True)
    return Case(algorithm, parse_bin('60x40x40'), 2, 1, source, backend)


def test_records_and_tables_name_the_backend_and_keep_them_apart(tmp_path):
    path = tmp_path / 'r.json'
    cases = [case(backend) for backend in BACKENDS] + [case('search', 'first_fit')]
    settings = BenchSettings(PAPER, budget_s=60.0)
    results = ResultFile(path, None)
    records = run(cases, settings, Workers(), results, lambda *_: None)
    results.close()
    assert [record['backend'] for record in records] == ['search', 'cp_sat', 'milp', None]
    assert len(json.loads(path.read_text())) == 4
    column = HEADINGS.index('algorithm')
    assert [row(record)[column] for record in records] == [
        'mpack_lite', 'mpack_lite, cp_sat', 'mpack_lite, milp', 'first_fit',
    ]  # fmt: skip
    headings, rows = table1(records)
    assert headings[2:] == (
        'FF % [paper]', 'MPackLite % [paper]', 'MPackLite, cp_sat % [paper]',
        'MPackLite, milp % [paper]',
    )  # fmt: skip
    assert len(rows) == 1
    again = run(cases, settings, Workers(), ResultFile(path, None), lambda *_: None)
    assert again == records
