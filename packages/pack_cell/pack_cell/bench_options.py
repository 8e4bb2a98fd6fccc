"""Options of ``cell bench``: names, defaults, ranges and texts, and what they ask for."""

from __future__ import annotations

import argparse
import hashlib
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.profiles import PROFILES, find_profile
from pack_msgs_py.values import parse_bin

if TYPE_CHECKING:
    from pack_planner.bench.values import Case, Settings, Source
    from pack_planner.options import Options

MAX_LOOK_AHEAD = 6
DEFAULT_BUDGET_S, MAX_BUDGET_S = 5.0, 86_400.0

_EXAMPLES = """examples:
  cell bench --algorithms first_fit,mpack_lite --bins SYN --look-ahead 1-5 --html report.html
  cell bench --boxes my_boxes.csv --bins LDC,PAL --plan plans.jsonl
  cell bench --paper --jobs 4 --json paper.json
"""


def add_bench(verbs: Any) -> None:  # noqa: ANN401 - argparse names no type for it
    """Add the verb ``bench`` to the sub-parsers ``verbs``."""
    parser = verbs.add_parser(
        'bench',
        help='compare the packing algorithms without robot or ROS',
        description='Pack collections of boxes with several algorithms and compare fill and\n'
        'planning time. Exit code 0: done; 2: wrong option or file; 130: interrupted.',
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_questions(parser)
    _add_answers(parser)


def _add_questions(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group('what to compare (lists: commas or spaces)')
    what.add_argument(
        '--algorithms', nargs='+', metavar='NAME',
        help="names, or 'all' (default first_fit o_first_fit mpack_lite)",
    )  # fmt: skip
    what.add_argument(
        '--bins', nargs='+', metavar='KIND',
        help='LDC RC PAL EQ SYN or LxBxH in centimetres (default SYN)',
    )  # fmt: skip
    what.add_argument(
        '--look-ahead', nargs='+', metavar='N', help='1 to 6, or a range such as 1-5 (default 5)'
    )
    what.add_argument(
        '--paper', action='store_true',
        help="the paper's protocol: its algorithms, bins, look-aheads 1-5, 30 SYN and 25 other "
        'collections, all six orientations, three open bins; prints its Table I with ours beside',
    )  # fmt: skip
    boxes = parser.add_argument_group('boxes')
    boxes.add_argument(
        '--boxes', type=Path, metavar='FILE',
        help='box file (CSV or BED-BPP JSON), packed in its order; with --collections boxes are '
        'drawn from it until four bins are filled. Default: SYN is cut from ten bins, other '
        'bins get boxes drawn from the built-in cartons',
    )  # fmt: skip
    boxes.add_argument(
        '--shuffle', type=_whole(0, 2**31 - 1), metavar='SEED',
        help='pack all boxes of the file in an order shuffled with this seed, one order for '
        'each of --collections',
    )  # fmt: skip
    boxes.add_argument(
        '--collections', type=_whole(1, 100_000), metavar='N',
        help='collections per bin (default 30 for SYN, 25 for others, 1 for --boxes)',
    )  # fmt: skip
    boxes.add_argument(
        '--boxes-per-bin', type=_whole(2, 100), default=23, metavar='N',
        help='boxes into which a SYN bin is cut (default 23)',
    )  # fmt: skip
    boxes.add_argument(
        '--seed', type=_whole(0, 2**31 - 1), default=1, metavar='N', help='default 1'
    )
    rules = parser.add_argument_group('rules')
    rules.add_argument(
        '--profile', choices=tuple(PROFILES), default='paper', help='packing rules (default paper)'
    )
    rules.add_argument(
        '--orientations', choices=tuple(ORIENTATION_RULES),
        help="orientation rule instead of the profile's own; with profile paper the default is "
        "any, as in the paper's experiments",
    )  # fmt: skip
    rules.add_argument(
        '--open-bins', type=_whole(1, 3), default=3, metavar='N', help='1 to 3 (default 3)'
    )
    rules.add_argument(
        '--weights', default='1,1,100', metavar='W1,W2,W3',
        help='of x + y, of z + dz and of the bin in eq. (1) of the paper (default 1,1,100); for '
        "single kinds of bins as in '1,1,100 RC:2,1,100'",
    )  # fmt: skip
    rules.add_argument(
        '--budget', type=_seconds, metavar='S',
        help='seconds a decision may take (default 5); a search that time cuts short may end '
        'elsewhere in the next run',
    )  # fmt: skip
    rules.add_argument(
        '--budget-nodes', type=_whole(1, 10**12), metavar='N',
        help='search nodes a decision may take: the same result on every machine and in every '
        'run (no limit of time then, unless --budget is given too)',
    )  # fmt: skip
    _add_options(parser)


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Those of :class:`pack_planner.options.Options`; the defaults are the paper's."""
    how = parser.add_argument_group('options of the algorithms')
    how.add_argument(
        '--cep', action='store_true',
        help="the paper's constraints for efficient packing: each box touches a wall or a box "
        'along x and along y (mpack, mpack_lite)',
    )  # fmt: skip
    how.add_argument(
        '--sort', default='volume', metavar='RULE',
        help='order of virtual packing: volume (default), area, height, arrival',
    )  # fmt: skip
    how.add_argument(
        '--selection', default='least_increase', metavar='RULE',
        help='which box is placed: least_increase (default), large_when_empty, largest, nearest',
    )  # fmt: skip
    how.add_argument(
        '--large-until', type=float, default=0.5, metavar='FILL',
        help='fill rate, 0 to 1, from which large_when_empty takes small boxes (default 0.5)',
    )  # fmt: skip
    how.add_argument(
        '--closing', default='fullest', metavar='RULE',
        help='which bin is closed when nothing fits: fullest (default), oldest, least_useful',
    )  # fmt: skip
    how.add_argument(
        '--max-passed-over', type=_whole(0, 1_000_000), default=0, metavar='N',
        help='a box passed over so often must be next; 0 (default): no limit',
    )  # fmt: skip


def _add_answers(parser: argparse.ArgumentParser) -> None:
    where = parser.add_argument_group('where to run')
    where.add_argument(
        '--jobs', type=_whole(1, 1024), default=1, metavar='N',
        help='processes (default 1, which measures times best)',
    )  # fmt: skip
    where.add_argument(
        '--cluster', default='', metavar='tcp://HOST:PORT',
        help='a running Dask scheduler instead; needs dask and distributed',
    )  # fmt: skip
    where.add_argument(
        '--clock', choices=('wall', 'cpu'), default='wall',
        help='wall (default), or cpu on a busy machine: computing time of the deciding thread',
    )  # fmt: skip
    output = parser.add_argument_group('output')
    output.add_argument(
        '--json', type=Path, metavar='OUT',
        help='records; if the file exists, what is finished in it is kept and not run again',
    )  # fmt: skip
    output.add_argument(
        '--plan', type=Path, metavar='PLANS.jsonl', help='every placement and closed bin, a line'
    )
    output.add_argument('--html', type=Path, metavar='REPORT.html', help='one page with all of it')
    output.add_argument(
        '--figure', type=Path, metavar='FILE', help='the figure alone: .svg, .png or .pdf'
    )
    output.add_argument('--markdown', action='store_true', help='print tables in Markdown instead')


def settings_of(arguments: argparse.Namespace) -> Settings:
    """What holds for all cases; ``ValueError`` says what is wrong."""
    from pack_planner.bench import paper
    from pack_planner.bench.values import Settings
    from pack_planner.weights import parse_weights

    profile = find_profile(arguments.profile)
    orientations = arguments.orientations or profile.orientations
    if not arguments.orientations and profile.name == 'paper':
        orientations = paper.ORIENTATIONS
    profile = replace(profile, orientations=orientations)
    return Settings(
        profile=profile,
        open_bins=arguments.open_bins,
        boxes_per_bin=arguments.boxes_per_bin,
        seed=arguments.seed,
        budget_s=_budget(arguments),
        node_limit=arguments.budget_nodes,
        cpu_clock=arguments.clock == 'cpu',
        weights=parse_weights(arguments.weights),
        options=_options(arguments),
    )


def _budget(arguments: argparse.Namespace) -> float:
    if arguments.budget is not None:
        return float(arguments.budget)
    return DEFAULT_BUDGET_S if arguments.budget_nodes is None else MAX_BUDGET_S


def _options(arguments: argparse.Namespace) -> Options:
    from pack_planner.options import Options

    return Options(
        cep=arguments.cep,
        sort=arguments.sort,
        selection=arguments.selection,
        large_until=arguments.large_until,
        closing=arguments.closing,
        max_passed_over=arguments.max_passed_over,
    )


def cases_of(arguments: argparse.Namespace) -> list[Case]:
    """Bins outermost, then look-aheads, then algorithms; ``ValueError`` says what is wrong."""
    from pack_planner.algorithms import ALGORITHMS, find_algorithm
    from pack_planner.bench import paper
    from pack_planner.bench.values import Case, Source

    known = tuple(ALGORITHMS)
    of_paper = [name for name in paper.NAMES if name in known]
    algorithms = _items(
        arguments.algorithms,
        '--algorithms',
        of_paper if arguments.paper else ['first_fit', 'o_first_fit', 'mpack_lite'],
    )
    if algorithms == ['all']:
        algorithms = list(known)
    for name in algorithms:
        find_algorithm(name)
    bins = [parse_bin(text) for text in _items(
        arguments.bins, '--bins', list(paper.BINS) if arguments.paper else ['SYN'])]  # fmt: skip
    looks = _look_aheads(
        _items(arguments.look_ahead, '--look-ahead', ['1-5'] if arguments.paper else ['5'])
    )
    if arguments.shuffle is not None and arguments.boxes is None:
        msg = '--shuffle needs --boxes; cut and drawn collections are random anyway, see --seed'
        raise ValueError(msg)
    cases: list[Case] = []
    file_source: Source | None = None
    for spec in bins:
        if arguments.boxes is None and spec.name == 'SYN':
            source = Source('SYN, cut from ten bins')
        else:
            source = file_source or _source_of_file(arguments)
            file_source = source
        standard = 1 if source.in_order else paper.collections_of(spec.name)
        count = arguments.collections or standard
        for look_ahead in looks:
            cases += [Case(name, spec, look_ahead, count, source) for name in algorithms]
    _notes(cases)
    return cases


def _source_of_file(arguments: argparse.Namespace) -> Source:
    """Boxes of the given file, or of the built-in one."""
    from conveyor_sim.streams import load_boxes
    from pack_planner.bench.values import Source

    boxes, rejected = load_boxes('' if arguments.boxes is None else arguments.boxes)
    if not boxes:
        msg = f'box file {arguments.boxes} holds no usable box; {rejected[0].text}'
        raise ValueError(msg)
    in_order = arguments.boxes is not None and (
        arguments.collections is None or arguments.shuffle is not None
    )
    name = 'built-in cartons' if arguments.boxes is None else arguments.boxes.name
    if not in_order:
        name += ', drawn with replacement'
    elif arguments.shuffle is not None:
        name += f', shuffled with seed {arguments.shuffle}'
    else:
        name += ', in its order'
    return Source(
        name=name,
        boxes=tuple(boxes),
        in_order=in_order,
        shuffle=arguments.shuffle,
        rejected=tuple((one.box_id, one.text) for one in rejected),
        digest=hashlib.sha256(repr((boxes, rejected)).encode()).hexdigest()[:12],
    )


def _notes(cases: Sequence[Case]) -> None:
    """Say on stderr what a user may not expect."""
    for source in {case.source for case in cases}:
        for _, text in source.rejected:
            print(f'cell bench: left out: {text}', file=sys.stderr)
    streams = {(case.look_ahead, len(case.source.boxes)) for case in cases if case.source.in_order}
    for look_ahead, count in sorted(one for one in streams if one[0] > one[1]):
        print(
            f'cell bench: note: look-ahead {look_ahead} sees all {count} boxes of the stream',
            file=sys.stderr,
        )


def _items(given: Sequence[str] | None, option: str, default: list[str]) -> list[str]:
    """A list written with spaces, commas or both, each item once."""
    if given is None:
        return default
    found = [item for text in given for item in text.split(',') if item]
    if not found:
        msg = f'{option} names nothing'
        raise ValueError(msg)
    return list(dict.fromkeys(found))


def _look_aheads(items: Sequence[str]) -> list[int]:
    found: list[int] = []
    for item in items:
        low, dash, high = item.partition('-')
        if not low.isdecimal() or (dash and not high.isdecimal()):
            msg = f'look-ahead {item!r} is neither a whole number nor a range such as 1-5'
            raise ValueError(msg)
        numbers = range(int(low), int(high or low) + 1)
        if not numbers or not 1 <= int(low) <= int(high or low) <= MAX_LOOK_AHEAD:
            msg = f'look-ahead {item} is out of range: it must be 1 to {MAX_LOOK_AHEAD}'
            raise ValueError(msg)
        found += numbers
    return list(dict.fromkeys(found))


def _whole(low: int, high: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            msg = f'{text!r} is not a whole number'
            raise argparse.ArgumentTypeError(msg) from None
        if not low <= value <= high:
            msg = f'{text} is out of range: it must be {low} to {high}'
            raise argparse.ArgumentTypeError(msg)
        return value

    return parse


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        msg = f'{text!r} is not a number of seconds'
        raise argparse.ArgumentTypeError(msg) from None
    if not math.isfinite(value) or not 0 < value <= MAX_BUDGET_S:
        msg = f'{text} is out of range: it must be above 0 and at most 86400 s'
        raise argparse.ArgumentTypeError(msg)
    return value
