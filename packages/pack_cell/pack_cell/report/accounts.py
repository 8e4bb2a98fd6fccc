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

#: Places of the conveyor's ledger, as they are called in the summary.
_ON_BELT = ('on_belt', 'waiting', 'unseen')


@dataclass(frozen=True)
class Ledger:
    """What the conveyor wrote down: place and reason of each box that it gave out, by id.

    ``waits`` are its statistics of laps and waits.
    """

    places: dict[str, str] = field(default_factory=dict)
    reasons: dict[str, Reason] = field(default_factory=dict)
    waits: dict[str, Any] = field(default_factory=dict)


def read_ledger(state: Path) -> Ledger | None:
    """The ledger of a conveyor that has ended; ``None`` when there is none that can be read."""
    path = state / FILE_NAME
    if not path.exists():
        return None
    try:
        db = sqlite3.connect(path)
        try:
            rows = db.execute('SELECT box_id, place, reason FROM boxes').fetchall()
            found = db.execute("SELECT value FROM meta WHERE key = 'statistics'").fetchone()
        finally:
            db.close()
    except sqlite3.Error:
        return None
    return Ledger(
        {box_id: place for box_id, place, _ in rows},
        {box_id: Reason(reason) for box_id, place, reason in rows if place == 'rejected'},
        json.loads(found[0]) if found else {},
    )


def accounts(ledger: Ledger, record: RunRecord) -> dict[str, Any]:
    """How many boxes were fed, and where they are; ``sum_is_right`` says whether that is all."""
    places = Counter(_places(ledger, record).values())
    found: dict[str, Any] = {
        'fed': len(ledger.places),
        'placed': places['placed'],
        'rejected': {
            reason.name.lower(): number
            for reason, number in sorted(Counter(ledger.reasons.values()).items())
        },
        'on_belt': sum(places[name] for name in _ON_BELT),
        'in_gripper': places['picked'],
        'lost': places['lost'],
        'unknown': record.unknown(),
    }
    ends = (value for name, value in found.items() if name not in ('fed', 'rejected', 'unknown'))
    total = sum(ends) + sum(found['rejected'].values())
    found['sum_is_right'] = total == found['fed'] == record.supplied
    return found


def disagreements(ledger: Ledger, record: RunRecord) -> list[str]:
    """Boxes that the conveyor's ledger and the bins do not agree about, a line each."""
    in_bins = record.ids_in_bins()
    places = _places(ledger, record)
    by_ledger = {box_id for box_id, place in places.items() if place == 'placed'}
    lines = [f'box {one!r} is in a bin, not by the ledger' for one in sorted(in_bins - by_ledger)]
    return lines + [
        f'box {one!r} is placed by the ledger, and in no bin' for one in sorted(by_ledger - in_bins)
    ]


def _places(ledger: Ledger, record: RunRecord) -> dict[str, str]:
    """The ledger, brought up to date: of the last box it may not have heard that it was placed."""
    in_bins = record.ids_in_bins()
    return {
        box_id: 'placed' if place == 'picked' and box_id in in_bins else place
        for box_id, place in ledger.places.items()
    }


def waits(ledger: Ledger) -> dict[str, Any]:
    """The longest wait on the belt, robot time, and the most laps of a box."""
    names = ('longest_wait_s', 'longest_wait_box', 'most_laps', 'missed_windows', 'jams')
    return {name: ledger.waits.get(name) for name in names}
