"""Boxes and bins that a run is done with: their rows are on disk, a few numbers in memory."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pack_cell.files import naming
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import Rule, Violation
from pack_msgs_py.validator import validate_sequence
from pack_msgs_py.values import Bin


@dataclass(frozen=True)
class BinFigures:
    """What the summary needs to know of a bin; the fill rate is by true sizes, 0 to 1.

    ``reason`` is why the planner closed it; ``None`` for one that stands, or that somebody else
    closed.
    """

    bin_id: str
    serial: int
    destination: str
    boxes: int
    fill_rate: float
    mis_sorts: int
    violations: tuple[Violation, ...] = ()
    reason: ClosingReason | None = None


def bin_figures(
    measured: Bin, true: Bin, profile: Profile, reason: ClosingReason | None = None
) -> BinFigures:
    """The figures of a bin, replayed under ``profile``; ``true`` has the true sizes."""
    boxes, destination = measured.boxes, measured.destination
    violations = tuple(validate_sequence(boxes, measured.spec, profile, destination))
    mis_sorts = sum(broken.rule is Rule.DESTINATION for broken in violations)
    return BinFigures(
        measured.id, measured.serial, destination, len(boxes), true.fill_rate, mis_sorts,
        violations, reason,
    )  # fmt: skip


class Archive:
    """Owns the file of the rows, which it empties when it is made.

    ``where`` says for each box in the archive where it is: ``bin LDC-3`` or ``rejected``.
    """

    def __init__(self, path: Path, profile: Profile) -> None:
        self.path = path
        self.profile = profile
        self.where: dict[str, str] = {}
        self.bins: list[BinFigures] = []
        path.parent.mkdir(parents=True, exist_ok=True)
        with naming(path):
            path.write_text('')

    def write(self, rows: Iterable[dict[str, Any]]) -> None:
        """Append rows to the file."""
        with naming(self.path), self.path.open('a') as file:
            file.writelines(json.dumps(row) + '\n' for row in rows)

    def add_bin(self, closed: Bin, true: Bin, reason: ClosingReason | None) -> None:
        """A bin whose boxes have all come to their end; the caller writes their rows."""
        self.bins.append(bin_figures(closed, true, self.profile, reason))
        self.where.update({placed.box.id: f'bin {closed.id}' for placed in closed.boxes})
