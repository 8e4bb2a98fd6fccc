"""Bins that are kept from being filled, and stations that are left empty, as the journal has it."""

from __future__ import annotations

import json
from collections.abc import Set

from arm_executor.bins.journal import Journal

_HELD, _VACANT = 'held', 'vacant'


def held_bins(journal: Journal) -> frozenset[str]:
    """Ids of the bins that an operator keeps from being filled."""
    return _names(journal, _HELD)


def set_held_bins(journal: Journal, bin_ids: Set[str]) -> None:
    """Write them down, inside a transaction of the caller."""
    _set_names(journal, _HELD, bin_ids)


def vacant_stations(journal: Journal) -> frozenset[str]:
    """Stations that an operator has left without a bin."""
    return _names(journal, _VACANT)


def set_vacant_stations(journal: Journal, stations: Set[str]) -> None:
    """Write them down, inside a transaction of the caller."""
    _set_names(journal, _VACANT, stations)


def _names(journal: Journal, key: str) -> frozenset[str]:
    rows = journal.execute('SELECT value FROM meta WHERE key = ?', (key,))
    return frozenset(json.loads(rows[0][0])) if rows else frozenset()


def _set_names(journal: Journal, key: str, names: Set[str]) -> None:
    journal.execute('INSERT OR REPLACE INTO meta VALUES (?, ?)', (key, json.dumps(sorted(names))))
