"""What tuned weights gain on streams that the search has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pack_cell.bench.statistics import ci95
from pack_cell.tune.trials import TrialBook
from pack_cell.tune.values import CHECK, Trial, TuneSettings, Weighting


@dataclass(frozen=True)
class Gain:
    """Closed fill before and after, percent, stream by stream."""

    before: tuple[float, ...]
    after: tuple[float, ...]

    @property
    def fill_before(self) -> float:
        """Mean fill of the start."""
        return sum(self.before) / len(self.before)

    @property
    def fill_after(self) -> float:
        """Mean fill of what was found."""
        return sum(self.after) / len(self.after)

    @property
    def points(self) -> float:
        """By how much the fill grew, percentage points."""
        return self.fill_after - self.fill_before

    @property
    def ci95(self) -> float | None:
        """Half width of the 95 % confidence interval of ``points``, by the differences."""
        return ci95([new - old for old, new in zip(self.before, self.after, strict=True)])

    @property
    def verdict(self) -> str:
        """What may be said of it: ``better``, ``maybe better`` or ``no better``."""
        if self.points <= 0:
            return 'no better'
        return 'better' if self.ci95 is not None and self.points > self.ci95 else 'maybe better'


def check(settings: TuneSettings, start: Weighting, found: Weighting, book: TrialBook) -> Gain:
    """Pack the check streams with both."""
    trials = [
        Trial(weights, CHECK, number)
        for number in range(settings.check_streams)
        for weights in (start, found)
    ]
    fills: Sequence[float] = list(book.fills(trials))
    return Gain(tuple(fills[::2]), tuple(fills[1::2]))
