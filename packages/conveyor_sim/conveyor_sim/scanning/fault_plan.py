"""Which fault befalls which box: by rate and seed, at most one, always the same for equal seeds."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping

from conveyor_sim.ledger.ledger import INSERTED_FROM
from conveyor_sim.scanning.fault import Fault
from conveyor_sim.scanning.faults import FAULTS, fault_names


def parse_faults(text: str) -> dict[Fault, float]:
    """Turn ``'no_read=0.01,touching=0.005'`` into rates; ``all=0.01`` stands for every fault.

    What is named later wins. Empty for none.

    Raises
    ------
    ValueError
        A name or a rate is wrong, or the rates add up to more than 1.
    """
    rates: dict[Fault, float] = {}
    by_name = {fault.name: (fault,) for fault in FAULTS} | {'all': FAULTS}
    for item in filter(None, text.split(',')):
        name, _, value = (part.strip() for part in item.partition('='))
        if name not in by_name:
            msg = f'unknown fault {name!r}: use all, {fault_names()}'
            raise ValueError(msg)
        try:
            rate = float(value)
        except ValueError:
            rate = math.nan
        if not 0.0 <= rate <= 1.0:
            msg = f'rate of fault {name} is {value!r}; it must be a number from 0 to 1'
            raise ValueError(msg)
        rates |= dict.fromkeys(by_name[name], rate)
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
        rates = ','.join(f'{fault.name}={rate!r}' for fault, rate in self._rates.items())
        return f'{rates};{self._seed}' if rates else ''

    def of(self, ordinal: int) -> Fault | None:
        """The fault of the box at ``ordinal``, from 0; those laid on by hand have none."""
        if not self._rates or ordinal >= INSERTED_FROM:
            return None
        draw = self.rng(ordinal).random()
        for fault, rate in self._rates.items():
            draw -= rate
            if draw < 0:
                return fault
        return None

    def rng(self, *about: object) -> random.Random:
        """Chance in what happens to a box: the same whenever it is ``about`` the same."""
        return random.Random('/'.join(map(str, (self._seed, 'fault', *about))))
