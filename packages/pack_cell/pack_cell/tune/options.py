"""Options of ``cell tune``: names, defaults, ranges and texts."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from conveyor_sim.streams import SYNTAX
from pack_cell.options.parsers import NumberRange, bin_kind, whole
from pack_cell.options.shared import add_jobs, add_reading, add_rules, add_scan_sigma, add_seed
from pack_msgs_py.values import BIN_KINDS

_EXAMPLES = """examples:
  cell tune --bin RC --minutes 60 --jobs 4
  cell tune --boxes draw:my_boxes.csv my_orders.csv --bin 100x60x90 --out mine.json
  cell run --algorithm foresight --tuned mine.json
"""


def add_tune(verbs: Any) -> None:  # noqa: ANN401 - argparse names no type for it
    """Add the verb ``tune`` to the sub-parsers ``verbs``."""
    parser = verbs.add_parser(
        'tune',
        help='find weights of the packing algorithm for your boxes and bins',
        description='Search the weights with which an algorithm fills most on your boxes, check\n'
        'them on streams that the search has not seen, and write them where they win.\n'
        'Ctrl-C loses nothing: the same command goes on where it was. Exit code 0: written;\n'
        '1: nothing better was found; 2: wrong option or file; 130: interrupted.',
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_argument_group('what to tune for')
    what.add_argument(
        '--boxes', nargs='+', metavar='BOXES', default=['draw:cartons'],
        help=f'{SYNTAX}; several take turns. A list is taken in its order from places of its first '
        'two thirds, and checked on the last third (default draw:cartons)',
    )  # fmt: skip
    add_reading(what)
    what.add_argument(
        '--bin', dest='bin_spec', type=bin_kind, required=True, metavar='KIND', help=BIN_KINDS
    )
    add_rules(what, 'dense')
    what.add_argument('--algorithm', default='foresight', metavar='NAME', help='default foresight')
    what.add_argument('--look-ahead', type=whole(1, 6), default=5, metavar='N', help='default 5')
    what.add_argument('--open-bins', type=whole(1, 3), default=2, metavar='N', help='default 2')
    add_scan_sigma(what, 2.0)
    what.add_argument(
        '--start', metavar='FILE', help='weights to begin with (default: those that are shipped)'
    )
    how = parser.add_argument_group('how long, and how thoroughly')
    how.add_argument(
        '--minutes', type=NumberRange(0, 100_000, 'min', above=True), metavar='M',
        help='time that this run may search; the check comes after it (default 30, without '
        '--evaluations)',
    )  # fmt: skip
    how.add_argument(
        '--evaluations', type=whole(1, 10**7), metavar='N',
        help='candidates to try, those of earlier runs of the same tuning included',
    )  # fmt: skip
    how.add_argument(
        '--streams', type=whole(1, 1000), default=2, metavar='N',
        help='streams that each candidate packs (default 2)',
    )  # fmt: skip
    how.add_argument(
        '--check-streams', type=whole(2, 1000), default=12, metavar='N',
        help='other streams on which the result is checked (default 12)',
    )  # fmt: skip
    how.add_argument(
        '--stream-bins', type=NumberRange(1, 1000, 'bins'), default=6.0, metavar='N',
        help='bins that the boxes of a stream would fill (default 6)',
    )  # fmt: skip
    how.add_argument(
        '--only', default='', metavar='NAMES',
        help='weights to search, with commas between them; the fewer, the sooner (default all)',
    )  # fmt: skip
    how.add_argument(
        '--step', type=NumberRange(0, 0.5, above=True), default=0.08, metavar='X',
        help='how far the first candidates lie from the start, as a share of the range of each '
        'weight (default 0.08)',
    )  # fmt: skip
    add_seed(how)
    add_jobs(parser.add_argument_group('where to run'), cluster=True)
    output = parser.add_argument_group('output')
    output.add_argument(
        '--out', type=Path, default=Path('tuned.json'), metavar='FILE',
        help='parameter file; what it has for other bins, profiles and algorithms stays. Trials '
        'are kept beside it, in FILE.trials (default tuned.json)',
    )  # fmt: skip
    output.add_argument(
        '--json', type=Path, metavar='OUT', help='what was done and found, for programs'
    )
    output.add_argument('--quiet', action='store_true', help='no progress')
