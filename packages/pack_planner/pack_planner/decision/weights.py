"""Weights of eq. (1) for each kind of bin, and how they are written as text."""

from __future__ import annotations

from dataclasses import dataclass, field

from pack_msgs_py.values import BinSpec, parse_bin
from pack_planner.engine import Weights

#: How weights are written where they are an option or a parameter.
DEFAULT_WEIGHTS = '1,1,100'


@dataclass(frozen=True)
class WeightTable:
    """Weights of eq. (1) of Ojha et al.; their remark 1 wants them by the shape of the bin.

    ``by_kind`` pairs names of bin kinds with weights; any other kind gets ``general``.
    """

    general: Weights = field(default_factory=Weights)
    by_kind: tuple[tuple[str, Weights], ...] = ()

    def of(self, spec: BinSpec) -> Weights:
        """The weights for bins of this kind."""
        return dict(self.by_kind).get(spec.name, self.general)

    def every(self) -> tuple[Weights, ...]:
        """All weights of the table, each once."""
        return tuple(dict.fromkeys((self.general, *(weights for _, weights in self.by_kind))))


def parse_weights(text: str) -> WeightTable:
    """Turn ``'1,1,100'`` or ``'1,1,100 RC:2,1,100'`` into a table.

    Each entry is w1,w2,w3, for one kind of bin (as :func:`pack_msgs_py.values.parse_bin` takes it)
    or for all others.

    Raises
    ------
    ValueError
        An entry is no three numbers, a weight is not finite, negative or huge, a kind of bin is
        unknown, or there are two entries for the same.
    """
    by_kind: dict[str, Weights] = {}
    for entry in text.split():
        kind, colon, numbers = entry.rpartition(':')
        name = parse_bin(kind).name if colon else ''
        try:
            first, second, third = (float(part) for part in numbers.split(','))
        except ValueError:
            msg = (
                f'weights {entry!r} are not w1,w2,w3 such as {DEFAULT_WEIGHTS}, '
                'or RC:2,1,100 for one kind of bin'
            )
            raise ValueError(msg) from None
        if name in by_kind:
            what = f'for {name} bins' if name else 'for all bins'
            msg = f'weights {text!r} name weights {what} twice'
            raise ValueError(msg)
        by_kind[name] = Weights(first, second, third)
    if not by_kind:
        msg = f'weights are empty; use w1,w2,w3 such as {DEFAULT_WEIGHTS}'
        raise ValueError(msg)
    general = by_kind.pop('', Weights())
    return WeightTable(general, tuple(by_kind.items()))
