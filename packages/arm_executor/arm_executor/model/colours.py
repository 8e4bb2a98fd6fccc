"""Colours of the cell, the same in physics, pictures and markers. Red, green, blue, alpha."""

from __future__ import annotations

import zlib

Colour = tuple[float, float, float, float]

BELT: Colour = (0.16, 0.17, 0.19, 1.0)
STEEL: Colour = (0.45, 0.47, 0.5, 1.0)
WALL: Colour = (0.35, 0.55, 0.78, 1.0)
PALLET: Colour = (0.62, 0.47, 0.3, 1.0)
FLOOR: Colour = (0.80, 0.81, 0.83, 1.0)
_CARTONS: tuple[Colour, ...] = (
    (0.80, 0.62, 0.42, 1.0),
    (0.72, 0.53, 0.34, 1.0),
    (0.86, 0.71, 0.52, 1.0),
    (0.66, 0.49, 0.33, 1.0),
    (0.90, 0.78, 0.60, 1.0),
    (0.77, 0.57, 0.44, 1.0),
)


def carton(box_id: str) -> Colour:
    """The colour of a box: always the same for the same id."""
    return _CARTONS[zlib.crc32(box_id.encode()) % len(_CARTONS)]
