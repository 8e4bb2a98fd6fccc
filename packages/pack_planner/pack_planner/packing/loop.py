"""Packs boxes that come one after another by the paper's closed-bin protocol.

The look-ahead holds the next boxes of the stream and is refilled after each placement. When
nothing of it fits, an open bin is closed (the fullest, if nothing else is asked for) and an empty
one, the youngest, takes its place (Ojha et al., sections II and III-A).

With destinations a box whose destination has no open bin is not on offer: it goes round on the belt
while the boxes behind it are looked at, until the belt is full of such or a bin is closed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from pack_msgs_py.rules import may_enter
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox
from pack_planner.algorithms import Choice
from pack_planner.algorithms.base import Memory
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.decision.bin_closing import next_destination
from pack_planner.decision.policy import (
    DecisionState,
    PassedOver,
    PolicySettings,
    check_choice,
    next_step,
)
from pack_planner.engine import Engine


@dataclass(frozen=True)
class PackedBox:
    """A box was placed.

    Attributes
    ----------
    placed : the box, and where it is.
    target : the bin as it was before.
    choice : what the algorithm answered.
    seconds : what the decision took.
    """

    placed: PlacedBox
    target: Bin
    choice: Choice
    seconds: float


@dataclass(frozen=True)
class ClosedBin:
    """Nothing on offer fitted, and ``target`` was closed; ``seconds`` is what finding out took."""

    target: Bin
    seconds: float


@dataclass(frozen=True)
class UnplacedBox:
    """A box that no empty bin takes, and why."""

    box: Box
    reason: str


PackingEvent = PackedBox | ClosedBin | UnplacedBox


@dataclass(frozen=True)
class PackingTask:
    """How a stream is to be packed.

    Attributes
    ----------
    bin_spec : the kind of the bins.
    settings : algorithm, rules and options.
    look_ahead : boxes that an algorithm may choose from.
    serves : for each open bin the destination that it starts with, empty for any box.
    belt_boxes : boxes on the belt, where some wait for a bin of their destination; no fewer than
        the look-ahead.
    name : what the ids of the bins begin with.
    clock : returns seconds, to time decisions.
    """

    bin_spec: BinSpec
    settings: PolicySettings
    look_ahead: int = 5
    serves: tuple[str, ...] = ('', '', '')
    belt_boxes: int = 0
    name: str = 'bin'
    clock: Callable[[], float] = time.perf_counter


class PackingLoop:
    """Bins and belt while a stream is packed; iterate over it once, for what happens.

    Boxes are taken from the stream as they are needed. An algorithm is warmed up before the first
    decision, so that none is timed with its compiling.

    Attributes
    ----------
    open_bins, closed_bins : the bins as they are now, oldest first; in the order of closing.

    Raises
    ------
    ValueError
        There is no such algorithm.
    EngineMismatch
        A placement breaks a packing rule; every one is held against the slow rules.
    """

    def __init__(self, stream: Iterable[Box], task: PackingTask) -> None:
        settings = task.settings
        warm_up(settings.algorithm, settings.profile, settings.backend)
        self._task = task
        self._engine = Engine(settings.profile, settings.weights.of(task.bin_spec))
        self._stream = iter(stream)
        self._belt: list[Box] = []
        self._belt_boxes = max(task.look_ahead, task.belt_boxes)
        self._passed_over = PassedOver()
        self._memory = Memory()
        self._opened = 0
        self.open_bins: list[Bin] = []
        self.closed_bins: list[Bin] = []
        for destination in task.serves:
            self._open_bin(destination)

    def __iter__(self) -> Iterator[PackingEvent]:
        while True:
            yield from self._refill()
            if not self._belt:
                return
            event = self._decide()
            if event is not None:
                yield event

    def _decide(self) -> PackingEvent | None:
        """Place one box or close one bin; ``None`` when an empty bin serves someone else now."""
        task = self._task
        started = task.clock()
        boxes = self._on_offer()
        state = DecisionState(boxes, tuple(self.open_bins), passed_over=self._passed_over.of(boxes))
        step = next_step(task.settings, self._engine, state, self._memory)
        seconds = task.clock() - started
        if isinstance(step, Choice):
            check_choice(task.settings, self._engine, state, step)
            return self._place(step, seconds)
        if step is not None:
            return self._close(step, seconds)
        box = boxes[0]
        self._belt.remove(box)
        return UnplacedBox(box, f'{task.settings.spec.name} finds no place in an empty bin')

    def _refill(self) -> Iterator[UnplacedBox]:
        while len(self._belt) < self._belt_boxes:
            box = next(self._stream, None)
            if box is None:
                return
            reason = self._fits_nowhere(box)
            if reason:
                yield UnplacedBox(box, reason)
            else:
                self._belt.append(box)

    def _on_offer(self) -> tuple[Box, ...]:
        """The nearest boxes that have an open bin; when none has, all that wait for one."""
        served = [
            box
            for box in self._belt
            if any(may_enter(box, target.destination) for target in self.open_bins)
        ]
        return tuple(served[: self._task.look_ahead] or self._belt)

    def _fits_nowhere(self, box: Box) -> str:
        spec = self._task.bin_spec
        if not self._engine.fits_empty_bin(box, spec):
            size = 'x'.join(f'{edge:g}' for edge in box.size_mm)
            rule = self._task.settings.profile.orientations
            return f'{size} mm fits no empty {spec.name} bin, orientations {rule!r}'
        return self._engine.overweight(box)

    def _open_bin(self, destination: str) -> None:
        self._opened += 1
        name = f'{self._task.name}-{self._opened}'
        self.open_bins.append(Bin(name, self._opened, self._task.bin_spec, destination=destination))

    def _place(self, choice: Choice, seconds: float) -> PackedBox:
        placed, index = choice.candidate.placed, choice.candidate.bin_index
        target = self.open_bins[index]
        self.open_bins[index] = with_box(target, placed)
        self._passed_over.take(placed.box, self._on_offer())
        self._belt.remove(placed.box)
        return PackedBox(placed, target, choice, seconds)

    def _close(self, target: Bin, seconds: float) -> ClosedBin | None:
        left = [other for other in self.open_bins if other is not target]
        destination = next_destination(target, self._belt, left)
        if not target.boxes:
            # nothing to take away: the empty bin serves someone else from now on
            self.open_bins[self.open_bins.index(target)] = replace(target, destination=destination)
            return None
        self.open_bins.remove(target)
        self.closed_bins.append(target)
        self._open_bin(destination)
        return ClosedBin(target, seconds)
