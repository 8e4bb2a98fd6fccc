"""What came of a run: its summary as data and for people, and the files that are written of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pack_cell.files import naming
from pack_cell.options.declaration import NamedOption, declared_options
from pack_cell.options.run_options import RunOptions
from pack_cell.report.ended_run import EndedRun
from pack_cell.report.figure_kinds import Summary
from pack_cell.report.record import RunRecord
from pack_cell.report.summary_figures import FIGURES


def _repeated_options() -> list[NamedOption]:
    """The options that a summary repeats."""
    return [named for named in declared_options(RunOptions) if named.declaration.in_summary]


def summarize(run: EndedRun) -> Summary:
    """The summary of a run as plain data; fills are percent, times seconds."""
    figures = {figure.key: figure.of(run) for figure in FIGURES}
    return figures | {named.key: getattr(run.options, named.key) for named in _repeated_options()}


def summary_lines(summary: Summary) -> list[tuple[str, str]]:
    """Name and text of each line of the summary that people read."""
    lines: dict[str, list[str]] = {}
    for figure in FIGURES:
        if figure.line:
            lines.setdefault(figure.line, []).append(figure.part(summary))
    texts = ((name, ', '.join(filter(None, parts))) for name, parts in lines.items())
    return [(name, text) for name, text in texts if text]


def is_clean(summary: Summary) -> bool:
    """Whether every box is in exactly one place, and no rule was broken."""
    return all(
        figure.is_clean is None or figure.is_clean(summary[figure.key]) for figure in FIGURES
    )


def figures_table() -> str:
    """All keys of a summary as a table for docs/summary.md."""
    rows = [(figure.key, figure.text, figure.line.strip()) for figure in FIGURES]
    rows += [(named.key, f'the option `{named.flag}`', '') for named in _repeated_options()]
    lines = ['| key | what it is | printed as |', '|---|---|---|']
    lines += [f'| `{key}` | {text} | {line} |' for key, text, line in rows]
    return '\n'.join(lines) + '\n'


def placement_rows(record: RunRecord) -> list[dict[str, Any]]:
    """One object per box that is not archived, in the order in which they came to their end."""
    started = [
        placed.box.id
        for known in record.every_bin()
        for placed in known.boxes
        if placed.box.id in record.start_ids
    ]
    return record.rows(dict.fromkeys([*started, *record.events, *record.boxes]))


def write_run(folder: Path, summary: Summary, record: RunRecord) -> None:
    """Write ``summary.json`` into ``folder``, and the rows that ``placements.jsonl`` lacks."""
    folder.mkdir(parents=True, exist_ok=True)
    with naming(folder / 'summary.json'):
        (folder / 'summary.json').write_text(json.dumps(summary, indent=2) + '\n')
    if record.archive is not None:
        record.archive.write(placement_rows(record))
