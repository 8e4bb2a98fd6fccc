"""What a placement wastes, as numbers that can be tuned."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pack_planner.engine import waste

#: Terms that depend on the place alone.
_TERMS = (
    'lost', 'touched', 'level', 'spread', 'snug', 'near_mm', 'level_mm', 'hollow', 'above',
    'beside', 'tall', 'slender', 'shut_off',
)  # fmt: skip


@dataclass(frozen=True)
class WasteWeights:
    """What makes a placement wasteful, and by how much.

    Room that stays empty on average is what :func:`pack_planner.engine.room.unusable` says of the
    boxes in the open bins and in the look-ahead, with ``choices`` to choose from at a time.

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
    level_mm : how far tops may differ that count as level, millimetres.
    hollow : for the share of its base that nothing carries.
    above : for the room that stays empty on average above its top, less that above what is now
        under it, over its own volume.
    beside : the same along its four sides, as far as it is high.
    tall : for the height of its top, over that of the bin.
    slender : for its height, over the shorter edge of its base.
    shut_off : where the front is open, for the room behind it, up to its top, that one sees from
        the front no more, over its own volume.
    choices : see above.
    room : in bins with walls all around, for the share of the sizes to come, by volume, that find
        no place any more once the whole plan is done, times the number of such boxes that have the
        volume of the bin: what a box takes of that is about the same in a large bin and in a small
        one. See :mod:`pack_planner.algorithms.sizes_to_come`.
    late : for a box that is tipped next, times how many boxes of the look-ahead are nearer: the
        farther it has to come to the tray, the less of the tip is hidden behind the last motion;
        into a cage with an open front motions are long enough.
    mixed : how many mixtures of sizes stand beside each known box there.
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
    level_mm: float = 0.0
    hollow: float = 0.0
    above: float = 0.0
    beside: float = 0.0
    tall: float = 0.0
    slender: float = 0.0
    shut_off: float = 0.0
    choices: float = 2.0
    room: float = 0.0
    late: float = 0.0
    mixed: int = 1

    def __post_init__(self) -> None:
        for name in ('lost', 'hollow', 'above', 'beside', 'shut_off', 'room'):
            value = getattr(self, name)
            if not 0 <= value < math.inf:
                msg = f'weight {name!r} is {value}; it must be 0 or more'
                raise ValueError(msg)

    def array(self) -> NDArray[np.float64]:
        """The weights where :mod:`pack_planner.engine.waste` looks for them."""
        weights = np.zeros(waste.WEIGHTS)
        for name in _TERMS:
            weights[getattr(waste, name.upper())] = getattr(self, name)
        return weights
