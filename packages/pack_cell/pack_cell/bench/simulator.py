"""Pack one collection by the paper's closed-bin protocol (Ojha et al., sections II and III-A).

The look-ahead holds the next boxes of the stream and is refilled after each placement. When
nothing of it fits, an open bin is closed (the fullest, if nothing else is asked for) and an empty
one, the youngest, takes its place.

With destinations a box whose destination has no open bin is not on offer: it goes round on the belt
while the boxes behind it are looked at, until the belt is full of such or a bin is closed.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import replace
from functools import lru_cache

from pack_cell.bench.streams import collection, destination
from pack_cell.bench.values import Case, JsonObject, Packed, Settings
from pack_msgs_py.metrics import fill_metrics
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import may_enter
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, Box
from pack_planner.algorithms import Choice
from pack_planner.algorithms.base import Memory
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.decision.bin_closing import next_destination
from pack_planner.decision.policy import DecisionState, PassedOver, PolicySettings, next_step
from pack_planner.engine import Engine, Weights

#: Boxes on a circular belt of 9 m (Ojha et al., section II), one every 45 cm.
BELT_BOXES = 20


def pack_collection(case: Case, settings: Settings, number: int) -> Packed:
    """Pack collection ``number`` of ``case``.

    Raises
    ------
    EngineMismatch
        A placement breaks a packing rule; every one is held against the slow rules.
    """
    run = _Run(case, settings, collection(case, settings, number), number)
    warm_up(case.algorithm, settings.profile, case.backend)
    while run.advance():
        pass
    return run.result()


@lru_cache(maxsize=8)
def _engine(profile: Profile, weights: Weights) -> Engine:
    """One engine per process, since compiled code takes a moment to load."""
    return Engine(profile, weights)


class _Run:
    """Bins, look-ahead and plan of one collection while it is packed."""

    def __init__(self, case: Case, settings: Settings, boxes: tuple[Box, ...], number: int) -> None:
        self.engine = _engine(settings.profile, settings.weights.of(case.bin_spec))
        self._policy = PolicySettings(
            case.algorithm, settings.profile, settings.weights, settings.budget_s,
            settings.node_limit, case.backend, replace(settings.options, cep=case.cep),
        )  # fmt: skip
        self._passed_over = PassedOver()
        self._case, self._settings, self._number = case, settings, number
        self._clock = time.thread_time if settings.cpu_clock else time.perf_counter
        self._total = len(boxes)
        self._stream = deque(boxes)
        self._belt: list[Box] = []
        self._belt_boxes = case.look_ahead
        if settings.destinations > settings.open_bins:
            self._belt_boxes = max(case.look_ahead, BELT_BOXES)
        self._memory = Memory()
        self._opened = 0
        self._open: list[Bin] = []
        self._closed: list[Bin] = []
        self._events: list[JsonObject] = []
        self._unplaced: list[JsonObject] = []
        self._gaps: list[float] = []
        if case.source.in_order:
            self._total += len(case.source.rejected)
            for name, reason in case.source.rejected:
                self._leave_out(name, reason)
        for index in range(settings.open_bins):
            count = settings.destinations
            self._open_bin(destination(index % count) if count else '')

    def advance(self) -> bool:
        """Place one box or close one bin; False when all boxes are dealt with."""
        self._refill()
        if not self._belt:
            return False
        started = self._clock()
        boxes = self._on_offer()
        state = DecisionState(boxes, tuple(self._open), passed_over=self._passed_over.of(boxes))
        step = next_step(self._policy, self.engine, state, self._memory)
        seconds = self._clock() - started
        if isinstance(step, Choice):
            self._place(step, seconds)
        elif step is not None:
            self._close(step, seconds)
        else:
            box = boxes[0]
            self._belt.remove(box)
            self._leave_out(box.id, f'{self._case.algorithm} finds no place in an empty bin')
        return True

    def result(self) -> Packed:
        """What came of the collection so far."""
        return Packed(
            boxes=self._total,
            events=tuple(self._events),
            unplaced=tuple(self._unplaced),
            fills=fill_metrics(self._closed, self._open),
            closed_bins=len(self._closed),
            gaps=tuple(self._gaps),
        )

    def _refill(self) -> None:
        while self._stream and len(self._belt) < self._belt_boxes:
            box = self._stream.popleft()
            reason = self._fits_nowhere(box)
            if reason:
                self._leave_out(box.id, reason)
            else:
                self._belt.append(box)

    def _on_offer(self) -> tuple[Box, ...]:
        """The nearest boxes that have an open bin; when none has, all that wait for one."""
        served = [
            box for box in self._belt if any(may_enter(box, one.destination) for one in self._open)
        ]
        return tuple(served[: self._case.look_ahead] or self._belt)

    def _fits_nowhere(self, box: Box) -> str:
        spec = self._case.bin_spec
        if not self.engine.fits_empty_bin(box, spec):
            size = 'x'.join(f'{edge:g}' for edge in box.size_mm)
            rule = self._settings.profile.orientations
            return f'{size} mm fits no empty {spec.name} bin, orientations {rule!r}'
        return self.engine.overweight(box)

    def _leave_out(self, name: str, reason: str) -> None:
        self._unplaced.append({'collection': self._number, 'id': name, 'reason': reason})

    def _open_bin(self, serves: str) -> None:
        self._opened += 1
        name = f'{self._number}-{self._opened}'
        self._open.append(Bin(name, self._opened, self._case.bin_spec, destination=serves))

    def _place(self, choice: Choice, seconds: float) -> None:
        candidate = choice.candidate
        placed, target = candidate.placed, self._open[candidate.bin_index]
        self.engine.check(candidate, target)
        self._open[candidate.bin_index] = with_box(target, placed)
        self._passed_over.take(placed.box, self._on_offer())
        self._belt.remove(placed.box)
        self._gaps.append(choice.gap)
        self._events.append({
            **self._event('place', target),
            'box': self._box(placed.box),
            'position_mm': list(placed.corner_mm),
            'placed_size_mm': list(placed.size_mm),
            'orientation': placed.orientation,
            'objective': round(candidate.objective, 6),
            'status': choice.status.name.lower(),
            'seconds': seconds,
        })  # fmt: skip

    def _close(self, target: Bin, seconds: float) -> None:
        left = [one for one in self._open if one is not target]
        serves = next_destination(target, self._belt, left)
        if not target.boxes:
            # nothing to take away: the empty bin serves someone else from now on
            self._open[self._open.index(target)] = replace(target, destination=serves)
            return
        self._open.remove(target)
        self._closed.append(target)
        self._events.append({
            **self._event('close', target),
            'box': None,
            'fill': round(100.0 * target.fill_rate, 6),
            'seconds': seconds,
        })  # fmt: skip
        self._open_bin(serves)

    def _box(self, box: Box) -> JsonObject:
        bound = {'destination': box.destination} if self._settings.destinations else {}
        return {'id': box.id, 'size_mm': list(box.size_mm), **bound}

    def _event(self, kind: str, target: Bin) -> JsonObject:
        return {
            'collection': self._number,
            'step': len(self._events) + 1,
            'event': kind,
            'bin_serial': target.serial,
            **({'bin_destination': target.destination} if self._settings.destinations else {}),
        }
