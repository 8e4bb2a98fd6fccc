"""``cell tune``: weights for boxes and bins of one's own."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pack_cell.options.shared import reading_of
from pack_cell.tune.options import add_tune
from pack_msgs_py.profiles import adapted, find_profile
from pack_msgs_py.signals import interrupts_kept
from pack_msgs_py.wording import how_many

if TYPE_CHECKING:
    from pack_cell.tune.search import Generation, Limits
    from pack_cell.tune.values import TuneSettings
    from pack_planner.algorithms.tuned_weights import TunedTable

EXIT_NO_BETTER = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130
DEFAULT_MINUTES = 30.0

__all__ = ['add_tune', 'run_tune']


def run_tune(arguments: argparse.Namespace, given: Sequence[str] = ()) -> int:
    """Tune; return the exit code. ``given`` is the command line, for the parameter file."""
    from pack_cell.bench.cluster import ClusterLost
    from pack_planner.algorithms import AlgorithmError
    from pack_planner.engine import EngineMismatch

    try:
        return _run(arguments, shlex.join(['./cell', *given]))
    except (ValueError, OSError) as error:
        print(f'cell tune: {error}', file=sys.stderr)
        return EXIT_USAGE
    except (EngineMismatch, AlgorithmError) as error:
        print(f'cell tune: {error}', file=sys.stderr)
        return EXIT_NO_BETTER
    except ClusterLost as error:
        print(f'cell tune: {error}; trials are kept, run the same command again', file=sys.stderr)
        return EXIT_NO_BETTER
    except KeyboardInterrupt:
        print('cell tune: interrupted; the same command goes on from here', file=sys.stderr)
        return EXIT_INTERRUPTED


def settings_of(arguments: argparse.Namespace) -> TuneSettings:
    """What is asked for; ``ValueError`` says what is wrong."""
    from conveyor_sim.streams import load_boxes, resolved
    from pack_cell.tune.values import TuneSettings
    from pack_msgs_py.plug_ins import absolute_place
    from pack_planner.algorithms import algorithm_names, find_algorithm

    algorithm = find_algorithm(arguments.algorithm)
    if algorithm.weights is None:
        able = [name for name in algorithm_names() if find_algorithm(name).weights is not None]
        msg = f'algorithm {algorithm.name!r} has no weights to tune: use {", ".join(able)}'
        raise ValueError(msg)
    boxes = tuple(resolved(choice) for choice in arguments.boxes)
    reading = reading_of(arguments)
    for choice in boxes:
        if not load_boxes(choice, reading=reading)[0]:
            msg = f'box file {choice} holds no usable box'
            raise ValueError(msg)
    return TuneSettings(
        algorithm=absolute_place(arguments.algorithm),
        bin_spec=arguments.bin_spec,
        profile=adapted(
            find_profile(arguments.profile),
            orientations=arguments.orientations or '',
            clearance_mm=arguments.clearance,
            resolution_mm=arguments.resolution,
        ),
        boxes=boxes,
        reading=reading,
        look_ahead=arguments.look_ahead,
        open_bins=arguments.open_bins,
        scan_sigma_mm=arguments.scan_sigma,
        stream_bins=arguments.stream_bins,
        streams=arguments.streams,
        check_streams=arguments.check_streams,
        seed=arguments.seed,
        only=tuple(filter(None, arguments.only.split(','))),
        step=arguments.step,
    )


def _run(arguments: argparse.Namespace, command: str) -> int:
    from pack_cell.bench.runner import Workers
    from pack_cell.tune import report
    from pack_cell.tune.checking import check
    from pack_cell.tune.search import search
    from pack_cell.tune.space import WeightSpace
    from pack_cell.tune.trials import TRIALS, TrialBook, tuned_entry
    from pack_planner.algorithms.tuned_tables import write_table

    began = time.monotonic()
    settings = settings_of(arguments)
    space = WeightSpace(_start(arguments, settings), settings.only)
    out: Path = arguments.out
    table = _table_so_far(out)
    note = _nobody if arguments.quiet else _to_stderr
    out.parent.mkdir(parents=True, exist_ok=True)
    workers = Workers(arguments.jobs, arguments.cluster, note=_to_stderr)

    def progress(generation: Generation) -> None:
        note(report.generation_line(generation, time.monotonic() - began))

    with interrupts_kept() as look:
        book = TrialBook(settings, workers, out.with_name(out.name + TRIALS), look)
        if book.kept:
            note(f'known of earlier runs: {how_many(book.kept, "trial")}')
        try:
            found = search(settings, space, book, _limits(arguments), progress)
            note(f'checking on {settings.check_streams} other streams')
            gain = check(settings, space.start, found.weights, book)
        finally:
            book.close()
    made = report.record(settings, found, gain, command)
    if arguments.json is not None:
        arguments.json.parent.mkdir(parents=True, exist_ok=True)
        content = {**made, 'start': dict(space.start), 'weights': dict(found.weights)}
        arguments.json.write_text(json.dumps(content, indent=1, allow_nan=False) + '\n')
    for line in report.summary(settings, space.start, found, gain):
        print(line)
    if gain.points <= 0:
        print(f'{out} is as it was')
        return EXIT_NO_BETTER
    write_table(table.plus(tuned_entry(settings, found.weights, made)), out)
    print(f'wrote {out}: cell run --algorithm {arguments.algorithm} --tuned {out}')
    return 0


def _start(arguments: argparse.Namespace, settings: TuneSettings) -> object:
    """The weights to begin with."""
    from pack_planner.algorithms import find_algorithm
    from pack_planner.algorithms.tuned_tables import check_table, read_table, weights_for

    algorithm = find_algorithm(settings.algorithm)
    table = None if arguments.start is None else read_table(arguments.start)
    if table is not None:
        check_table(table, algorithm.name, algorithm.weights)
    own = algorithm.own_weights(settings.profile, settings.open_bins)
    return weights_for(table, algorithm.name, own, settings.bin_spec, settings.profile)


def _limits(arguments: argparse.Namespace) -> Limits:
    from pack_cell.tune.search import Limits

    minutes = arguments.minutes
    if minutes is None and arguments.evaluations is None:
        minutes = DEFAULT_MINUTES
    until_s = None if minutes is None else time.monotonic() + 60.0 * minutes
    return Limits(arguments.evaluations, until_s)


def _table_so_far(path: Path) -> TunedTable:
    """What the parameter file holds already."""
    from pack_planner.algorithms.tuned_tables import read_table
    from pack_planner.algorithms.tuned_weights import TunedTable

    return read_table(str(path)) if path.exists() else TunedTable()


def _to_stderr(text: str) -> None:
    print(f'cell tune: {text}', file=sys.stderr)


def _nobody(text: str) -> None:
    """Progress that nobody wants to read."""
