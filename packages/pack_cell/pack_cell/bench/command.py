"""``cell bench``: compare the packing algorithms without robot or ROS."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pack_cell.bench.cases import cases_of, check_tuned, settings_of
from pack_cell.bench.options import add_bench
from pack_msgs_py.signals import interrupts_kept

if TYPE_CHECKING:
    from rich.progress import Progress

    from pack_cell.bench.values import Case, JsonObject

EXIT_FAULT = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130

__all__ = ['add_bench', 'run_bench']


def run_bench(arguments: argparse.Namespace, given: Sequence[str] = ()) -> int:
    """Run the benchmark; return the exit code. ``given`` is the command line, for the report."""
    from pack_cell.bench.cluster import ClusterLost
    from pack_planner.algorithms import AlgorithmError
    from pack_planner.engine import EngineMismatch

    kept = '; what was finished is kept in the --json file' if arguments.json else ''
    try:
        return _run(arguments, shlex.join(['./cell', *given]))
    except (ValueError, OSError) as error:
        print(f'cell bench: {error}', file=sys.stderr)
        return EXIT_USAGE
    except (EngineMismatch, AlgorithmError) as error:
        print(f'cell bench: {error}', file=sys.stderr)
        return EXIT_FAULT
    except ClusterLost as error:
        print(f'cell bench: {error}{kept}, run the same command again', file=sys.stderr)
        return EXIT_FAULT
    except KeyboardInterrupt:
        print(f'cell bench: interrupted{kept}', file=sys.stderr)
        return EXIT_INTERRUPTED


def _run(arguments: argparse.Namespace, command: str) -> int:
    from pack_cell.bench.results import ResultFile
    from pack_cell.bench.runner import Workers, run

    _check_outputs(arguments)
    settings, cases = settings_of(arguments), cases_of(arguments)
    check_tuned(settings, cases)
    results = ResultFile(arguments.json, arguments.plan)
    with _progress_bar() as bar, interrupts_kept() as look:
        watch = _Watch(bar, cases, look)
        workers = Workers(arguments.jobs, arguments.cluster, note=_note)
        try:
            records = run(cases, settings, workers, results, watch)
        finally:
            results.close()
    _show(records, arguments)
    _write_reports(records, arguments, command)
    return 0


def _note(text: str) -> None:
    print(f'cell bench: {text}', file=sys.stderr)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse output files that cannot be written, before hours are spent."""
    outputs = (arguments.json, arguments.plan, arguments.html, arguments.figure)
    files: list[Path] = [path for path in outputs if path is not None]
    for path in files:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f'{path} cannot be written: {error.strerror}'
            raise ValueError(msg) from None
        if path.is_dir() or not os.access(path.parent, os.W_OK):
            msg = f'{path} cannot be written: name a file in a folder of yours'
            raise ValueError(msg)
    if len({path.absolute() for path in files}) < len(files):
        msg = 'two outputs have the same file name'
        raise ValueError(msg)
    if arguments.figure is not None and arguments.figure.suffix not in ('.svg', '.png', '.pdf'):
        msg = f'--figure {arguments.figure} must end in .svg, .png or .pdf'
        raise ValueError(msg)


def _progress_bar() -> Progress:
    """A bar on stderr, shown only to someone who looks at a terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    return Progress(
        TextColumn('{task.description}'),
        BarColumn(bar_width=32),
        MofNCompleteColumn(),
        TextColumn('collections'),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


class _Watch:
    """Moves the bar as collections are done, and looks whether it is to end."""

    def __init__(self, bar: Progress, cases: Sequence[Case], look: Callable[[], None]) -> None:
        self._bar, self._look = bar, look
        self._done: dict[Case, int] = {}
        self._task = bar.add_task('packing', total=sum(case.collections for case in cases))

    def __call__(self, case: Case, done: int, total: int) -> None:
        """``done`` of ``total`` collections of ``case`` are packed."""
        self._look()
        self._done[case] = done
        text = f'{case.algorithm} {case.bin_spec.name} look-ahead {case.look_ahead}'
        self._bar.update(self._task, completed=sum(self._done.values()), description=text)


def _show(records: Sequence[JsonObject], arguments: argparse.Namespace) -> None:
    """Print the tables."""
    from pack_cell.bench import report

    for line in report.sources(records):
        print(line)
    print()
    _print_table(report.HEADINGS, [report.row(record) for record in records], arguments.markdown)
    if arguments.paper:
        print()
        print(report.paper_note(records))
        print()
        _print_table(*report.table1(records), arguments.markdown)
    for record in records:
        for entry in record['unplaced'][:3]:
            print(
                f'unplaced: {record["algorithm"]}, {record["bin"]}, '
                f'look-ahead {record["look_ahead"]}, collection {entry["collection"]}: '
                f'box {entry["id"]!r} {entry["reason"]}'
            )
        if len(record['unplaced']) > 3:
            print(f'          and {len(record["unplaced"]) - 3} more, see --json')


def _print_table(headings: Sequence[str], rows: Sequence[Sequence[str]], in_markdown: bool) -> None:
    from pack_cell.bench.report import markdown

    if in_markdown:
        print(markdown(headings, rows))
        return
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    for line in (headings, ['-' * width for width in widths], *rows):
        cells = (cell.rjust(width) for cell, width in zip(line, widths, strict=True))
        print('  '.join(cells).rstrip())


def _write_reports(
    records: Sequence[JsonObject], arguments: argparse.Namespace, command: str
) -> None:
    if arguments.html is not None:
        from pack_cell.bench.page import page

        arguments.html.parent.mkdir(parents=True, exist_ok=True)
        arguments.html.write_text(page(records, command), encoding='utf-8')
    if arguments.figure is not None:
        from pack_cell.bench.figure import save

        save(records, arguments.figure)
    for path in (arguments.json, arguments.plan, arguments.html, arguments.figure):
        if path is not None:
            print(f'wrote {path}', file=sys.stderr)
