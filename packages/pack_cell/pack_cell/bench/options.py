"""Options of ``cell bench``: names, defaults, ranges and texts."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from conveyor_sim.streams import SYNTAX
from pack_cell.options.parsers import NumberRange, whole
from pack_cell.options.shared import add_jobs, add_reading, add_rules, add_scan_sigma, add_seed
from pack_msgs_py.values import BIN_KINDS

MAX_BUDGET_S = 86_400.0
MAX_DESTINATIONS = 100

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
        help="names, or 'all' (default first_fit o_first_fit mpack_lite); FILE.py:FUNCTION for one "
        'of your own, see docs/algorithms.md',
    )  # fmt: skip
    what.add_argument(
        '--bins', nargs='+', metavar='KIND',
        help=f'{BIN_KINDS} (default SYN)',
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
        '--boxes', metavar='BOXES',
        help=f'{SYNTAX}; packed in order, with --collections drawn until four bins are filled. '
        'Default: SYN is cut from ten bins, other bins get boxes drawn from the built-in cartons',
    )  # fmt: skip
    add_reading(boxes)
    boxes.add_argument(
        '--shuffle', type=whole(0, 2**31 - 1), metavar='SEED',
        help='pack all boxes of the file in an order shuffled with this seed, one order for '
        'each of --collections',
    )  # fmt: skip
    boxes.add_argument(
        '--collections', type=whole(1, 100_000), metavar='N',
        help='collections per bin (default 30 for SYN, 25 for others, 1 for --boxes)',
    )  # fmt: skip
    boxes.add_argument(
        '--boxes-per-bin', type=whole(2, 100), default=23, metavar='N',
        help='boxes into which a SYN bin is cut (default 23)',
    )  # fmt: skip
    add_scan_sigma(boxes, 0.0)
    add_seed(boxes)
    rules = parser.add_argument_group('rules')
    usual = "; with profile paper the default is any, as in the paper's experiments"
    add_rules(rules, 'paper', usual)
    rules.add_argument(
        '--open-bins', type=whole(1, 3), default=3, metavar='N', help='1 to 3 (default 3)'
    )
    rules.add_argument(
        '--destinations', type=whole(1, MAX_DESTINATIONS), metavar='N',
        help='give each box one of N destinations and each bin one that it takes boxes for '
        '(bin k the destination k mod N; with more destinations than bins, closing a bin makes '
        'room for another one). Default: any box goes into any bin',
    )  # fmt: skip
    rules.add_argument(
        '--weights', default='1,1,100', metavar='W1,W2,W3',
        help='of x + y, of z + dz and of the bin in eq. (1) of the paper (default 1,1,100); for '
        "single kinds of bins as in '1,1,100 RC:2,1,100'",
    )  # fmt: skip
    rules.add_argument(
        '--budget', type=NumberRange(0, MAX_BUDGET_S, 's', above=True), metavar='S',
        help='seconds a decision may take (default 5); a search that time cuts short may end '
        'elsewhere in the next run',
    )  # fmt: skip
    rules.add_argument(
        '--budget-nodes', type=whole(1, 10**12), metavar='N',
        help='search nodes a decision may take: the same result on every machine and in every '
        'run (no limit of time then, unless --budget is given too)',
    )  # fmt: skip
    rules.add_argument(
        '--tuned', metavar='FILE',
        help='weights that cell tune has written, for the algorithm that they were tuned for '
        '(default: those that are shipped)',
    )  # fmt: skip
    _add_options(parser)


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Those of :class:`pack_planner.decision.options.Options`; the defaults are the paper's."""
    how = parser.add_argument_group('options of the algorithms')
    how.add_argument(
        '--backend', nargs='+', metavar='NAME',
        help='who minimises for mpack and mpack_lite: search (our own, default), cp_sat or milp '
        '(solvers of OR-Tools); several are compared',
    )  # fmt: skip
    how.add_argument(
        '--cep', nargs='*', choices=('on', 'off', 'paper'), metavar='CHOICE',
        help="the paper's constraints for efficient packing, by which each box touches a wall or a "
        'box along x and along y (mpack, mpack_lite): on, off (default), paper (as there and with '
        '--paper: on for mpack, off for mpack_lite); several are compared; alone it means on',
    )  # fmt: skip
    how.add_argument(
        '--sort', default='volume', metavar='RULE',
        help='order of virtual packing: volume (default), area, height, arrival',
    )  # fmt: skip
    how.add_argument(
        '--selection', default='auto', metavar='RULE',
        help='which box is placed: least_increase, least_growth, large_when_empty, largest, '
        'nearest, or auto (default: least_growth for mpack, else least_increase)',
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
        '--max-passed-over', type=whole(0, 1_000_000), default=0, metavar='N',
        help='a box passed over so often must be next; 0 (default): no limit',
    )  # fmt: skip


def _add_answers(parser: argparse.ArgumentParser) -> None:
    where = parser.add_argument_group('where to run')
    add_jobs(where, '; one measures times best', cluster=True)
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
