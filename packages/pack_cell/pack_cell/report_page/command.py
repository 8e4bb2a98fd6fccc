"""``cell report``: the page and the CSV of one run, or of several beside each other."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

EXIT_OK, EXIT_USAGE = 0, 2

#: Name of the page in the folder of a run.
PAGE_FILE = 'report.html'


def add_report(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell report`` to the command line."""
    parser = verbs.add_parser(
        'report',
        help='write the page of a run, or compare several',
        description='Of one run: figures, charts, each bin in 3D and a work order for it, as one '
        'page that needs no internet and prints on A4. Of several: what differed, and what it '
        'changed. A CSV with a line per box lies beside it.',
    )
    parser.add_argument('runs', nargs='+', type=Path, metavar='RUN', help='folder of a run')
    parser.add_argument(
        '--out',
        type=Path,
        metavar='FILE',
        help='the page (default: report.html in the folder of the run; of several runs, '
        'comparison.html in the working directory)',
    )


def run_report(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    from pack_cell.report_page.run_folder import ReportError

    several = len(options.runs) > 1
    out = options.out or (Path('comparison.html') if several else options.runs[0] / PAGE_FILE)
    try:
        if out.suffix != '.html':
            msg = f'--out {out} must end in .html'
            raise ReportError(msg)
        for written in write_report(options.runs, out):
            print(f'wrote {written}')
    except (ReportError, OSError) as error:
        print(f'cell report: {error}', file=sys.stderr)
        return EXIT_USAGE
    return EXIT_OK


def write_report(folders: list[Path], page: Path) -> tuple[Path, Path]:
    """Write the page of the runs in ``folders`` and, beside it, their boxes as CSV.

    Raises
    ------
    ReportError
        A folder holds no finished run.
    OSError
        A file cannot be written.
    """
    # Templates and statistics take a moment to load.
    from pack_cell.report_page.csv_file import write_csv
    from pack_cell.report_page.page import comparison_page, run_page
    from pack_cell.report_page.run_folder import read_run

    runs = [read_run(folder) for folder in folders]
    page.parent.mkdir(parents=True, exist_ok=True)
    text = run_page(runs[0]) if len(runs) == 1 else comparison_page(runs)
    page.write_text(text, encoding='utf-8')
    table = page.with_suffix('.csv')
    write_csv(table, runs)
    return page, table


def report_trouble(folder: Path) -> str:
    """Write the report of a run that has just ended; say why it could not be, empty if it was.

    Whatever is wrong with it, the run itself is over and its figures are written.
    """
    try:
        write_report([folder], folder / PAGE_FILE)
    except Exception as error:
        return f'{PAGE_FILE} was not written: {type(error).__name__}: {error}'
    return ''
