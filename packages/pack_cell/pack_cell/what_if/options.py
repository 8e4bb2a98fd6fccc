"""Options of ``cell compare``, and what they ask for."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from conveyor_sim.streams import SYNTAX
from pack_cell.options.declaration import DEFAULT_PROFILE
from pack_cell.options.parsers import BadValue, NumberRange, whole
from pack_cell.options.shared import add_jobs, add_profile, add_reading, add_seed
from pack_cell.options.usual import GRASP_FACES, USUAL_ALGORITHM
from pack_msgs_py.values import BIN_KINDS, BinSpec, parse_bin

#: What `cell run` knows of each, and no more.
_OPEN_BINS, _LOOK_AHEAD = whole(1, 3), whole(1, 6)
NO_ARM = 'none'

_EXAMPLES = """examples:
  cell compare --boxes my_boxes.csv --bins RC,LDC --look-ahead 3-6 --open-bins 2,3
  cell compare --boxes my_boxes.csv --bins RC --look-ahead 4-6 --arm timed --out runs/what_if.html
"""


@dataclass(frozen=True)
class Combination:
    """One combination: kind of bin, algorithm, how many bins stand open, how far one sees."""

    spec: BinSpec
    algorithm: str
    open_bins: int
    look_ahead: int


def add_compare(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell compare`` to the command line."""
    parser = verbs.add_parser(
        'compare',
        help='which bins, algorithm and look-ahead for these boxes: one page, one recommendation',
        description='Pack the boxes with every combination and recommend one, in words, on one\n'
        'page with a table, charts and a CSV. Exit code 0: done; 1: a run with the arm failed;\n'
        '2: wrong option or file; 130: interrupted.',
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_argument_group('what to compare (lists with commas, ranges such as 3-6)')
    what.add_argument(
        '--bins', type=_bins, default=_bins('LDC'), metavar='KINDS',
        help=f'{BIN_KINDS} (default LDC)',
    )  # fmt: skip
    what.add_argument(
        '--algorithms', type=_names, default=(), metavar='NAMES',
        help='as in cell run (default: that of cell run with the profile)',
    )  # fmt: skip
    what.add_argument(
        '--open-bins', type=lambda text: _numbers(text, _OPEN_BINS), default=(2,), metavar='N',
        help=f'{_OPEN_BINS} (default 2)',
    )  # fmt: skip
    what.add_argument(
        '--look-ahead', type=lambda text: _numbers(text, _LOOK_AHEAD), default=(5,), metavar='N',
        help=f'{_LOOK_AHEAD} (default 5)',
    )  # fmt: skip
    how = parser.add_argument_group('how')
    how.add_argument('--boxes', default='', metavar='BOXES', help=f'{SYNTAX}; default: cartons')
    add_reading(how, orders=True)
    how.add_argument(
        '--orders', type=whole(1, 1000), default=3, metavar='N',
        help='shuffled orders of the boxes that each combination packs (default 3)',
    )  # fmt: skip
    add_seed(how, 'of these orders', low=1)
    add_profile(how, DEFAULT_PROFILE)
    how.add_argument(
        '--grasp-faces', choices=tuple(GRASP_FACES), default='',
        help='faces by which the arm takes boxes (default: as in cell run with the profile)',
    )  # fmt: skip
    how.add_argument(
        '--arm', choices=(NO_ARM, 'timed', 'physics'), default=NO_ARM,
        help='none: the packing alone (default); timed or physics: each as a cell run, which also '
        'tells boxes an hour and what the arm cannot do',
    )  # fmt: skip
    how.add_argument(
        '--most-by-hand', type=NumberRange(0, 100), default=2.0, metavar='PERCENT',
        help='boxes that may be left for people without a setting being worse (default 2)',
    )  # fmt: skip
    add_jobs(how, ', without an arm')
    how.add_argument(
        '--out', type=_page, default=Path('compare.html'), metavar='FILE',
        help='the page; a CSV lies beside it (default compare.html)',
    )  # fmt: skip


def combinations_of(arguments: argparse.Namespace) -> list[Combination]:
    """Every combination, bins outermost; ``ValueError`` says which algorithm is not known."""
    from pack_msgs_py.plug_ins import absolute_place
    from pack_planner.algorithms import find_algorithm

    names = arguments.algorithms or (USUAL_ALGORITHM[arguments.profile],)
    algorithms = [absolute_place(name) for name in names]
    for name in algorithms:
        find_algorithm(name)
    return [
        Combination(*combination)
        for combination in product(
            arguments.bins, algorithms, arguments.open_bins, arguments.look_ahead
        )
    ]


def _items(text: str) -> list[str]:
    items = list(dict.fromkeys(item.strip() for item in text.split(',') if item.strip()))
    if not items:
        msg = f'{text!r} names nothing'
        raise BadValue(msg)
    return items


def _names(text: str) -> tuple[str, ...]:
    return tuple(_items(text))


def _bins(text: str) -> tuple[BinSpec, ...]:
    try:
        return tuple(parse_bin(item) for item in _items(text))
    except ValueError as error:
        raise BadValue(str(error)) from None


def _numbers(text: str, allowed: NumberRange) -> tuple[int, ...]:
    """The numbers of ``'2,4-6'``, each once."""
    numbers: list[int] = []
    for item in _items(text):
        low, dash, high = item.partition('-')
        ends: Sequence[float] = (allowed(low), allowed(high if dash else low))
        numbers += range(int(ends[0]), int(ends[1]) + 1)
    if not numbers:
        msg = f'{text!r} names nothing: a range goes upwards, such as 3-6'
        raise BadValue(msg)
    return tuple(dict.fromkeys(numbers))


def _page(text: str) -> Path:
    path = Path(text)
    if path.suffix != '.html':
        msg = f'{text!r} must end in .html'
        raise BadValue(msg)
    return path
