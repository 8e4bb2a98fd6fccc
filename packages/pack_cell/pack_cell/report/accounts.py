"""Where every box ended, by the books of the conveyor and by what the topics showed."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from conveyor_sim.ledger.ledger import FILE_NAME
from pack_cell.report.record import RunRecord
from pack_msgs_py.codes import Reason
from pack_msgs_py.wording import how_many

#: Places of the conveyor's ledger, as they are called in the summary.
_ON_BELT = ('on_belt', 'waiting', 'unseen')


@dataclass(frozen=True)
class BoxAccounts:
    """What the conveyor wrote down: place and reason of each box that it gave out, by id.

    ``waits`` are its statistics of laps and waits.
    """

    places: dict[str, str] = field(default_factory=dict)
    reasons: dict[str, Reason] = field(default_factory=dict)
    waits: dict[str, Any] = field(default_factory=dict)


def read_books(state: Path) -> BoxAccounts | None:
    """What a conveyor that has ended wrote down; ``None`` when there is nothing to be read."""
    path = state / FILE_NAME
    if not path.exists():
        return None
    try:
        db = sqlite3.connect(path)
        try:
            rows = db.execute('SELECT box_id, place, reason FROM boxes').fetchall()
            statistics = db.execute("SELECT value FROM meta WHERE key = 'statistics'").fetchone()
        finally:
            db.close()
    except sqlite3.Error:
        return None
    return BoxAccounts(
        {box_id: place for box_id, place, _ in rows},
        {box_id: Reason(reason) for box_id, place, reason in rows if place == 'rejected'},
        json.loads(statistics[0]) if statistics else {},
    )


def accounts(books: BoxAccounts, record: RunRecord) -> dict[str, Any]:
    """How many boxes were fed, and where they are; ``sum_is_right`` says whether that is all."""
    places = Counter(_places(books, record).values())
    rejected = Counter(books.reasons.values())
    counts: dict[str, Any] = {
        'fed': len(books.places),
        'placed': places['placed'],
        'rejected': {reason.name.lower(): number for reason, number in sorted(rejected.items())},
        'on_belt': sum(places[name] for name in _ON_BELT),
        'in_gripper': places['picked'],
        'lost': places['lost'],
        'unknown': record.unknown(),
    }
    ends = sum(counts[name] for name in ('placed', 'on_belt', 'in_gripper', 'lost'))
    counts['sum_is_right'] = ends + rejected.total() == counts['fed'] == record.supplied
    return counts


def account_text(counts: dict[str, Any] | None) -> str:
    """One line for people; empty where the conveyor left no books."""
    if counts is None:
        return ''
    reasons = ', '.join(f'{number} {reason}' for reason, number in counts['rejected'].items())
    right = 'all of' if counts['sum_is_right'] else 'NOT all of'
    return (
        f'{right} {counts["fed"]} fed: {counts["on_belt"]} on the belt, '
        f'{counts["in_gripper"]} in the gripper, {counts["lost"]} lost, '
        f'{counts["unknown"]} unknown; rejected: {reasons or "none"}'
    )


def disagreements(books: BoxAccounts, record: RunRecord) -> list[str]:
    """Boxes that the conveyor's ledger and the bins do not agree about, a line each."""
    in_bins = record.ids_in_bins()
    places = _places(books, record)
    # Put in by hand, of no stream: the conveyor never had them.
    foreign = record.by_hand - set(places)
    by_ledger = {box_id for box_id, place in places.items() if place == 'placed'}
    return [
        *(
            f'box {box_id!r} is in a bin, not by the ledger'
            for box_id in sorted(in_bins - by_ledger - foreign)
        ),
        *(
            f'box {box_id!r} is placed by the ledger, and in no bin'
            for box_id in sorted(by_ledger - in_bins)
        ),
    ]


def _places(books: BoxAccounts, record: RunRecord) -> dict[str, str]:
    """The ledger, brought up to date: of the last box it may not have heard that it was placed."""
    in_bins = record.ids_in_bins()
    return {
        box_id: 'placed' if place == 'picked' and box_id in in_bins else place
        for box_id, place in books.places.items()
    }


def waits(books: BoxAccounts) -> dict[str, Any]:
    """The longest wait on the belt, robot time, and the most laps of a box."""
    names = ('longest_wait_s', 'longest_wait_box', 'most_laps', 'missed_windows', 'jams')
    return {name: books.waits.get(name) for name in names}


def waits_text(longest: dict[str, Any]) -> str:
    """One line for people."""
    return f'{longest["longest_wait_s"] or 0.0:.0f} s, {how_many(longest["most_laps"] or 0, "lap")}'
