"""What of a list of boxes the cell can pack: which bins they fit, what belt and arm cannot do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from conveyor_sim.factory import make_belt
from conveyor_sim.induct.alignment import aligned
from conveyor_sim.parameters import ConveyorParameters
from conveyor_sim.scanning.inspection import MAX_WEIGHT_KG
from pack_msgs_py.orientation import allowed_orientations
from pack_msgs_py.profiles import Profile, planned_size
from pack_msgs_py.values import BinSpec, Box

#: Upper ends of the classes of the longest edge, mm.
EDGES_MM = (50, 100, 200, 300, 400, 600, 800, 1200)


@dataclass(frozen=True)
class Unsuited:
    """Boxes of which something is true, and a few words on each."""

    boxes: tuple[Box, ...]
    words: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.boxes)


def fitting(boxes: Sequence[Box], spec: BinSpec, profile: Profile, rule: str) -> int:
    """How many boxes fit an empty bin in some orientation that ``rule`` and the box allow."""
    return sum(_fits(box, spec, profile, rule) for box in boxes)


def _fits(box: Box, spec: BinSpec, profile: Profile, rule: str) -> bool:
    return any(
        all(
            edge <= room
            for edge, room in zip(planned_size(box, turn, profile), spec.size_mm, strict=True)
        )
        for turn in allowed_orientations(box, rule)
    )


def cannot_ride(boxes: Sequence[Box]) -> Unsuited:
    """Boxes that the belt cannot carry, however the induct turns them."""
    refusal = make_belt(ConveyorParameters()).refusal
    return _found(boxes, lambda box: refusal(aligned(box, refusal)) or _too_heavy(box))


def _too_heavy(box: Box) -> str:
    if box.weight_kg <= MAX_WEIGHT_KG:
        return ''
    return f'{box.weight_kg:g} kg; at most {MAX_WEIGHT_KG:g} kg may ride'


def cannot_lift(boxes: Sequence[Box], payload_kg: float) -> Unsuited:
    """Boxes that are too heavy for the arm."""
    return _found(boxes, lambda box: f'{box.weight_kg:g} kg' if box.weight_kg > payload_kg else '')


def _found(boxes: Sequence[Box], why: Callable[[Box], str]) -> Unsuited:
    found = [(box, words) for box in boxes if (words := why(box))]
    return Unsuited(tuple(box for box, _ in found), tuple(words for _, words in found))


def histogram(boxes: Sequence[Box]) -> list[tuple[str, int]]:
    """How many boxes have their longest edge in each class, from the first to the last in use."""
    classes = []
    low = 0
    for high in (*EDGES_MM, 10_000):
        count = sum(low < max(box.size_mm) <= high for box in boxes)
        name = f'{low} to {high} mm' if high in EDGES_MM else f'above {low} mm'
        classes.append((name, count))
        low = high
    used = [place for place, (_, count) in enumerate(classes) if count]
    return classes[used[0] : used[-1] + 1] if used else []
