"""``cell replay``: a recorded run in the browser, as one file, or decided again."""

from __future__ import annotations

import argparse
import sys
import webbrowser
from collections.abc import Sequence
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from pack_cell.options.parsers import whole
from pack_msgs_py.wording import how_many

EXIT_OK, EXIT_DIFFERS, EXIT_USAGE = 0, 1, 2


def add_replay(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell replay`` to the command line."""
    parser = verbs.add_parser(
        'replay',
        help='see a recorded run again in 3D, or decide it again',
        description='Shows a run of which run.mcap was recorded: the cell in 3D at any moment, at '
        'any speed, decision by decision. Serves the page on this machine until Ctrl-C; with '
        '--html writes it as one file that opens from disk.',
    )
    parser.add_argument('run', type=Path, metavar='RUN', help='folder of a run, or an MCAP file')
    what = parser.add_mutually_exclusive_group()
    what.add_argument('--html', type=Path, metavar='FILE', help='write the page and end')
    what.add_argument(
        '--verify',
        action='store_true',
        help='make every decision again from what it rested on, and tell where it differs: exit '
        'code 1 when one does whose search was not limited by time',
    )
    parser.add_argument(
        '--port',
        type=whole(0, 65535),
        default=0,
        metavar='N',
        help='port of the page on this machine (default: a free one)',
    )
    parser.add_argument('--no-browser', action='store_true', help='open no browser')


def run_replay(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    # ROS takes half a second to load.
    from pack_cell.recording.reading import NoRecording, find_recordings
    from pack_cell.replay.page import replay_page
    from pack_cell.ros.recorded_values import recorded_values

    try:
        if options.html is not None and options.html.suffix != '.html':
            msg = f'--html {options.html} must end in .html'
            raise ValueError(msg)
        heard = recorded_values(find_recordings(options.run))
        if options.verify:
            return _verify([each.value for each in heard])
        page = replay_page(options.run.resolve().name, heard)
        if options.html is None:
            return _serve(page, options.port, open_browser=not options.no_browser)
        options.html.parent.mkdir(parents=True, exist_ok=True)
        options.html.write_text(page, encoding='utf-8')
        print(f'wrote {options.html} ({len(page.encode()) / 1e6:.1f} MB)')
    except (NoRecording, ValueError, OSError) as error:
        print(f'cell replay: {error}', file=sys.stderr)
        return EXIT_USAGE
    return EXIT_OK


def _verify(values: Sequence[object]) -> int:
    from pack_cell.replay.verify import decide_again
    from pack_msgs_py.cell_values import Decision
    from pack_planner.coordination.planning_record import PlanningRecord

    records = [value for value in values if isinstance(value, PlanningRecord)]
    if not records:
        made = sum(isinstance(value, Decision) for value in values)
        msg = f'nothing tells what the {made} decisions rested on: was planning_record recorded?'
        raise ValueError(msg)
    differing, limited = 0, 0
    for again in decide_again(records):
        if not again.same:
            print(again.text)
            differing += not again.time_limited
            limited += again.time_limited
    parts = [f'{how_many(len(records), "decision")} made again', f'{differing} not the same']
    if limited:
        parts.append(f'{limited} more, whose search was limited by time')
    print(', '.join(parts))
    return EXIT_DIFFERS if differing else EXIT_OK


class PageHandler(BaseHTTPRequestHandler):
    """Answers every request with one page."""

    def __init__(self, page: bytes, *arguments: Any, **named: Any) -> None:  # noqa: ANN401
        self._page = page
        super().__init__(*arguments, **named)

    def do_GET(self) -> None:
        """Send the page."""
        self.send_response(200)
        self.send_header('Content-Type', 'text/html; charset=utf-8')
        self.send_header('Content-Length', str(len(self._page)))
        self.end_headers()
        self.wfile.write(self._page)

    def log_message(self, format: str, *values: object) -> None:  # noqa: A002 - of http.server
        """Say nothing."""


def _serve(page: str, port: int, *, open_browser: bool) -> int:
    handler = partial(PageHandler, page.encode())
    with ThreadingHTTPServer(('127.0.0.1', port), handler) as server:
        address = f'http://127.0.0.1:{server.server_address[1]}/'
        print(f'{address}  (Ctrl-C ends)', flush=True)
        if open_browser:
            webbrowser.open(address)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()
    return EXIT_OK
