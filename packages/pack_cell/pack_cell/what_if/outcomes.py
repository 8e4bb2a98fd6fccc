"""What comes of each combination: packed without a robot, or run with an arm."""

from __future__ import annotations

import argparse
import hashlib
import json
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from conveyor_sim.streams import open_source, write_boxes
from conveyor_sim.streams.by_name import load_boxes
from pack_cell.bench.results import ResultFile
from pack_cell.bench.runner import Workers, run
from pack_cell.bench.statistics import ci95
from pack_cell.bench.streams import collection
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_cell.options.shared import reading_of
from pack_cell.options.usual import GRASP_FACES, SCAN_SIGMA_MM
from pack_cell.what_if.options import Combination
from pack_msgs_py.profiles import adapted, find_profile
from pack_planner.decision.options import DecisionOptions
from pack_planner.parameters import PlannerParameters


class ArmRunFailed(RuntimeError):
    """A run with the arm came to no summary; the message says which, and what it said."""


@dataclass(frozen=True)
class Outcome:
    """What came of a combination, over all orders of the boxes.

    ``fill`` is of closed bins in percent, ``None`` where none was closed, ``fill_ci`` half its
    95 % interval over the orders; ``by_hand`` the percentage of boxes that no bin took. The last
    two are ``None`` without an arm.
    """

    combination: Combination
    fill: float | None
    fill_ci: float | None
    fill_all: float | None
    closed_bins: float
    by_hand: float
    decision_p95_s: float | None
    boxes_per_hour: float | None = None
    deadline_misses: int | None = None


def source_of(arguments: argparse.Namespace) -> CollectionSource:
    """The boxes, to be shuffled; ``ValueError`` when there is none."""
    reading = reading_of(arguments)
    boxes, rejected = load_boxes(arguments.boxes, reading=reading)
    if not boxes:
        msg = f'{arguments.boxes} holds no usable box; {rejected[0].text}'
        raise ValueError(msg)
    return CollectionSource(
        f'{open_source(arguments.boxes, reading=reading).name}, shuffled',
        tuple(boxes),
        in_order=True,
        shuffle=arguments.seed,
        rejected=tuple((row.box_id, row.text) for row in rejected),
        digest=hashlib.sha256(repr((boxes, rejected)).encode()).hexdigest()[:12],
    )


def _settings(arguments: argparse.Namespace, open_bins: int) -> BenchSettings:
    """As `cell run` decides with these options."""
    usual = PlannerParameters()
    profile = adapted(
        find_profile(arguments.profile), orientations=GRASP_FACES[arguments.grasp_faces]
    )
    return BenchSettings(
        profile=profile,
        open_bins=open_bins,
        seed=arguments.seed,
        budget_s=usual.budget_s,
        options=DecisionOptions(max_passed_over=usual.max_passed_over),
        scan_sigma_mm=SCAN_SIGMA_MM[arguments.profile],
    )


def _case(combination: Combination, source: CollectionSource, orders: int) -> Case:
    return Case(combination.algorithm, combination.spec, combination.look_ahead, orders, source)


def without_robot(
    combinations: Sequence[Combination], arguments: argparse.Namespace, look: Callable[[str], None]
) -> Iterator[Outcome]:
    """Pack every combination without robot or ROS; ``look`` is told what is done."""
    source = source_of(arguments)
    for open_bins, group in groupby(combinations, key=lambda combination: combination.open_bins):
        settings = _settings(arguments, open_bins)
        for combination in group:
            case = _case(combination, source, arguments.orders)
            [record] = run(
                [case], settings, Workers(arguments.jobs), ResultFile(None, None), _ignore
            )
            look(told(combination))
            yield Outcome(
                combination,
                record['fill_closed'],
                record['fill_closed_ci95'],
                record['fill_all'],
                record['closed_bins'] / arguments.orders,
                100 * len(record['unplaced']) / record['boxes'],
                record['decision_s']['p95'],
            )


def _ignore(case: Case, done: int, total: int) -> None:
    """The progress of a single case is not shown."""


def told(combination: Combination) -> str:
    """A combination in words."""
    bins = 'open bin' if combination.open_bins == 1 else 'open bins'
    return (
        f'{combination.spec.name}, {Path(combination.algorithm).name}, '
        f'look-ahead {combination.look_ahead}, {combination.open_bins} {bins}'
    )


def with_arm(
    combinations: Sequence[Combination], arguments: argparse.Namespace, look: Callable[[str], None]
) -> Iterator[Outcome]:
    """Run every combination as a cell, one after another, in folders beside the page.

    Raises
    ------
    ArmRunFailed
        A run came to no summary.
    """
    source = source_of(arguments)
    base = arguments.out.with_suffix('')
    for combination in combinations:
        summaries = []
        case = _case(combination, source, arguments.orders)
        for order in range(arguments.orders):
            name = told(combination).replace(', ', '_').replace(' ', '-').replace(':', '-')
            folder = base / f'{name}_{order + 1}'
            folder.mkdir(parents=True, exist_ok=True)
            # Unscanned: the cell has a scanner of its own.
            exact = BenchSettings(profile=find_profile(arguments.profile))
            write_boxes(folder / 'given.csv', collection(case, exact, order))
            summaries.append(_run_cell(combination, arguments, folder, order))
        look(told(combination))
        yield _of_summaries(combination, summaries)


def _run_cell(
    combination: Combination, arguments: argparse.Namespace, folder: Path, order: int
) -> dict[str, Any]:
    """The summary of one run; what an earlier one left in the folder is taken as it is."""
    summary = folder / 'summary.json'
    if not summary.exists():
        command = [
            sys.executable, '-m', 'pack_cell', 'run', '--quiet', '--boxes', folder / 'given.csv',
            '--bin', combination.spec.name, '--algorithm', combination.algorithm,
            '--open-bins', combination.open_bins, '--look-ahead', combination.look_ahead,
            '--profile', arguments.profile, '--grasp-faces', arguments.grasp_faces,
            '--arm', arguments.arm, '--out', folder,
            *(['--order-by', 'destination'] if getattr(arguments, 'order_by', '') else []),
        ]  # fmt: skip
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
        if not summary.exists():
            said = (done.stderr or done.stdout).strip().splitlines()
            msg = f'{told(combination)}, order {order + 1}: {said[-1] if said else "no word"}'
            raise ArmRunFailed(msg)
    values: dict[str, Any] = json.loads(summary.read_text(encoding='utf-8'))
    return values


def _of_summaries(combination: Combination, summaries: Sequence[dict[str, Any]]) -> Outcome:
    fills = _known(summary['fill_closed'] for summary in summaries)
    fed = sum(summary['boxes_supplied'] for summary in summaries)
    rejected = sum(summary['rejected'] for summary in summaries)
    return Outcome(
        combination,
        _mean(fills),
        ci95(fills),
        _mean(_known(summary['fill_all'] for summary in summaries)),
        statistics.fmean(summary['closed_bins'] for summary in summaries),
        100 * rejected / fed if fed else 0.0,
        _mean(_known(summary['planning_s']['p95'] for summary in summaries)),
        _mean(_known(summary['boxes_per_hour'] for summary in summaries)),
        sum(summary['deadline_misses'] for summary in summaries),
    )


def _known(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _mean(values: Sequence[float]) -> float | None:
    return statistics.fmean(values) if values else None
