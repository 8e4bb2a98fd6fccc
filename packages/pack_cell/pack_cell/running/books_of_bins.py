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
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.values import Bin


@dataclass(frozen=True)
class BooksOfBins:
    """Every event of a box that the executor has written down, and every bin that was closed."""

    events: tuple[BoxEvent, ...] = ()
    closed: tuple[Bin, ...] = ()

    def tell(self, record: RunRecord) -> None:
        """Have ``record`` know all of it; what it has heard before changes nothing."""
        for event in self.events:
            record.on_event(event)
        for closed in self.closed:
            record.on_closed(closed)


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
        return BooksOfBins(journal.events(ALL), journal.closed_bins(ALL))
