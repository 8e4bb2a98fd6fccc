"""What goes wrong with boxes on the way to the arm: which box, by seed; docs/faults.md tells more.

At most one fault befalls a box, and always the same one for equal seeds.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

from conveyor_sim.ledger.ledger import INSERTED_FROM
from pack_msgs_py.values import Box

#: Of the boxes that could not be read, so many cannot be read the second time either.
STILL_UNREAD = 0.5
#: A box is scanned so often before it goes to the reject lane.
MAX_SCANS = 2
#: A grasp that failed so soon after a scan was still made for the one before, seconds.
OLD_NEWS_S = 0.5


class Fault(str, Enum):
    """Kinds of faults, by the names of ``--faults``."""

    NO_READ = 'no_read'
    WRONG_SIZE = 'wrong_size'
    TOUCHING = 'touching'
    OVERSIZE = 'oversize'
    OVERWEIGHT = 'overweight'
    DAMAGED = 'damaged'
    EMPTY_PICK = 'empty_pick'
    DUPLICATE_ID = 'duplicate_id'
    FALLEN = 'fallen'


def parse_faults(text: str) -> dict[Fault, float]:
    """Turn ``'no_read=0.01,touching=0.005'`` into rates; ``all=0.01`` stands for every fault.

    What is named later wins. Empty for none.

    Raises
    ------
    ValueError
        A name or a rate is wrong, or the rates add up to more than 1.
    """
    rates: dict[Fault, float] = {}
    known = [fault.value for fault in Fault]
    for item in filter(None, text.split(',')):
        name, _, value = (part.strip() for part in item.partition('='))
        if name != 'all' and name not in known:
            msg = f'unknown fault {name!r}: use all, {", ".join(known)}'
            raise ValueError(msg)
        try:
            rate = float(value)
        except ValueError:
            rate = math.nan
        if not 0.0 <= rate <= 1.0:
            msg = f'rate of fault {name} is {value!r}; it must be a number from 0 to 1'
            raise ValueError(msg)
        rates |= dict.fromkeys(Fault if name == 'all' else (Fault(name),), rate)
    if sum(rates.values()) > 1.0:
        msg = (
            f'the rates of faults add up to {sum(rates.values()):g}; at most 1 of 1 boxes can fail'
        )
        raise ValueError(msg)
    return rates


class FaultPlan:
    """Says which fault befalls the box at a place of the stream."""

    def __init__(self, rates: Mapping[Fault, float] | None = None, seed: int = 0) -> None:
        self._rates = {fault: rate for fault, rate in (rates or {}).items() if rate > 0}
        self._seed = seed

    @property
    def key(self) -> str:
        """Equal for plans that say the same."""
        rates = ','.join(f'{fault.value}={rate!r}' for fault, rate in self._rates.items())
        return f'{rates};{self._seed}' if rates else ''

    def of(self, ordinal: int) -> Fault | None:
        """The fault of the box at ``ordinal``, from 0; those laid on by hand have none."""
        if not self._rates or ordinal >= INSERTED_FROM:
            return None
        draw = self._rng(ordinal).random()
        for fault, rate in self._rates.items():
            draw -= rate
            if draw < 0:
                return fault
        return None

    def unread(self, ordinal: int, attempt: int) -> bool:
        """Whether the scanner fails to read a box with the fault ``NO_READ``."""
        return attempt == 1 or self._rng(ordinal, attempt).random() < STILL_UNREAD

    def body(self, box: Box, ordinal: int) -> Box:
        """The box as it really is: uglies, overweight and damaged ones are what they are."""
        fault, rng = self.of(ordinal), self._rng(ordinal, 'body')
        _, y, z = box.size_mm
        if fault is Fault.OVERSIZE:
            return replace(box, size_mm=(float(round(rng.uniform(700.0, 1100.0))), y, z))
        if fault is Fault.OVERWEIGHT:
            return replace(box, weight_kg=round(rng.uniform(22.0, 60.0), 1))
        if fault is Fault.DAMAGED:
            return replace(box, max_top_load_n=0.0)
        return box

    def misread(self, box: Box, ordinal: int) -> Box:
        """What the scanner makes of a box with the fault ``WRONG_SIZE``: one edge is far off."""
        rng = self._rng(ordinal, 'misread')
        edges = list(box.size_mm)
        factor = rng.uniform(0.6, 0.8) if rng.random() < 0.5 else rng.uniform(1.25, 1.5)
        axis = rng.randrange(3)
        edges[axis] = round(edges[axis] * factor, 1)
        return replace(box, size_mm=(edges[0], edges[1], edges[2]))

    def slip_m(self, ordinal: int) -> float:
        """How far a box with the fault ``EMPTY_PICK`` lies beside where it is thought to be."""
        return self._rng(ordinal, 'slip').choice((-1.0, 1.0)) * 0.6

    def _rng(self, *about: object) -> random.Random:
        return random.Random('/'.join(map(str, (self._seed, 'fault', *about))))


def joint(first: Box, second: Box) -> Box:
    """Two boxes, one behind the other, as a scanner sees them that reads them as one."""
    (x, y, z), (x2, y2, z2) = first.size_mm, second.size_mm
    return replace(
        first,
        size_mm=(max(x, x2), y + y2, max(z, z2)),
        weight_kg=first.weight_kg + second.weight_kg,
        com_offset_mm=(0.0, 0.0, 0.0),
    )
