"""What a user may choose beside algorithm, rules and weights; the same for node and benchmark."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: In which order OPack packs the look-ahead virtually (SORT of Ojha et al., section III-B).
SORTS = ('volume', 'area', 'height', 'arrival')

#: Which of the boxes that could be placed is placed (sections III-A.3 and III-B of the paper).
SELECTIONS = ('auto', 'least_increase', 'least_growth', 'large_when_empty', 'largest', 'nearest')

#: Which bin is closed when nothing fits.
CLOSINGS = ('fullest', 'oldest', 'least_useful')

#: More decisions than any box waits in a run.
MOST_PASSED_OVER = 1_000_000


@dataclass(frozen=True)
class DecisionOptions:
    """How to decide, beyond algorithm, rules and weights; the defaults are the paper's.

    Attributes
    ----------
    cep : constraints for efficient packing, for `mpack` and `mpack_lite`; see
        :mod:`pack_planner.engine.contact`.
    sort : SORT of OPack, see :func:`pack_planner.algorithms.opack.sorted_boxes`.
    selection : box selection of OPack and MPack, see :mod:`pack_planner.algorithms.selection`;
        ``auto`` is ``least_growth`` for `mpack` and ``least_increase`` for OPack.
    large_until : fill rate, 0 to 1, below which ``large_when_empty`` takes the largest box.
    closing : which bin is closed when nothing fits, see :mod:`pack_planner.decision.bin_closing`.
    max_passed_over : how often a box may be passed over before it must be next; 0 for no limit.
    """

    cep: bool = False
    sort: str = 'volume'
    selection: str = 'auto'
    large_until: float = 0.5
    closing: str = 'fullest'
    max_passed_over: int = 0

    def __post_init__(self) -> None:
        for name, value, known in (
            ('sort', self.sort, SORTS),
            ('selection', self.selection, SELECTIONS),
            ('closing', self.closing, CLOSINGS),
        ):
            if value not in known:
                msg = f'unknown {name} {value!r}: use one of {", ".join(known)}'
                raise ValueError(msg)
        if not math.isfinite(self.large_until) or not 0 <= self.large_until <= 1:
            msg = f'large_until is {self.large_until}; it must be a fill rate from 0 to 1'
            raise ValueError(msg)
        if not 0 <= self.max_passed_over <= MOST_PASSED_OVER:
            msg = (
                f'max_passed_over is {self.max_passed_over}; it must be 0 (no limit) '
                f'to {MOST_PASSED_OVER}'
            )
            raise ValueError(msg)
