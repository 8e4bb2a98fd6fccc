"""The books of a run as CSV, for a spreadsheet, and as JSON, for a program."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from arm_executor.bins.records import Attempt
from conveyor_sim.streams import as_text
from pack_cell.journal.run_books import RunBooks
from pack_msgs_py.values import Bin

#: Of ``journal.json``; grows when a reader must know.
FORMAT = 1


def export_books(books: RunBooks, folder: Path) -> list[Path]:
    """Write ``journal.json`` and a CSV file per kind of thing into ``folder``; returns them.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = books_data(books)
    paths = [folder / 'journal.json']
    paths[0].write_text(json.dumps(data, indent=1) + '\n', encoding='utf-8')
    for name in ('bins', 'placements', 'events', 'belt', 'operations', 'alarms'):
        rows = [_flat(row) for row in data[name] or ()]
        path = folder / f'{name}.csv'
        _write_csv(path, rows)
        paths.append(path)
    return paths


def books_data(books: RunBooks) -> dict[str, Any]:
    """Both books as plain data; lengths in millimetres, poses in metres, times in ISO 8601."""
    return {
        'format': FORMAT,
        'bins': [_bin(known, *books.bin_times[known.serial]) for known in books.bins],
        'placements': [_placement(attempt, books) for attempt in books.attempts],
        'events': [
            {**asdict(event), 'event': event.event.name, 'reason': event.reason.name,
             'stamp': _when(event.stamp_s)}
            for event in books.events
        ],
        'belt': None
        if books.fed is None
        else [{**asdict(fed), 'reason': fed.reason.name} for fed in books.fed],
        'operations': [
            {'node': asked.node, **asdict(asked.operation),
             'stamp': _when(asked.operation.stamp_s)}
            for asked in books.operations
        ],
        'alarms': [
            {'node': raised.node, **asdict(alarm), 'severity': alarm.severity.name,
             'raised': _when(alarm.raised_s), 'ended': _when_if(kept.ended_s),
             'acknowledged': _when_if(kept.over_s), 'who': kept.over_by, 'why': kept.over_why}
            for raised in books.alarms
            for kept, alarm in ((raised.kept, raised.kept.alarm),)
        ],
    }  # fmt: skip


def _bin(known: Bin, opened_s: float, closed_s: float | None) -> dict[str, Any]:
    return {
        'bin_id': known.id,
        'serial': known.serial,
        'kind': known.spec.name,
        'size_mm': list(known.spec.size_mm),
        'station': known.station,
        'destination': known.destination,
        'revision': known.revision,
        'boxes': len(known.boxes),
        'fill_percent': round(100 * known.fill_rate, 3),
        'weight_kg': round(known.weight_kg, 3),
        'opened': _when(opened_s),
        'closed': _when_if(closed_s),
    }


def _placement(attempt: Attempt, books: RunBooks) -> dict[str, Any]:
    placed = attempt.placed
    return {
        'number': attempt.id,
        'box_id': placed.box.id,
        'bin_serial': attempt.bin_serial,
        'step': attempt.step.value,
        'box': asdict(placed.box),
        'corner_mm': list(placed.corner_mm),
        'planned_size_mm': list(placed.size_mm),
        'orientation': placed.orientation,
        'target': asdict(attempt.target),
        'measured': None if attempt.measured is None else asdict(attempt.measured),
        'steps': {step: _when(stamp_s) for step, stamp_s in books.steps.get(attempt.id, ())},
    }


def _when(stamp_s: float) -> str:
    return datetime.fromtimestamp(stamp_s, timezone.utc).isoformat(timespec='milliseconds')


def _when_if(stamp_s: float | None) -> str | None:
    return None if stamp_s is None else _when(stamp_s)


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Nested values as columns of their own: ``target.position`` and so on, lists as ``x y z``."""
    return dict(_flat_items(row, ''))


def _flat_items(row: dict[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    for key, value in row.items():
        if isinstance(value, dict):
            yield from _flat_items(value, f'{before}{key}.')
        elif isinstance(value, (list, tuple)):
            yield f'{before}{key}', ' '.join(map(str, value))
        else:
            yield f'{before}{key}', value


def _write_csv(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    columns: Iterable[str] = dict.fromkeys(key for row in rows for key in row)
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(columns)
        for row in rows:
            writer.writerow([_cell(row.get(key)) for key in columns])


def _cell(value: Any) -> str:  # noqa: ANN401 - whatever a field holds
    """Numbers as they are; texts so that no spreadsheet takes them for a formula."""
    if value is None:
        return ''
    return as_text(value) if isinstance(value, str) else str(value)
