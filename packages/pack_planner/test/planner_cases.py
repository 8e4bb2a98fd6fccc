"""Boxes, bins and profiles that several tests share."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache

from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.engine import Engine

SMALL = BinSpec('60x40x40', (600, 400, 400))


@cache
def engine_of(profile: Profile) -> Engine:
    """The engine of this profile: one for all tests of a process, built when first asked for."""
    return Engine(profile)


class Engines(Mapping[str, Engine]):
    """Engines by name, none of which is built by importing the test that lists them."""

    def __init__(self, profiles: Mapping[str, Profile]) -> None:
        self._profiles = profiles

    def __getitem__(self, name: str) -> Engine:
        return engine_of(self._profiles[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._profiles)

    def __len__(self) -> int:
        return len(self._profiles)


def random_box(rng: random.Random, name: str, *, low: int = 60, high: int = 280) -> Box:
    """A box of whole centimetres more often than not, so that tops meet at equal heights."""
    step = rng.choice((10, 10, 20, 50, 7))
    size = [rng.randrange(low, high, step) for _ in range(3)]
    return Box(
        name,
        (float(size[0]), float(size[1]), float(size[2])),
        weight_kg=rng.choice((0.5, 2.0, 8.0)),
        com_offset_mm=(rng.choice((0.0, 0.0, 12.5, -20.0)), rng.choice((0.0, 0.0, 9.0)), 0.0),
        allowed_up=rng.choice((63, 63, 63, 48, 60)),
        max_top_load_n=rng.choice((None, None, None, 0.0, 30.0, 120.0)),
    )


def coarse(name: str, resolution_mm: int, **changes: object) -> Profile:
    """A profile on a coarser or finer grid."""
    return replace(PROFILES[name], resolution_mm=resolution_mm, **changes)  # type: ignore[arg-type]


def random_bin(engine: Engine, rng: random.Random, count: int, name: str = 'bin-1') -> Bin:
    """A stack of boxes, each placed well or, now and then, wherever a refused zone drives it."""
    current = Bin(name, 1, SMALL)
    for index in range(count):
        box = random_box(rng, f'{name}-{index}')
        candidate = engine.best_placement(box, [engine.model(current)])
        if candidate is not None:
            current = replace(
                current, boxes=(*current.boxes, candidate.placed), revision=current.revision + 1
            )
    return current
