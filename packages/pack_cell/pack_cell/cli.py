"""The command line: ``cell demo``, ``cell run``, and the verbs beside them."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from pack_cell.bench.options import add_bench
from pack_cell.boxes.command import add_boxes, run_boxes
from pack_cell.chaos.command import add_chaos, run_chaos
from pack_cell.journal.command import add_journal, run_journal
from pack_cell.layout.command import add_layout, run_layout
from pack_cell.operate.options import OPERATING, add_operate
from pack_cell.options.declaration import add_options
from pack_cell.options.parsers import OneLineParser
from pack_cell.options.run_options import RunOptions, run_options
from pack_cell.render.command import add_render, run_render
from pack_cell.replay.command import add_replay, run_replay
from pack_cell.report_page.command import add_report, run_report
from pack_cell.running.kept_run import kept_run
from pack_cell.running.node_parameters import check_cell, tuned_note
from pack_cell.running.run import resume, run
from pack_cell.running.run_watch import EXIT_USAGE
from pack_cell.running.viewing import add_view, run_view
from pack_cell.tune.options import add_tune
from pack_cell.what_if.options import add_compare

#: Forty boxes of the project's own list; all else is as when nothing is said.
DEMO = {'count': 40}
DEMO_OPTIONS = ('algorithm', 'profile', 'speed', 'out', 'view', 'view_port')


def build_parser(*, with_script: bool = False) -> argparse.ArgumentParser:
    """The whole command line as a parser; ``with_script`` adds the verbs of the ``cell`` script."""
    parser = OneLineParser(prog='cell', description='The online bin-packing robot cell.')
    verbs = parser.add_subparsers(dest='verb', metavar='VERB', required=True)
    demo = verbs.add_parser(
        'demo',
        help='pack 40 real carton sizes into LDC bins with the arm, and report',
        description='Forty real carton sizes ride the belt; our own algorithm with a look-ahead '
        'of five decides, the arm packs them into LDC bins (120x80x80 cm). Prints a '
        'line per box and a summary; writes runs/<time>/.',
    )
    add_options(demo, RunOptions, only=DEMO_OPTIONS)
    runner = verbs.add_parser(
        'run',
        help='run the cell on boxes and settings of your own',
        description='Run the cell: conveyor, planner and arm as ROS 2 nodes. Results go to '
        'report.html, summary.json and placements.jsonl in the output folder. Exit code 0: every '
        'box in exactly one place and no rule broken, or stopped by Ctrl-C; 1: not so; 2: wrong '
        'option or file; 3: a node died; 4: the run stalled.',
    )
    add_options(runner, RunOptions)
    add_view(verbs)
    add_report(verbs)
    add_replay(verbs)
    add_render(verbs)
    add_compare(verbs)
    add_bench(verbs)
    add_tune(verbs)
    add_layout(verbs)
    add_boxes(verbs)
    add_chaos(verbs)
    add_journal(verbs)
    add_operate(verbs)
    if with_script:
        from pack_cell.operate.completion import add_script_verbs

        add_script_verbs(verbs)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = build_parser()
    parsed = parser.parse_args(given)
    if parsed.verb == 'bench':
        from pack_cell.bench.command import run_bench

        return run_bench(parsed, given)
    if parsed.verb == 'tune':
        from pack_cell.tune.command import run_tune

        return run_tune(parsed, given)
    if parsed.verb == 'compare':
        from pack_cell.what_if.command import run_compare

        return run_compare(parsed, given)
    if parsed.verb == 'view':
        return run_view(parsed)
    if parsed.verb == 'report':
        return run_report(parsed)
    if parsed.verb == 'render':
        return run_render(parsed)
    if parsed.verb == 'replay':
        return run_replay(parsed)
    if parsed.verb == 'layout':
        return run_layout(parsed)
    if parsed.verb == 'chaos':
        return run_chaos(parsed)
    if parsed.verb == 'journal':
        return run_journal(parsed)
    if parsed.verb == 'boxes':
        return run_boxes(parsed)
    if parsed.verb in OPERATING:
        from pack_cell.operate.command import run_operate

        return run_operate(parsed)
    if parsed.verb == 'completion':
        from pack_cell.operate.completion import completion_script

        print(completion_script(build_parser(with_script=True), parsed.shell))
        return 0
    basis = DEMO if parsed.verb == 'demo' else {}
    try:
        if getattr(parsed, 'resume', None) is not None:
            kept = kept_run(parsed.resume, vars(parsed))
            check_cell(kept.used)
            return resume(kept)
        options = run_options(basis | vars(parsed))
        check_cell(options)
        if tuned_note(options):
            print(f'cell {given[0]}: note: {tuned_note(options)}', file=sys.stderr)
        command = [os.environ.get('PACK_CELL_COMMAND', 'cell'), *given]
        return run(options, command)
    except (ValueError, OSError) as error:
        print(f'cell {given[0]}: {error}', file=sys.stderr)
        return EXIT_USAGE
