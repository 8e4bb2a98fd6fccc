"""A box list as it stands in its file, whatever the format: named columns of texts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

#: A file that holds more is no list of boxes for one cell.
MAX_BOXES = 1_000_000


@dataclass(frozen=True)
class TableRow:
    """One row: where it stands, and the text of each column that it has.

    ``named`` is the id that the place gives the box, whatever columns say; ``damage`` says what is
    wrong with the row as a whole.
    """

    line: int
    place: str
    cells: Mapping[str, str]
    named: str = ''
    damage: str = ''


@dataclass(frozen=True)
class BoxTable:
    """All rows of a file.

    Attributes
    ----------
    headers : of the columns, each once, in their order.
    rows : in their order.
    notes : what of the file is in no row, a line each.
    points_by_format : whether a point is a decimal point where no number says otherwise.
    """

    headers: tuple[str, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()
    points_by_format: bool = False
