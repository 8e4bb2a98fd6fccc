"""What the executor's journal says of a run that is gone on with.

The topics repeat the latest events and bins alone; the recorder may have missed more of them, when
its own file was not on the disk yet as the power failed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from arm_executor.bins.journal import FILE_NAME
from arm_executor.bins.journal_reader import ALL, read_journal
from pack_cell.report.record import RunRecord
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent
from pack_msgs_py.values import Bin


@dataclass(frozen=True)
class BooksOfBins:
    """Every event of a box that the executor has written down, and every bin.

    Those that stand in the cell count too: a run may be stopped before its executor speaks.
    """

    events: tuple[BoxEvent, ...] = ()
    closed: tuple[Bin, ...] = ()
    standing: BinSnapshot | None = None

    def tell(self, record: RunRecord) -> None:
        """Have ``record`` know all of it; what it has heard before changes nothing."""
        for event in self.events:
            record.on_event(event)
        for closed in self.closed:
            record.on_closed(closed)
        if self.standing is not None and not record.bins:
            record.on_bins(self.standing)


def books_of_bins(state: Path) -> BooksOfBins:
    """What the journal in the folder ``state`` says, before its executor starts.

    Raises
    ------
    JournalError
        It cannot be read.
    """
    path = state / FILE_NAME
    if not path.exists():
        return BooksOfBins()
    with read_journal(path) as journal:
        if not journal.is_begun:
            return BooksOfBins()
        standing = BinSnapshot(journal.revision(), 0.0, journal.open_bins())
        return BooksOfBins(journal.events(ALL), journal.closed_bins(ALL), standing)
