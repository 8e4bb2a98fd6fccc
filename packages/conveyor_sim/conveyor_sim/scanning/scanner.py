"""The scanner: what it makes of a box. The true box stays with the physics (docs/scanner.md).

A reading is a function of seed, place in the stream, and attempt: a restart changes nothing.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace

from pack_msgs_py.values import Box

#: Sizes and weights come in steps of this, millimetres and kilograms.
_STEP_MM, _STEP_KG = 0.1, 0.001
#: No measurement is off by more than so many standard deviations: what is, the scanner discards.
_CUT_OFF = 4.0
_LEAST_MM = 1.0


@dataclass(frozen=True)
class ScannerNoise:
    """Standard deviations of what the scanner says; all 0 for a scanner that is always right.

    Attributes
    ----------
    size_mm : of each edge.
    weight_kg : of the weight.
    yaw_deg : of the angle at which the box lies, which the scanner takes for 0.
    """

    size_mm: float = 0.0
    weight_kg: float = 0.0
    yaw_deg: float = 0.0


class Scanner:
    """Measures boxes with ``noise``."""

    def __init__(self, noise: ScannerNoise | None = None, seed: int = 0) -> None:
        self.noise = noise or ScannerNoise()
        self._seed = seed

    def measure(self, box: Box, ordinal: int, attempt: int = 1) -> Box:
        """``box`` as measured, with the deviation that such a measurement has."""
        noise, rng = self.noise, self._rng(ordinal, attempt)
        sizes, weight = box.size_mm, box.weight_kg
        if noise.size_mm:
            x, y, z = (
                max(_LEAST_MM, _stepped(edge + _error(rng, noise.size_mm), _STEP_MM))
                for edge in sizes
            )
            sizes = (x, y, z)
        if noise.weight_kg:
            weight = max(_STEP_KG, _stepped(weight + _error(rng, noise.weight_kg), _STEP_KG))
        limits = tuple(edge / 2 for edge in sizes)
        com = tuple(
            max(-limit, min(limit, offset))
            for offset, limit in zip(box.com_offset_mm, limits, strict=True)
        )
        return replace(
            box,
            size_mm=sizes,
            weight_kg=weight,
            com_offset_mm=(com[0], com[1], com[2]),
            size_stddev_mm=(noise.size_mm,) * 3,
            yaw_stddev_rad=math.radians(noise.yaw_deg),
        )

    def yaw_rad(self, ordinal: int, attempt: int = 1) -> float:
        """At what angle the box really lies."""
        if not self.noise.yaw_deg:
            return 0.0
        return math.radians(_error(self._rng(ordinal, attempt, 'yaw'), self.noise.yaw_deg))

    def _rng(self, *about: object) -> random.Random:
        return random.Random('/'.join(map(str, (self._seed, 'scan', *about))))


def _error(rng: random.Random, sigma: float) -> float:
    return max(-_CUT_OFF * sigma, min(_CUT_OFF * sigma, rng.gauss(0.0, sigma)))


def _stepped(value: float, step: float) -> float:
    return round(round(value / step) * step, 6)
