"""``cell view``: the live page beside a running cell, and the process that serves it in a run."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from pack_cell.options.page_address import DEFAULT_PORT, LOOPBACK
from pack_cell.options.parsers import whole
from pack_cell.watching.finding import NoCell, domain_of_cell

#: How long the page may take to end after SIGTERM.
_PATIENCE_S = 3.0


def add_view(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell view`` to the command line."""
    parser = verbs.add_parser(
        'view',
        help='show a running cell on a page in the browser',
        description="Serve one page that shows a running cell, with the operator's buttons. It may "
        'be started, closed and killed at any time: the cell does not notice. Ends with Ctrl-C.',
    )
    parser.add_argument(
        '--domain',
        type=whole(0, 232),
        metavar='N',
        help='ROS domain of the cell (default: $ROS_DOMAIN_ID, else the only one in which a cell '
        'runs here, else 0)',
    )
    parser.add_argument(
        '--namespace', default='', metavar='NAME', help='namespace of the cell (default: none)'
    )
    parser.add_argument(
        '--port',
        type=whole(0, 65535),
        default=DEFAULT_PORT,
        metavar='N',
        help=f'port of the page, 0 for any free one (default {DEFAULT_PORT})',
    )
    parser.add_argument(
        '--host',
        default=LOOPBACK,
        metavar='ADDRESS',
        help='address to serve on; who reaches it can press the buttons, so let it be this machine '
        f'alone unless the network is yours (default {LOOPBACK})',
    )


def run_view(options: argparse.Namespace) -> int:
    """Serve the page until a signal; return the exit code."""
    from pack_cell.ros.viewer import serve_page
    from pack_cell.view.page import PageAddress

    def told(url: str) -> None:
        print(f'the cell is shown at {url}', flush=True)

    try:
        os.environ['ROS_DOMAIN_ID'] = str(domain_of_cell(options.domain))
        serve_page(PageAddress(options.host, options.port), told, options.namespace)
    except NoCell as error:
        print(f'cell view: {error}', file=sys.stderr)
        return 2
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


class PageProcess:
    """The page of a run, in a process of its own; whether it lives is nothing to the run."""

    def __init__(self, port: int, log: Path) -> None:
        log.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, '-m', 'pack_cell', 'view', '--port', str(port)]
        setpriv = shutil.which('setpriv')
        if setpriv is not None:  # the page must not outlive a run that was killed
            command = [setpriv, '--pdeathsig', 'TERM', *command]
        with log.open('ab') as output:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._log, self._told = log, False

    def news(self) -> str:
        """What there is to tell since the last time: where the page is, or that it has ended."""
        if self._told:
            return ''
        text = self._log.read_text(errors='replace')
        url = next((line for line in text.splitlines() if 'is shown at' in line), '')
        if url:
            self._told = True
            return url
        if self._process.poll() is not None:
            self._told = True
            last = next((line for line in reversed(text.splitlines()) if line.strip()), '')
            return f'no page: {last}' if last else f'no page: see {self._log}'
        return ''

    def close(self) -> None:
        """End the page."""
        if self._process.poll() is None:
            self._process.terminate()
        try:
            self._process.wait(timeout=_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
