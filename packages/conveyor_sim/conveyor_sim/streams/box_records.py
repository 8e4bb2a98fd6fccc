"""What a row of a box file becomes: a :class:`Box`, or a :class:`RejectedRow` that says why not."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Box

#: Weight of a box whose file gives none: one kilogram per 6000 cm3, the volumetric divisor of the
#: IATA air cargo tariff (The Air Cargo Tariff, rule 3.9.3), about 167 kg/m3.
DEFAULT_DENSITY_KG_PER_MM3 = 1.0 / 6.0e6


class BoxFileError(ValueError):
    """A box file as a whole cannot be used; the text names the file and says why."""


class UnclearBoxFile(BoxFileError):
    """A box file can be read in two ways; units, separators or columns have to be said."""


@dataclass(frozen=True)
class RejectedRow:
    """A row that cannot be a box. It counts as supplied and as rejected.

    ``box_id`` is unique in the file. ``line`` counts from 1; 0 in a JSON file, where ``text``
    names order and item. ``text`` names file, place, column and value.
    """

    box_id: str
    file: str
    line: int
    column: str
    value: str
    reason: Reason
    text: str


Entry = Box | RejectedRow
