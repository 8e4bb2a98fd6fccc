"""Pack one collection as :mod:`pack_planner.packing.loop` does, and write down what happens."""

from __future__ import annotations

import time
from dataclasses import replace

from pack_cell.bench.streams import collection, destination
from pack_cell.bench.values import BenchSettings, Case, JsonObject, Packed
from pack_msgs_py.metrics import fill_metrics
from pack_msgs_py.values import Bin, Box
from pack_planner.algorithms import find_algorithm
from pack_planner.decision.policy import PolicySettings
from pack_planner.packing.loop import ClosedBin, PackedBox, PackingLoop, PackingTask, UnplacedBox

#: Boxes on a circular belt of 9 m (Ojha et al., section II), one every 45 cm.
BELT_BOXES = 20


def pack_collection(case: Case, settings: BenchSettings, number: int) -> Packed:
    """Pack collection ``number`` of ``case``.

    Raises
    ------
    EngineMismatch
        A placement breaks a packing rule; every one is held against the slow rules.
    """
    boxes = collection(case, settings, number)
    loop = PackingLoop(boxes, _task(case, settings, number))
    record = _Record(case, settings, number)
    for event in loop:
        if isinstance(event, PackedBox):
            record.place(event)
        elif isinstance(event, ClosedBin):
            record.close(event)
        else:
            record.leave_out(event)
    return Packed(
        boxes=len(boxes) + len(record.rejected),
        events=tuple(record.events),
        unplaced=(*record.rejected, *record.unplaced),
        fills=fill_metrics(loop.closed_bins, loop.open_bins),
        closed_bins=len(loop.closed_bins),
        gaps=tuple(record.gaps),
    )


def _task(case: Case, settings: BenchSettings, number: int) -> PackingTask:
    count, bins = settings.destinations, range(settings.open_bins)
    return PackingTask(
        case.bin_spec,
        PolicySettings(
            find_algorithm(case.algorithm, case.digest), settings.profile, settings.weights,
            settings.budget_s, settings.node_limit, case.backend,
            replace(settings.options, cep=case.cep), settings.tuned,
        ),
        case.look_ahead,
        tuple(destination(index % count) if count else '' for index in bins),
        BELT_BOXES if count > settings.open_bins else 0,
        str(number),
        time.thread_time if settings.cpu_clock else time.perf_counter,
    )  # fmt: skip


class _Record:
    """Lines of the plan of one collection."""

    def __init__(self, case: Case, settings: BenchSettings, number: int) -> None:
        self._number = number
        self._sorts = settings.destinations > 0
        self.events: list[JsonObject] = []
        self.unplaced: list[JsonObject] = []
        self.gaps: list[float] = []
        self.rejected = [
            self._left_out(name, reason)
            for name, reason in (case.source.rejected if case.source.in_order else ())
        ]

    def place(self, event: PackedBox) -> None:
        """A box was placed."""
        placed, candidate = event.placed, event.choice.candidate
        self.gaps.append(event.choice.gap)
        self.events.append({
            **self._line('place', event.target),
            'box': self._box(placed.box),
            'position_mm': list(placed.corner_mm),
            'placed_size_mm': list(placed.size_mm),
            'orientation': placed.orientation,
            'objective': round(candidate.objective, 6),
            'status': event.choice.status.name.lower(),
            'seconds': event.seconds,
        })  # fmt: skip

    def close(self, event: ClosedBin) -> None:
        """A bin was closed."""
        self.events.append({
            **self._line('close', event.target),
            'box': None,
            'fill': round(100.0 * event.target.fill_rate, 6),
            'seconds': event.seconds,
        })  # fmt: skip

    def leave_out(self, event: UnplacedBox) -> None:
        """A box fits no empty bin."""
        self.unplaced.append(self._left_out(event.box.id, event.reason))

    def _left_out(self, name: str, reason: str) -> JsonObject:
        return {'collection': self._number, 'id': name, 'reason': reason}

    def _box(self, box: Box) -> JsonObject:
        bound = {'destination': box.destination} if self._sorts else {}
        return {'id': box.id, 'size_mm': list(box.size_mm), **bound}

    def _line(self, kind: str, target: Bin) -> JsonObject:
        return {
            'collection': self._number,
            'step': len(self.events) + 1,
            'event': kind,
            'bin_serial': target.serial,
            **({'bin_destination': target.destination} if self._sorts else {}),
        }
