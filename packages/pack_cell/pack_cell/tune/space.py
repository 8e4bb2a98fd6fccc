"""The space that is searched: which weights, between which limits, and points of it as weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pack_cell.tune.values import Weighting

#: Limits of the weights of :class:`pack_planner.algorithms.waste_weights.WasteWeights`. Only their
#: ratios count, so that ``touched`` stays as it is, as the unit of the others.
LIMITS = {
    'lost': (0.0, 3.0),
    'level': (-0.5, 2.0),
    'spread': (-0.6, 1.2),
    'younger': (0.0, 4.0),
    'large_first': (0.0, 4.0),
    'no_place': (0.0, 16.0),
    'snug': (-0.5, 1.5),
    'near_mm': (20.0, 160.0),
    'level_mm': (0.0, 30.0),
    'hollow': (0.0, 2.0),
    'above': (0.0, 2.5),
    'beside': (0.0, 1.5),
    'tall': (-1.0, 1.5),
    'slender': (-0.3, 0.5),
    'shut_off': (0.0, 4.0),
    'choices': (1.0, 6.0),
    'room': (0.0, 2.0),
    'late': (0.0, 0.5),
}
UNIT = 'touched'

#: Significant digits of a weight: more are noise, and a file is to be read by people.
_DIGITS = 4


class WeightSpace:
    """Points of the unit cube, and the weights that they stand for.

    Parameters
    ----------
    start : a dataclass of weights. Numbers with a fraction are searched, all else stays.
    only : names of those to search; empty for all of them.

    Attributes
    ----------
    names : of the weights that are searched, one for each axis.

    Raises
    ------
    ValueError
        One of ``only`` is not the name of such a weight.
    """

    def __init__(self, start: Any, only: Sequence[str] = ()) -> None:  # noqa: ANN401 - a dataclass of any algorithm
        self.start: Weighting = tuple(asdict(start).items())
        values = {
            name: value for name, value in self.start if isinstance(value, float) and name != UNIT
        }
        for name in only:
            if name not in values:
                msg = f'no weight {name!r} to search: use some of {", ".join(values)}'
                raise ValueError(msg)
        values = {name: value for name, value in values.items() if name in (only or values)}
        limits = [LIMITS.get(name, _around(value)) for name, value in values.items()]
        self.names = tuple(values)
        self._low = np.array([low for low, _ in limits])
        self._span = np.array([high - low for low, high in limits])
        point = (np.array(list(values.values())) - self._low) / self._span
        #: The start as a point, (n,), inside the cube.
        self.first: NDArray[np.float64] = point.clip(0.02, 0.98)

    def weights(self, point: NDArray[np.float64]) -> Weighting:
        """The weights at ``point``, (n,), rounded."""
        found = dict(zip(self.names, self._low + self._span * point, strict=True))
        return tuple(
            (name, float(f'{found[name]:.{_DIGITS}g}') if name in found else value)
            for name, value in self.start
        )


def _around(value: float) -> tuple[float, float]:
    """Limits of a weight that has none of its own."""
    reach = 1.5 * max(1.0, abs(value))
    return (value - reach, value + reach)
