"""What the options of ``cell bench`` ask for."""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pack_cell.bench.options import MAX_BUDGET_S
from pack_msgs_py.profiles import adapted, find_profile
from pack_msgs_py.values import parse_bin

if TYPE_CHECKING:
    from pack_cell.bench.values import BenchSettings, Case, CollectionSource
    from pack_planner.algorithms import AlgorithmSpec
    from pack_planner.decision.options import DecisionOptions

MAX_LOOK_AHEAD = 6
DEFAULT_BUDGET_S = 5.0


def settings_of(arguments: argparse.Namespace) -> BenchSettings:
    """What holds for all cases; ``ValueError`` says what is wrong."""
    from pack_cell.bench import paper
    from pack_cell.bench.values import BenchSettings
    from pack_planner.algorithms.tuned_tables import read_table
    from pack_planner.decision.weights import parse_weights

    profile = find_profile(arguments.profile)
    orientations = arguments.orientations or profile.orientations
    if not arguments.orientations and profile.name == 'paper':
        orientations = paper.ORIENTATIONS
    profile = adapted(
        profile,
        orientations=orientations,
        clearance_mm=arguments.clearance,
        resolution_mm=arguments.resolution,
    )
    return BenchSettings(
        profile=profile,
        open_bins=arguments.open_bins,
        destinations=arguments.destinations or 0,
        boxes_per_bin=arguments.boxes_per_bin,
        seed=arguments.seed,
        budget_s=_budget(arguments),
        node_limit=arguments.budget_nodes,
        cpu_clock=arguments.clock == 'cpu',
        weights=parse_weights(arguments.weights),
        options=_options(arguments),
        tuned=None if arguments.tuned is None else read_table(arguments.tuned),
        scan_sigma_mm=arguments.scan_sigma,
    )


def _budget(arguments: argparse.Namespace) -> float:
    if arguments.budget is not None:
        return float(arguments.budget)
    return DEFAULT_BUDGET_S if arguments.budget_nodes is None else MAX_BUDGET_S


def _options(arguments: argparse.Namespace) -> DecisionOptions:
    from pack_planner.decision.options import DecisionOptions

    return DecisionOptions(
        sort=arguments.sort,
        selection=arguments.selection,
        large_until=arguments.large_until,
        closing=arguments.closing,
        max_passed_over=arguments.max_passed_over,
    )


def cases_of(arguments: argparse.Namespace) -> list[Case]:
    """Bins outermost, then look-aheads, then algorithms; ``ValueError`` says what is wrong."""
    from pack_cell.bench import paper
    from pack_cell.bench.values import Case, CollectionSource

    algorithms = _algorithms(arguments)
    bins = [parse_bin(text) for text in _items(
        arguments.bins, '--bins', list(paper.BINS) if arguments.paper else ['SYN'])]  # fmt: skip
    looks = _look_aheads(
        _items(arguments.look_ahead, '--look-ahead', ['1-5'] if arguments.paper else ['5'])
    )
    if arguments.shuffle is not None and arguments.boxes is None:
        msg = '--shuffle needs --boxes; cut and drawn collections are random anyway, see --seed'
        raise ValueError(msg)
    cases: list[Case] = []
    file_source: CollectionSource | None = None
    for spec in bins:
        if arguments.boxes is None and spec.name == 'SYN':
            source = CollectionSource('SYN, cut from ten bins')
        else:
            source = file_source or _source_of_file(arguments)
            file_source = source
        standard = 1 if source.in_order else paper.collections_of(spec.name)
        count = arguments.collections or standard
        for look_ahead in looks:
            cases += [
                Case(name, spec, look_ahead, count, source, backend, cep, algorithm.digest)
                for name, algorithm, backend in algorithms
                for cep in _contact(arguments, algorithm)
            ]
    _notes(cases)
    return cases


def check_tuned(settings: BenchSettings, cases: Sequence[Case]) -> None:
    """Refuse tuned weights that are for none of the algorithms, or not for one that has some."""
    from pack_planner.algorithms import find_algorithm
    from pack_planner.algorithms.tuned_tables import check_table
    from pack_planner.algorithms.tuned_weights import unlike

    if settings.tuned is None:
        return
    algorithms = [find_algorithm(name) for name in dict.fromkeys(case.algorithm for case in cases)]
    for algorithm in [spec for spec in algorithms if spec.weights is not None] or algorithms:
        check_table(settings.tuned, algorithm.name, algorithm.weights)
        for spec in dict.fromkeys(case.bin_spec for case in cases):
            entry = settings.tuned.nearest(algorithm.name, spec, settings.profile)
            told = '' if entry is None else unlike(entry, spec, settings.profile)
            if told:
                print(f'cell bench: note: {settings.tuned.source} was {told}', file=sys.stderr)


def _algorithms(arguments: argparse.Namespace) -> list[tuple[str, AlgorithmSpec, str]]:
    """Names and algorithms, each with every backend that is asked for, if it has any."""
    from pack_cell.bench import paper
    from pack_msgs_py.plug_ins import absolute_place
    from pack_planner.algorithms import algorithm_names, find_algorithm
    from pack_planner.algorithms.base import BACKENDS
    from pack_planner.joint.by_solver.solvers import cp_sat_installed

    backends = _items(arguments.backend, '--backend', ['search'])
    for name in backends:
        if name not in BACKENDS:
            msg = f'unknown backend {name!r}: use one of {", ".join(BACKENDS)}'
            raise ValueError(msg)
        if name != 'search' and not cp_sat_installed():
            msg = (
                f'backend {name!r} needs OR-Tools, which is not installed: install it with '
                '`./cell python -m pip install ortools`, or leave --backend out'
            )
            raise ValueError(msg)
    default = ['first_fit', 'o_first_fit', 'mpack_lite']
    if arguments.paper:
        default = list(paper.NAMES)
    elif 'search' not in backends:
        default = ['mpack_lite']
    names = _items(arguments.algorithms, '--algorithms', default)
    if names == ['all']:
        names = list(algorithm_names())
    combinations = []
    for name in map(absolute_place, names):
        algorithm = find_algorithm(name)
        if algorithm.backends:
            combinations += [(name, algorithm, backend) for backend in backends]
        elif 'search' in backends:
            combinations.append((name, algorithm, 'search'))
        else:
            able = [other for other in algorithm_names() if find_algorithm(other).backends]
            msg = (
                f'algorithm {algorithm.name!r} has no backend {backends[0]!r}: with --backend '
                f'name {" and ".join(able)} alone in --algorithms'
            )
            raise ValueError(msg)
    return combinations


def _contact(arguments: argparse.Namespace, algorithm: AlgorithmSpec) -> list[bool]:
    """Whether the constraints for efficient packing hold; both when both are asked for."""
    from pack_cell.bench.paper import WITH_CONTACT

    if not algorithm.backends:
        return [False]
    default = ['paper'] if arguments.paper else ['off']
    choices = default if arguments.cep is None else arguments.cep or ['on']
    in_paper = {'on': True, 'off': False, 'paper': algorithm.name in WITH_CONTACT}
    return list(dict.fromkeys(in_paper[choice] for choice in choices))


def _source_of_file(arguments: argparse.Namespace) -> CollectionSource:
    """Boxes of the given file, or of the built-in one."""
    from conveyor_sim.streams import load_boxes, open_source
    from pack_cell.bench.values import CollectionSource
    from pack_cell.options.shared import reading_of

    reading = reading_of(arguments)
    boxes, rejected = load_boxes(arguments.boxes or '', reading=reading)
    if not boxes:
        msg = f'box file {arguments.boxes} holds no usable box; {rejected[0].text}'
        raise ValueError(msg)
    in_order = arguments.boxes is not None and (
        arguments.collections is None or arguments.shuffle is not None
    )
    source = open_source(arguments.boxes or '', reading=reading)
    for note in source.notes:
        print(f'cell bench: {source.name}: {note}', file=sys.stderr)
    name = source.name
    if not in_order:
        name += ', drawn with replacement'
    elif arguments.shuffle is not None:
        name += f', shuffled with seed {arguments.shuffle}'
    else:
        name += ', in its order'
    return CollectionSource(
        name=name,
        boxes=tuple(boxes),
        in_order=in_order,
        shuffle=arguments.shuffle,
        rejected=tuple((row.box_id, row.text) for row in rejected),
        digest=hashlib.sha256(repr((boxes, rejected)).encode()).hexdigest()[:12],
    )


def _notes(cases: Sequence[Case]) -> None:
    """Say on stderr what a user may not expect."""
    for source in {case.source for case in cases}:
        for _, text in source.rejected:
            print(f'cell bench: left out: {text}', file=sys.stderr)
    streams = {(case.look_ahead, len(case.source.boxes)) for case in cases if case.source.in_order}
    for look_ahead, count in sorted(streams):
        if look_ahead <= count:
            continue
        print(
            f'cell bench: note: look-ahead {look_ahead} sees all {count} boxes of the stream',
            file=sys.stderr,
        )


def _items(given: Sequence[str] | None, option: str, default: list[str]) -> list[str]:
    """A list written with spaces, commas or both, each item once."""
    if given is None:
        return default
    items = [item for text in given for item in text.split(',') if item]
    if not items:
        msg = f'{option} names nothing'
        raise ValueError(msg)
    return list(dict.fromkeys(items))


def _look_aheads(items: Sequence[str]) -> list[int]:
    looks: list[int] = []
    for item in items:
        low, dash, high = item.partition('-')
        if not low.isdecimal() or (dash and not high.isdecimal()):
            msg = f'look-ahead {item!r} is neither a whole number nor a range such as 1-5'
            raise ValueError(msg)
        numbers = range(int(low), int(high or low) + 1)
        if not numbers or not 1 <= int(low) <= int(high or low) <= MAX_LOOK_AHEAD:
            msg = f'look-ahead {item} is out of range: it must be 1 to {MAX_LOOK_AHEAD}'
            raise ValueError(msg)
        looks += numbers
    return list(dict.fromkeys(looks))
