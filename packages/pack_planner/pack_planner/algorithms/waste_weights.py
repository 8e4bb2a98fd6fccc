"""What a placement wastes, as numbers that can be tuned."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class WasteWeights:
    """What makes a placement wasteful, and by how much.

    Attributes
    ----------
    lost : for the volume that is shut in below the box, over its own.
    touched : reward for the share of its four sides that lies against walls or boxes.
    level : reward for the share of the border of its top that is level with what is beside it.
    spread : for (x + y) / (L + B), how far its corner lies from the origin.
    younger : for each bin that is older than its own.
    snug : reward for the share of its four sides that touch nothing, but have something nearer than
        ``near_mm``.
    near_mm : what is near, millimetres.
    large_first : bonus in the order of virtual packing, times volume over that of the largest box.
    no_place : for a box of the look-ahead that finds no place any more.
    far_ends : whether also the farthest positions count at which a box's surroundings stay the
        same, flush with what lies beyond.
    """

    lost: float
    touched: float
    level: float
    spread: float
    younger: float
    large_first: float
    no_place: float
    snug: float = 0.0
    near_mm: float = 0.0
    far_ends: bool = False
