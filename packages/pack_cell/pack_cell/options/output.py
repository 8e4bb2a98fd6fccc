"""Options of a run: output."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pack_cell.options.declaration import option
from pack_cell.options.page_address import DEFAULT_PORT
from pack_cell.options.parsers import OneOf, optional_path, whole

_GROUP = 'output'


@dataclass(frozen=True)
class Output:
    """Of a run: output. Lengths in millimetres, times in seconds."""

    out: Path | None = option(
        '',
        'folder for summary.json, placements.jsonl, logs',
        _GROUP,
        read=optional_path,
        metavar='DIR',
        default_text='`runs/<time>`',
        launched=False,
    )
    record: str = option(
        'all',
        'what is written down of what the nodes say to each other',
        _GROUP,
        read=OneOf(
            lambda: {
                'all': 'every topic into `run.mcap`, and the last 30 s before a fault',
                'faults': 'these alone',
                'nothing': 'no recorder runs',
            }
        ),
        see='recording.md',
        launched=False,
        resumable=True,
    )
    resume: Path | None = option(
        '',
        'go on with the run in this folder, after a power cut or Ctrl-C: same boxes, bins, options '
        'and numbers; a summary of the whole run',
        _GROUP,
        read=optional_path,
        metavar='DIR',
        default_text='a new run',
        see='reliability.md#go-on-after-a-power-cut',
        launched=False,
    )
    view: bool = option(
        '',
        'show the run on a page in the browser, on this machine alone',
        _GROUP,
        flag=True,
        see='view.md',
        launched=False,
        resumable=True,
    )
    view_port: int = option(
        f'{DEFAULT_PORT}',
        'port of that page, 0 for any free one',
        _GROUP,
        read=whole(0, 65535),
        metavar='N',
        launched=False,
        resumable=True,
    )
    quiet: bool = option(
        '', 'no progress, only the summary', _GROUP, flag=True, launched=False, resumable=True
    )
