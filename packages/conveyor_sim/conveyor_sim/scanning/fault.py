"""What a fault is: how a box with it differs, at each place of its way to the arm.

A fault says what it does where; who inspects, feeds and moves boxes asks it there and knows no
fault by name. Randomness is an argument, so that equal seeds give equal faults.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

from pack_msgs_py.values import Box


def unchanged(box: Box, rng: random.Random) -> Box:
    """The box as it is."""
    return box


def at_the_first(rng: random.Random) -> int | None:
    """Read at the first scan."""
    return 1


def nowhere_else(rng: random.Random) -> float:
    """Where it is thought to be."""
    return 0.0


@dataclass(frozen=True)
class Fault:
    """A kind of fault; without anything else a box is sound.

    Attributes
    ----------
    name : as in ``--faults``.
    happens, noticed, ends, code : for the table in docs/faults.md, in Markdown: what happens, how
        it is noticed, where the box ends, and the code of that.
    body : the box as it really is.
    read_at : the scan at which it is read; ``None`` when it is not read in
        :data:`conveyor_sim.scanning.inspection.MAX_SCANS`.
    misread : what the first scan makes of the box.
    has_label_of_last : its label is that of the box before.
    touches_next : it is read as one with the box behind it.
    slip_m : how far it lies beside where it is thought to be, metres across the belt; until it is
        scanned again.
    falls : it falls off while the belt moves.
    """

    name: str = ''
    happens: str = ''
    noticed: str = ''
    ends: str = ''
    code: str = ''
    body: Callable[[Box, random.Random], Box] = unchanged
    read_at: Callable[[random.Random], int | None] = at_the_first
    misread: Callable[[Box, random.Random], Box] = unchanged
    has_label_of_last: bool = False
    touches_next: bool = False
    slip_m: Callable[[random.Random], float] = nowhere_else
    falls: bool = False


#: No fault.
SOUND = Fault()
