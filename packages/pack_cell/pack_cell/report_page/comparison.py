"""Several runs beside each other: the same boxes or not, what was set otherwise, what changed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from conveyor_sim.streams import BOXES_FILE, BoxFileError, RejectedRow, read_entries
from pack_cell.bench.statistics import t975
from pack_cell.report_page.run_folder import FinishedRun
from pack_cell.report_page.run_settings import run_settings
from pack_msgs_py.values import Box

#: 97.5 % quantile of the normal distribution, for shares.
_Z = 1.959964


@dataclass(frozen=True)
class Difference:
    """By how much a figure is larger than that of the first run, with its 95 % interval.

    ``low`` and ``high`` are ``None`` where there is too little to tell; ``paired`` says whether
    each box was held against itself.
    """

    value: float
    low: float | None = None
    high: float | None = None
    paired: bool = False

    @property
    def is_shown(self) -> bool:
        """Whether the interval leaves out that there is no difference."""
        return self.low is not None and self.high is not None and not self.low <= 0 <= self.high


def difference_of_means(one: Sequence[float], other: Sequence[float]) -> Difference | None:
    """Of ``other`` to ``one``, by Welch's t interval; ``None`` without values."""
    if not one or not other:
        return None
    value = _mean(other) - _mean(one)
    if min(len(one), len(other)) < 2:
        return Difference(value)
    parts = [_variance(values) / len(values) for values in (one, other)]
    error = math.sqrt(sum(parts))
    if not error:
        return Difference(value, value, value)
    degrees = sum(parts) ** 2 / sum(
        part**2 / (len(values) - 1) for part, values in zip(parts, (one, other), strict=True)
    )
    half = t975(max(1, math.floor(degrees))) * error
    return Difference(value, value - half, value + half)


def difference_of_pairs(pairs: Sequence[tuple[float, float]]) -> Difference | None:
    """Of the second to the first of each pair, by a paired t interval; ``None`` without pairs."""
    if not pairs:
        return None
    changes = [other - one for one, other in pairs]
    value = _mean(changes)
    if len(changes) < 2:
        return Difference(value, paired=True)
    half = t975(len(changes) - 1) * math.sqrt(_variance(changes) / len(changes))
    return Difference(value, value - half, value + half, paired=True)


def difference_of_shares(one: tuple[int, int], other: tuple[int, int]) -> Difference | None:
    """Of two shares, each a count of so many, in percent; Newcombe's interval without correction.

    Newcombe, Interval estimation for the difference between independent proportions, Statistics in
    Medicine 17 (1998), method 10.
    """
    if not one[1] or not other[1]:
        return None
    (p1, l1, u1), (p2, l2, u2) = _wilson(*one), _wilson(*other)
    value = p2 - p1
    low = value - math.hypot(p2 - l2, u1 - p1)
    high = value + math.hypot(u2 - p2, p1 - l1)
    return Difference(100 * value, 100 * low, 100 * high)


def _wilson(count: int, whole: int) -> tuple[float, float, float]:
    """Share and the limits of its interval by Wilson."""
    share, z2 = count / whole, _Z**2
    middle = share + z2 / (2 * whole)
    half = _Z * math.sqrt(share * (1 - share) / whole + z2 / (4 * whole**2))
    return share, (middle - half) / (1 + z2 / whole), (middle + half) / (1 + z2 / whole)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _variance(values: Sequence[float]) -> float:
    mean = _mean(values)
    return sum((value - mean) ** 2 for value in values) / (len(values) - 1)


@dataclass(frozen=True)
class Measure:
    """A figure to compare: its name with the unit, decimals, and how a run gives it.

    ``per_box`` are values by box, ``per_bin`` values that belong to no box, ``share`` a count of so
    many; one of the three is given. ``more_is_better`` says which way is the good one.
    """

    name: str
    digits: int
    more_is_better: bool
    per_box: Callable[[FinishedRun], Mapping[str, float]] | None = None
    per_bin: Callable[[FinishedRun], Sequence[float]] | None = None
    share: Callable[[FinishedRun], tuple[int, int]] | None = None

    def value(self, run: FinishedRun) -> float | None:
        """Of one run: the mean, or the share in percent."""
        if self.share is not None:
            count, whole = self.share(run)
            return 100 * count / whole if whole else None
        values = self._values(run)
        return _mean(values) if values else None

    def difference(self, first: FinishedRun, run: FinishedRun) -> Difference | None:
        """Of ``run`` to ``first``; box by box where most boxes are the same."""
        if self.share is not None:
            return difference_of_shares(self.share(first), self.share(run))
        if self.per_box is not None:
            one, other = self.per_box(first), self.per_box(run)
            common = [name for name in one if name in other]
            if 2 * len(common) > max(len(one), len(other)):
                return difference_of_pairs([(one[name], other[name]) for name in common])
        return difference_of_means(self._values(first), self._values(run))

    def _values(self, run: FinishedRun) -> Sequence[float]:
        if self.per_box is not None:
            return list(self.per_box(run).values())
        return [] if self.per_bin is None else self.per_bin(run)


def _of_boxes(run: FinishedRun, name: str, factor: float = 1.0) -> dict[str, float]:
    values = ((box.id, getattr(box, name)) for box in run.placed)
    return {box_id: factor * value for box_id, value in values if value is not None}


def _robot_s(run: FinishedRun) -> dict[str, float]:
    """Robot time of each placed box, waiting for the belt included."""
    taken = {box.id: (run.cycle_s(box), box.wait_s or 0.0) for box in run.placed}
    return {name: cycle_s + wait_s for name, (cycle_s, wait_s) in taken.items() if cycle_s}


def _first_choices(run: FinishedRun) -> tuple[int, int]:
    asked = run.summary.get('arm_asked') or {}
    count = int(asked.get('decisions_asked') or 0)
    return count - sum((asked.get('first_refusals') or {}).values()), count


MEASURES = (
    Measure(
        'fill of closed bins, %', 1, True,
        per_bin=lambda run: [of_run.fill for of_run in run.closed_bins],
    ),
    Measure(
        'boxes in a closed bin', 1, True,
        per_bin=lambda run: [float(len(of_run.boxes)) for of_run in run.closed_bins],
    ),
    Measure('robot time of a box, s', 2, False, per_box=_robot_s),
    Measure('motion of a box, s', 2, False, per_box=lambda run: _of_boxes(run, 'motion_s')),
    Measure(
        'decision, ms', 1, False, per_box=lambda run: _of_boxes(run, 'planning_s', 1e3),
    ),
    Measure(
        'boxes refused, %', 1, False,
        share=lambda run: (
            sum(box.outcome == 'rejected' for box in run.boxes), len(run.boxes),
        ),
    ),
    Measure('first choices that the arm could do, %', 1, True, share=_first_choices),
    Measure(
        'placed more than the tolerance off, %', 1, False,
        share=lambda run: (
            sum(box.code == 'PLACED_OUT_OF_TOLERANCE' for box in run.placed), len(run.placed),
        ),
    ),
)  # fmt: skip


def settings_that_differ(runs: Sequence[FinishedRun]) -> list[tuple[str, list[str]]]:
    """Options and versions that are not the same in all runs, with what each has."""
    tables = [run_settings(run.folder) | _versions(run) for run in runs]
    names = dict.fromkeys(name for table in tables for name in table)
    rows = [(name, [table.get(name) or '–' for table in tables]) for name in names]
    return [(name, values) for name, values in rows if len(set(values)) > 1]


def _versions(run: FinishedRun) -> dict[str, str]:
    versions = run.summary.get('versions') or {}
    return {f'version of {name}': str(version) for name, version in versions.items()}


def fed_boxes(run: FinishedRun) -> list[tuple[object, ...]] | None:
    """What was fed, in order: names, sizes and weights; ``None`` when it was not written down."""
    try:
        entries = read_entries(run.folder / BOXES_FILE)
    except BoxFileError:
        return None
    return [_identity(entry) for entry in entries if not isinstance(entry, RejectedRow)]


def _identity(box: Box) -> tuple[object, ...]:
    return (box.id, *box.size_mm, box.weight_kg)


def boxes_text(first: FinishedRun, run: FinishedRun) -> str:
    """Whether ``run`` had the boxes of ``first``, in one sentence."""
    one, other = fed_boxes(first), fed_boxes(run)
    if one is None or other is None:
        return f'{run.name}: which boxes were fed is not written down.'
    if one == other:
        return f'{run.name} had the same {len(one)} boxes as {first.name}, in the same order.'
    if sorted(map(str, one)) == sorted(map(str, other)):
        return f'{run.name} had the same {len(one)} boxes as {first.name}, in another order.'
    common = len({*one} & {*other})
    return (
        f'{run.name} had other boxes than {first.name}: {common} of its {len(other)} are the same; '
        'what differs may be the boxes.'
    )


def findings(runs: Sequence[FinishedRun]) -> list[str]:
    """What the comparison shows, a sentence for each figure that differs for sure."""
    first, sentences = runs[0], []
    for run in runs[1:]:
        for measure in MEASURES:
            change = measure.difference(first, run)
            if change is None or not change.is_shown:
                continue
            better = (change.value > 0) == measure.more_is_better
            sentences.append(
                f'{run.name}: {measure.name}: {change.value:+.{measure.digits}f} against '
                f'{first.name}, which is {"better" if better else "worse"}.'
            )
    return sentences


def measured(runs: Sequence[FinishedRun]) -> list[dict[str, Any]]:
    """The rows of the table: name, a value per run, and the differences to the first run."""
    rows = []
    for measure in MEASURES:
        values = [measure.value(run) for run in runs]
        changes = [measure.difference(runs[0], run) for run in runs[1:]]
        cells = [_change_text(change, measure) for change in changes]
        shown = [None if value is None else f'{value:.{measure.digits}f}' for value in values]
        if any(text is not None for text in shown):
            rows.append({'name': measure.name, 'values': shown, 'changes': cells})
    return rows


def _change_text(change: Difference | None, measure: Measure) -> tuple[str, str]:
    """The difference with its interval, and ``good``, ``bad`` or nothing."""
    if change is None:
        return '–', ''
    digits = measure.digits
    if change.low is None or change.high is None:
        return f'{change.value:+.{digits}f}', ''
    text = f'{change.value:+.{digits}f} [{change.low:+.{digits}f}, {change.high:+.{digits}f}]'
    if not change.is_shown:
        return text, ''
    return text, 'good' if (change.value > 0) == measure.more_is_better else 'bad'
