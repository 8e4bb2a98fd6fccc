"""A run as its folder holds it, read for the report."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pack_msgs_py.orientation import ORIENTATIONS, oriented_size
from pack_msgs_py.values import BinSpec, Int3, Vec3, parse_bin


class ReportError(ValueError):
    """A folder that no report can be made of; the message says which file, and what is wrong."""


#: Attributes by which people know a box.
ARTICLE_KEYS = ('sku', 'order_id', 'barcode')


@dataclass(frozen=True)
class RunBox:
    """A box of a run: a row of ``placements.jsonl``.

    Lengths are millimetres, times seconds. ``size_mm`` is the true size as far as it is known, else
    the scanned one; ``None`` when it was never scanned. What did not come to pass is ``None``.
    ``attributes`` is what others know of it, such as its `sku`.
    """

    id: str
    outcome: str
    size_mm: Vec3 | None = None
    weight_kg: float | None = None
    destination: str = ''
    serial: int | None = None
    corner_mm: Int3 | None = None
    placed_size_mm: Int3 | None = None
    orientation: str = 'xyz'
    measured_mm: Vec3 | None = None
    planning_s: float | None = None
    check_s: float | None = None
    arm_planning_s: float | None = None
    wait_s: float | None = None
    motion_s: float | None = None
    slack_s: float | None = None
    stamp_s: float | None = None
    code: str | None = None
    reason: str | None = None
    attributes: Mapping[str, str] = field(default_factory=dict)

    @property
    def article(self) -> str:
        """What others call it: article, order and barcode, as far as they are known."""
        return ', '.join(filter(None, map(self.attributes.get, ARTICLE_KEYS)))

    @property
    def volume_mm3(self) -> float:
        """By true size; 0 when no size is known."""
        return math.prod(self.size_mm) if self.size_mm else 0.0


@dataclass(frozen=True)
class InBin:
    """A box in its bin: ``step`` counts from 1 in the order of placing.

    ``corner_mm`` is the planned corner nearest the bin's origin, ``size_mm`` the true edges along
    the bin's axes, ``seen_mm`` the corner by the measured centre, as far as there is one.
    """

    step: int
    box: RunBox
    corner_mm: Int3
    size_mm: Vec3
    seen_mm: Vec3


@dataclass(frozen=True)
class RunBin:
    """A bin of a run with its boxes in the order of placing.

    ``closed`` is ``None`` where the run did not write it down, ``why_closed`` empty likewise.
    """

    serial: int
    spec: BinSpec
    destination: str
    boxes: tuple[InBin, ...]
    closed: bool | None = None
    why_closed: str = ''

    @property
    def name(self) -> str:
        """As the cell calls it."""
        return f'{self.spec.name}-{self.serial}'

    @property
    def fill(self) -> float:
        """Percent of the inner volume, by true sizes."""
        return 100 * sum(placed.box.volume_mm3 for placed in self.boxes) / self.spec.volume_mm3

    @property
    def weight_kg(self) -> float:
        """Of all boxes inside."""
        return sum(placed.box.weight_kg or 0.0 for placed in self.boxes)


@dataclass(frozen=True)
class FinishedRun:
    """What the folder of a run says; ``boxes`` in the order in which they came to their end."""

    folder: Path
    summary: Mapping[str, Any]
    boxes: Sequence[RunBox]
    bins: Sequence[RunBin]

    @property
    def name(self) -> str:
        """Of the folder."""
        return self.folder.name

    @cached_property
    def placed(self) -> list[RunBox]:
        """The boxes that lie in a bin, in the order of placing."""
        return [box for box in self.boxes if box.outcome == 'placed' and box.serial is not None]

    @property
    def closed_bins(self) -> list[RunBin]:
        """The bins of which it is known that they were closed."""
        return [of_run for of_run in self.bins if of_run.closed]

    def cycle_s(self, box: RunBox) -> float | None:
        """What a box took of its deadline: planning that no motion hid, and motion."""
        deadline_s = self.summary.get('deadline_s')
        if box.slack_s is None or deadline_s is None:
            return None
        return float(deadline_s) - box.slack_s

    @cached_property
    def ends_s(self) -> dict[str, float]:
        """Robot time at which each placed box was in its bin, seconds, from the first one on."""
        ends, now_s = {}, 0.0
        for box in self.placed:
            now_s += (self.cycle_s(box) or 0.0) + (box.wait_s or 0.0)
            ends[box.id] = now_s
        return ends


def read_run(folder: Path) -> FinishedRun:
    """Read ``summary.json`` and ``placements.jsonl``.

    Raises
    ------
    ReportError
        One of the two is missing or damaged.
    """
    summary = _object(_text(folder / 'summary.json'), folder / 'summary.json')
    rows = list(_lines(folder / 'placements.jsonl'))
    boxes = [_of_row(row, _box, place) for place, row in rows]
    if all(box.stamp_s is not None for box in boxes if box.outcome != 'on_belt'):
        boxes.sort(key=lambda box: math.inf if box.stamp_s is None else box.stamp_s)
    inside: dict[int, list[RunBox]] = {}
    for box in boxes:
        if box.serial is not None:
            inside.setdefault(box.serial, []).append(box)
    kinds = {row['bin_serial']: row for _, row in rows if row['bin_serial'] is not None}
    closings = _closings(summary, folder)
    bins = [
        _bin(serial, kinds[serial], inside[serial], closings, folder) for serial in sorted(kinds)
    ]
    return FinishedRun(folder, summary, boxes, bins)


def _closings(summary: Mapping[str, Any], folder: Path) -> dict[str, str] | None:
    """Why each closed bin was closed, by its name; ``None`` where it was not written down."""
    rows = summary.get('closings')
    if rows is None:
        return None
    try:
        return {str(row['bin']): str(row.get('reason') or '') for row in rows}
    except (AttributeError, KeyError, TypeError) as error:
        msg = f'{folder}/summary.json is damaged: closings: {type(error).__name__} {error}'
        raise ReportError(msg) from None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else 'it is no text'
        msg = f'{path.parent} is no folder of a finished run: {path.name}: {why}'
        raise ReportError(msg) from None


def _object(text: str, place: object) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except ValueError as error:
        msg = f'{place} is damaged: {error}'
        raise ReportError(msg) from None
    if not isinstance(value, dict):
        msg = f'{place} is damaged: it must hold an object'
        raise ReportError(msg)
    return value


def _lines(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    for number, line in enumerate(_text(path).splitlines(), start=1):
        if line.strip():
            place = f'{path}, line {number}'
            yield place, _object(line, place)


def _of_row(row: dict[str, Any], read: Any, place: str) -> Any:  # noqa: ANN401 - what `read` gives
    try:
        return read(row)
    except (KeyError, TypeError, ValueError) as error:
        msg = f'{place} is damaged: {type(error).__name__} {error}'
        raise ReportError(msg) from None


def _box(row: Mapping[str, Any]) -> RunBox:
    orientation = row.get('orientation') or 'xyz'
    if orientation not in ORIENTATIONS:
        msg = f'orientation {orientation!r}'
        raise ValueError(msg)
    return RunBox(
        id=str(row['box_id']),
        outcome=str(row['outcome']),
        size_mm=_three(row.get('true_size_mm') or row.get('size_mm')),
        weight_kg=_number(row, 'weight_kg'),
        destination=str(row.get('destination') or ''),
        serial=None if row['bin_serial'] is None else int(row['bin_serial']),
        corner_mm=_whole(_three(row['position_mm'])),
        placed_size_mm=_whole(_three(row['placed_size_mm'])),
        orientation=orientation,
        measured_mm=_three(row.get('measured_position_mm')),
        **{name: _number(row, name) for name in _TIMES},
        code=row.get('code'),
        reason=row.get('reason'),
        attributes={str(key): str(text) for key, text in (row.get('attributes') or {}).items()},
    )


_TIMES = (
    'planning_s', 'check_s', 'arm_planning_s', 'wait_s', 'motion_s', 'slack_s', 'stamp_s',
)  # fmt: skip


def _number(row: Mapping[str, Any], name: str) -> float | None:
    value = row.get(name)
    return None if value is None else float(value)


def _three(values: Sequence[float] | None) -> Vec3 | None:
    if values is None:
        return None
    x, y, z = values
    return (float(x), float(y), float(z))


def _whole(values: Vec3 | None) -> Int3 | None:
    return None if values is None else (round(values[0]), round(values[1]), round(values[2]))


def _bin(
    serial: int,
    row: Mapping[str, Any],
    inside: Sequence[RunBox],
    closings: Mapping[str, str] | None,
    folder: Path,
) -> RunBin:
    """The bin ``serial`` with the boxes ``inside``; ``row`` is that of one of them."""
    try:
        spec = parse_bin(row['bin_type'])
    except (AttributeError, KeyError, ValueError) as error:
        msg = f'{folder}: bin {serial} is damaged: {error}'
        raise ReportError(msg) from None
    boxes = tuple(_in_bin(step, box) for step, box in enumerate(inside, start=1))
    of_run = RunBin(serial, spec, str(row.get('bin_destination') or ''), boxes)
    if closings is None:
        return of_run
    closed = of_run.name in closings
    return replace(of_run, closed=closed, why_closed=closings.get(of_run.name, ''))


def _in_bin(step: int, box: RunBox) -> InBin:
    if box.corner_mm is None or box.placed_size_mm is None:
        msg = f'box {box.id!r} is in bin {box.serial} without a position'
        raise ReportError(msg)
    size = oriented_size(box.size_mm or box.placed_size_mm, box.orientation)
    if box.size_mm is None:
        size = box.placed_size_mm
    if box.measured_mm is None:
        return InBin(step, box, box.corner_mm, size, box.corner_mm)
    x, y, z = (m - s / 2 for m, s in zip(box.measured_mm, size, strict=True))
    return InBin(step, box, box.corner_mm, size, (x, y, z))
