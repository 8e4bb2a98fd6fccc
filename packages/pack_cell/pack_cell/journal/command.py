"""``cell journal``: show, check and export the books of a run."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from pack_cell.files import error_text
from pack_cell.journal.export import export_books
from pack_cell.journal.run_books import BooksError, read_run_books, state_folder
from pack_cell.journal.show import book_lines, box_lines
from pack_cell.journal.verify import book_errors

EXIT_OK, EXIT_WRONG, EXIT_USAGE = 0, 1, 2


def add_journal(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell journal`` to the command line."""
    parser = verbs.add_parser(
        'journal',
        help='show, check or export what a run has written down of its boxes and bins',
        description='The books of a run: each bin and each step of each box, as the arm and the '
        'belt wrote them down before they acted. Exit code 0: as it should be; 1: verify has found '
        'something; 2: there are no books, or they cannot be read.',
    )
    parser.add_argument('what', choices=('show', 'verify', 'export'), help='what to do')
    parser.add_argument('folder', type=Path, metavar='DIR', help='folder of a run')
    parser.add_argument('--box', metavar='ID', help='show: all about this box')
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help='export: where to; default DIR/journal'
    )


def run_journal(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    try:
        if options.what == 'verify':
            return _verify(options.folder)
        if options.what == 'export':
            folder = options.out or options.folder / 'journal'
            for path in export_books(read_run_books(options.folder), folder):
                print(path)
            return EXIT_OK
        return _show(options.folder, options.box)
    except BooksError as error:
        print(f'cell journal: {error}', file=sys.stderr)
    except OSError as error:
        print(f'cell journal: {error_text(error)}', file=sys.stderr)
    return EXIT_USAGE


def _verify(folder: Path) -> int:
    state = state_folder(folder)
    wrong = book_errors(state)
    for line in wrong:
        print(line)
    if wrong:
        return EXIT_WRONG
    print(f'the books in {state} are as they were written, and agree')
    return EXIT_OK


def _show(folder: Path, box_id: str | None) -> int:
    books = read_run_books(folder)
    lines = list(book_lines(books) if box_id is None else box_lines(books, box_id))
    if not lines and box_id is not None:
        msg = f'nothing is written about box {box_id!r}'
        raise BooksError(msg)
    print(*lines, sep='\n')
    return EXIT_OK
