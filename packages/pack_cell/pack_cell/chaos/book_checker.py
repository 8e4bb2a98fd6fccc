"""What two SQLite files and a record say of a run, read without the code that wrote them.

Every box that was fed is in exactly one place by both books, no box is in a bin twice, nothing in a
bin overlaps or sticks out, and the record of the run says the same.
"""

from __future__ import annotations

import json
import shutil
import sqlite3
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

IN_BIN = ('releasing', 'placed', 'verified')
_SEVERITIES = {1: 'warning', 2: 'alarm'}
#: Above the rim by plan: heights of tops are measured.
RIM_MM = 60


def check_run(folder: Path, boxes: int) -> list[str]:
    """What is wrong with a run that has ended with ``boxes`` boxes; empty for nothing.

    Parameters
    ----------
    folder : of the run.
    boxes : how many the stream holds.
    """
    return [*check_books(folder, boxes), *check_summary(folder, boxes)]


def check_books(folder: Path, boxes: int, *, ended: bool = True) -> list[str]:
    """The same of the two books alone; with ``ended`` false the run may be anywhere."""
    ledger = _rows(folder / 'state' / 'conveyor.sqlite', 'SELECT ordinal, box_id, place FROM boxes')
    attempts = _rows(
        folder / 'state' / 'executor.sqlite', 'SELECT box_id, bin_serial, placed, step FROM attempt'
    )
    bins = _rows(folder / 'state' / 'executor.sqlite', 'SELECT serial, size_mm, closed_s FROM bin')
    wrong = [*_doubled(ledger, attempts), *_bins_wrong(attempts, bins)]
    if ended:
        wrong += _ends_wrong(ledger, attempts, boxes)
    return wrong


def check_summary(folder: Path, boxes: int) -> list[str]:
    """What is wrong with the summary and the rows of a run that has come to its end."""
    wrong = []
    summary = json.loads((folder / 'summary.json').read_text())
    for key in ('lost', 'unaccounted', 'rule_violations', 'mis_sorts'):
        if summary[key]:
            wrong.append(f'summary: {key} is {summary[key]}: {summary["problems"]}')
    ended = summary['placed'] + summary['rejected']
    if not summary['boxes_supplied'] == ended == boxes:
        wrong.append(
            f'summary: {summary["boxes_supplied"]} supplied, {ended} ended, {boxes} in the stream'
        )
    if not (summary['accounts'] or {}).get('sum_is_right'):
        wrong.append(f'summary: accounts are {summary["accounts"]}')
    lines = (folder / 'placements.jsonl').read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    twice = [box_id for box_id, count in Counter(r['box_id'] for r in rows).items() if count > 1]
    if twice or len(rows) != boxes:
        wrong.append(f'placements.jsonl has {len(rows)} rows of {boxes}, twice: {twice}')
    by_record = {
        (row['box_id'], row['bin_serial'], tuple(row['position_mm']))
        for row in rows
        if row['outcome'] == 'placed'
    }
    by_journal = {
        (box_id, serial, tuple(json.loads(placed)['corner_mm']))
        for box_id, serial, placed in _rows(
            folder / 'state' / 'executor.sqlite',
            "SELECT box_id, bin_serial, placed FROM attempt WHERE step = 'verified'",
        )
    }
    for what, differing in (
        ('only in the record', by_record - by_journal),
        ('only in the journal', by_journal - by_record),
    ):
        wrong += [f'{what}: {placement}' for placement in sorted(differing)]
    return wrong


def count_places(folder: Path) -> Counter[str]:
    """How many boxes are where by the ledger of the conveyor, and how many in bins by the arm's."""
    path = folder / 'state'
    places = Counter(row[0] for row in _rows(path / 'conveyor.sqlite', 'SELECT place FROM boxes'))
    steps = _rows(path / 'executor.sqlite', 'SELECT step FROM attempt')
    places['in bins by the journal'] = sum(step in IN_BIN for (step,) in steps)
    return places


def count_alarms(folder: Path) -> Counter[str]:
    """How often each alarm and warning was raised, by the books of arm and belt."""
    rows = [
        row
        for book in ('executor.sqlite', 'conveyor.sqlite')
        for row in _rows(folder / 'state' / book, 'SELECT severity, code FROM alarm')
    ]
    return Counter(f'{_SEVERITIES.get(severity, severity)} {code}' for severity, code in rows)


def _doubled(ledger: list[Any], attempts: list[Any]) -> Iterator[str]:
    fed = Counter(box_id for _, box_id, _ in ledger)
    yield from (f'box {box_id} is {n} times in the ledger' for box_id, n in fed.items() if n > 1)
    in_bins = Counter(box_id for box_id, _, _, step in attempts if step in IN_BIN)
    yield from (f'box {box_id} is {n} times in bins' for box_id, n in in_bins.items() if n > 1)
    ordinals = sorted(ordinal for ordinal, _, _ in ledger)
    if ordinals != list(range(len(ordinals))):
        yield f'the ledger has gaps: {ordinals[:5]} to {ordinals[-5:]}'
    places = {box_id: place for _, box_id, place in ledger}
    for box_id in in_bins:
        if places.get(box_id) == 'rejected':
            yield f'box {box_id} is in a bin, and rejected by the ledger'
        elif box_id not in places:
            yield f'box {box_id} is in a bin, and was never fed'


def _ends_wrong(ledger: list[Any], attempts: list[Any], boxes: int) -> Iterator[str]:
    if len(ledger) != boxes:
        yield f'{len(ledger)} boxes were fed of {boxes}'
    in_bins = {box_id for box_id, _, _, step in attempts if step in IN_BIN}
    for box_id, _, _, step in attempts:
        if step in ('planned', 'picked', 'releasing', 'placed'):
            yield f'box {box_id} is still {step}'
    for _, box_id, place in ledger:
        # Of the last box the conveyor may not have heard that it was placed.
        ends = 'placed' if box_id in in_bins else 'rejected'
        if place != ends and not (place == 'picked' and box_id in in_bins):
            yield f'box {box_id} is {place} by the ledger, {ends} by the journal'


def _bins_wrong(attempts: list[Any], bins: list[Any]) -> Iterator[str]:
    sizes = {serial: json.loads(size) for serial, size, _ in bins}
    inside: dict[int, list[dict[str, Any]]] = {serial: [] for serial in sizes}
    for _, serial, placed, step in attempts:
        if step in IN_BIN:
            inside[serial].append(json.loads(placed))
    for serial, content in inside.items():
        for placed in content:
            over = [
                placed['corner_mm'][axis] + placed['size_mm'][axis] - sizes[serial][axis]
                for axis in range(3)
            ]
            if min(placed['corner_mm']) < 0 or max(over[:2]) > 0 or over[2] > RIM_MM:
                yield f'box {placed["box"]["id"]} sticks out of bin {serial}: {placed["corner_mm"]}'
        for one, other in combinations(content, 2):
            if all(
                one['corner_mm'][axis] < other['corner_mm'][axis] + other['size_mm'][axis]
                and other['corner_mm'][axis] < one['corner_mm'][axis] + one['size_mm'][axis]
                for axis in range(3)
            ):
                yield f'boxes {one["box"]["id"]} and {other["box"]["id"]} overlap in bin {serial}'


def _rows(path: Path, query: str) -> list[Any]:
    """Of a copy: reading a file would take up what a cut has left in its write-ahead log."""
    if not path.exists():
        return []
    with tempfile.TemporaryDirectory() as folder:
        for name in (path.name, f'{path.name}-wal'):
            if path.with_name(name).exists():
                shutil.copyfile(path.with_name(name), Path(folder) / name)
        db = sqlite3.connect(Path(folder) / path.name)
        try:
            return db.execute(query).fetchall()
        except sqlite3.OperationalError as error:
            if 'no such table' in str(error):
                return []  # cut between the file and its tables
            raise
        finally:
            db.close()
