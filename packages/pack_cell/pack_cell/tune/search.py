"""The search for weights: CMA-ES, each generation on streams of its own.

CMA-ES (Hansen, The CMA evolution strategy: a tutorial, arXiv:1604.00772) draws points from a normal
distribution that it moves towards those that turned out best, so it needs only an order. All points
of a generation, and the start beside them, pack the same streams, so that the luck of a stream is
nobody's advantage; the next generation packs others, so that nothing is learned by heart. The
middle of the distribution is the result.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from pack_cell.tune.space import WeightSpace
from pack_cell.tune.trials import TrialBook
from pack_cell.tune.values import TRAINING, Trial, TuneSettings, Weighting


@dataclass(frozen=True)
class Generation:
    """What came of a generation.

    Attributes
    ----------
    number : from 1.
    evaluations : candidates so far, of all generations.
    start_fill : what the start fills on the streams of this generation, percent.
    mean_gain, best_gain : by how many points the candidates fill more, on average and at most.
    step : mean standard deviation of the candidates along the axes of the unit cube; it shrinks as
        the search settles.
    """

    number: int
    evaluations: int
    start_fill: float
    mean_gain: float
    best_gain: float
    step: float


@dataclass(frozen=True)
class Limits:
    """When to stop: after so many ``evaluations`` in all, or when ``clock`` is past ``until_s``."""

    evaluations: int | None = None
    until_s: float | None = None
    clock: Callable[[], float] = time.monotonic

    def are_reached(self, evaluations: int) -> bool:
        """Whether no further generation may begin."""
        enough = self.evaluations is not None and evaluations >= self.evaluations
        return enough or self.time_is_up()

    def time_is_up(self) -> bool:
        """Whether a generation under way is to be left."""
        return self.until_s is not None and self.clock() >= self.until_s


@dataclass(frozen=True)
class SearchOutcome:
    """What the search ended with: the middle of its distribution, and all its generations."""

    weights: Weighting
    generations: tuple[Generation, ...]


def search(
    settings: TuneSettings,
    space: WeightSpace,
    book: TrialBook,
    limits: Limits,
    progress: Callable[[Generation], None],
) -> SearchOutcome:
    """Search ``space`` until ``limits`` end it; a generation that time cuts short does not count.

    ``progress`` is told of each generation. With the same settings it takes the same way, so that
    what ``book`` has from an earlier run is not packed again.
    """
    bounds = np.tile((0.0, 1.0), (len(space.names), 1))
    optimizer = CMA(mean=space.first, sigma=settings.step, bounds=bounds, seed=settings.seed)
    generations: list[Generation] = []
    evaluations = 0
    while not limits.are_reached(evaluations):
        points = [optimizer.ask() for _ in range(optimizer.population_size)]
        candidates = [space.start, *(space.weights(point) for point in points)]
        fills = _fills(settings, candidates, len(generations), book, limits)
        if fills is None:
            break
        optimizer.tell([
            (point, -fill) for point, fill in zip(points, fills[1:], strict=True)
        ])  # fmt: skip
        evaluations += len(points)
        gains = fills[1:] - fills[0]
        generations.append(
            Generation(
                len(generations) + 1, evaluations, float(fills[0]), float(gains.mean()),
                float(gains.max()), float(np.std(points, axis=0).mean()),
            )
        )  # fmt: skip
        progress(generations[-1])
    weights = space.weights(optimizer.mean) if generations else space.start
    return SearchOutcome(weights, tuple(generations))


def _fills(
    settings: TuneSettings,
    candidates: list[Weighting],
    generation: int,
    book: TrialBook,
    limits: Limits,
) -> NDArray[np.float64] | None:
    """Mean fill of each of ``candidates``, (n,); ``None`` when time is up before all are packed."""
    first = generation * settings.streams
    trials = [
        Trial(weights, TRAINING, number)
        for weights in candidates
        for number in range(first, first + settings.streams)
    ]
    fills: list[float] = []
    with closing(book.fills(trials)) as made:
        for fill in made:
            fills.append(fill)
            if limits.time_is_up() and len(fills) < len(trials):
                return None
    means: NDArray[np.float64] = np.array(fills).reshape(-1, settings.streams).mean(axis=1)
    return means
