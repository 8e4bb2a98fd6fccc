"""The belt that brings: it turns the chosen box to the pick point, the shorter way, and stops.

Slots stand at equal pitch and all move together, either way. Motion is a function of the time
that each call is given; nothing here waits or reads a clock. Places are whole micrometres, so
that a slot is at the pick point exactly or not at all.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from conveyor_sim.belt.drive import Drive, Rider
from conveyor_sim.belt.loop import OnBelt, longest_along_m
from pack_msgs_py.values import Box, Vec3

_UM = 1_000_000


@dataclass(frozen=True)
class _State:
    """Where the belt is, in micrometres.

    ``travel_um`` is how far it still has to move, signed; ``pick_offset_um`` where it was when a
    box was last picked.
    """

    offset_um: int = 0
    travel_um: int = 0
    pick_offset_um: int = 0


@dataclass
class _RiderInSlot(Rider):
    """In a slot since ``since_s``, seconds of the time that calls are given."""

    since_s: float


class IndexingBelt(Drive):
    """A :class:`conveyor_sim.belt.loop.Belt` that stops at the pick point.

    A box has a lap more each time that another one is picked: it was passed over once.

    Parameters
    ----------
    length_m : length of the loop.
    slots : how many boxes it holds, the look-ahead.
    belt_speed : m/s of robot time.
    speed : robot seconds per second of the time that calls are given; 0 moves at once.
    gap_m : free way between two of the longest boxes.
    """

    def __init__(
        self,
        length_m: float,
        slots: int,
        belt_speed: float = 1.5,
        speed: float = 1.0,
        *,
        gap_m: float = 0.3,
    ) -> None:
        super().__init__(longest_along_m(length_m, slots, gap_m), belt_speed, speed)
        self._length = round(length_m * _UM)
        self._phase = [index * self._length // slots for index in range(slots)]
        self._riders: list[_RiderInSlot | None] = [None] * slots
        self._state = _State()
        self._since_s = 0.0
        self._arrived_s = 0.0

    @property
    def geometry(self) -> str:
        """Equal for belts on which a state means the same."""
        return f'{len(self._phase)} slots on {self._length / _UM:g} m'

    def restore(self, state: str, now_s: float) -> None:
        """Go on from ``state``; a motion that was under way starts again from there."""
        self._state = _State(**json.loads(state)) if state else _State()
        self._since_s = self._arrived_s = now_s

    def state(self, now_s: float) -> str:
        """What :meth:`restore` needs, as JSON."""
        self._advance(now_s)
        return json.dumps(asdict(self._state))

    def room_for(self, box: Box, now_s: float) -> int | None:
        """The empty slot nearest to the pick point."""
        self._advance(now_s)
        empty = [slot for slot, rider in enumerate(self._riders) if rider is None]
        return min(empty, key=self._nearness, default=None)

    def put(self, box: Box, slot: int, now_s: float, laps: int = 0) -> None:
        """Lay ``box`` into an empty slot."""
        self._advance(now_s)
        if self._riders[slot] is not None:
            msg = f'slot {slot} is taken, box {box.id!r} cannot go there'
            raise ValueError(msg)
        self._riders[slot] = _RiderInSlot(box, laps, now_s)

    def put_back(
        self, box: Box, slot: int | None, now_s: float, laps: int
    ) -> tuple[int, list[tuple[Box, int]]]:
        """Lay ``box`` into the gap that it left, and bring it; who was fed there makes room."""
        self._advance(now_s)
        if slot is None:
            slot = min(range(len(self._riders)), key=self._nearness)
        guest, self._riders[slot] = self._riders[slot], None
        self.put(box, slot, now_s, laps)
        self.bring(slot, now_s)
        return slot, [] if guest is None else [(guest.box, guest.laps)]

    def take(self, slot: int, now_s: float, *, picked: bool) -> int:
        """Empty a slot and return the laps of the box that was in it.

        ``picked``: it was at the pick point, and travel times count from there on.
        """
        self._advance(now_s)
        rider = self._riders[slot]
        self._riders[slot] = None
        if picked:
            at_pick = -self._phase[slot] % self._length
            state = self._state
            self._state = _State(state.offset_um, state.travel_um, at_pick)
            for other in self._riders:
                if other is not None:
                    other.laps += 1
        return 0 if rider is None else rider.laps

    def bring(self, slot: int, now_s: float) -> None:
        """Move ``slot`` to the pick point, the shorter way round."""
        self._advance(now_s)
        place = self._place(slot)
        travel = -place if 2 * place <= self._length else self._length - place
        if self._state.travel_um and not travel:
            self._arrived_s = now_s
        self._state = _State(self._state.offset_um, travel, self._state.pick_offset_um)
        self._advance(now_s)

    def brings(self, slot: int) -> bool:
        """Whether ``slot`` is at the pick point, or will be when the motion under way ends."""
        return (self._place(slot) + self._state.travel_um) % self._length == 0

    def view(self, now_s: float) -> list[OnBelt]:
        """Every box, nearest to the pick point first."""
        self._advance(now_s)
        boxes = []
        for slot in sorted(range(len(self._riders)), key=self._nearness):
            rider = self._riders[slot]
            if rider is None:
                continue
            place = self._place(slot)
            before = (self._phase[slot] + self._state.pick_offset_um) % self._length
            held = place == 0 and self._state.travel_um == 0
            boxes.append(
                OnBelt(
                    box=rider.box,
                    slot=slot,
                    s_m=place / _UM,
                    distance_m=self._distance(place) / _UM,
                    travel_time_s=self._distance(before) / _UM / self._belt_speed,
                    laps=rider.laps,
                    held=held,
                    opens_s=max(self._arrived_s, rider.since_s) if held else None,
                )
            )
        return boxes

    def moves(self, now_s: float) -> bool:
        """Whether a motion is under way."""
        return self.next_change_s(now_s) is not None

    def next_change_s(self, now_s: float) -> float | None:
        """When the motion under way ends; ``None`` at rest and while paused."""
        self._advance(now_s)
        if not self._state.travel_um or self._paused:
            return None
        return self._since_s + abs(self._state.travel_um) / self._rate()

    def velocity(self, now_s: float) -> Vec3:
        """Velocity of the top strand in the cell frame, metres per second of the given time."""
        if not self.moves(now_s):
            return (0.0, 0.0, 0.0)
        speed = self._rate() / _UM
        return (0.0, speed if self._state.travel_um > 0 else -speed, 0.0)

    def missed(self) -> list[str]:
        """None: a box is held until it is picked."""
        return []

    def _rate(self) -> float:
        """Micrometres per second of the given time."""
        return self._belt_speed * self._speed * _UM

    def _place(self, slot: int) -> int:
        return (self._phase[slot] + self._state.offset_um) % self._length

    def _distance(self, place: int) -> int:
        return min(place, self._length - place)

    def _nearness(self, slot: int) -> tuple[int, int]:
        place = self._place(slot)
        return (self._distance(place), place)

    def _advance(self, now_s: float) -> None:
        """Bring offset and travel up to ``now_s``."""
        travel = self._state.travel_um
        elapsed = max(0.0, now_s - self._since_s)
        start_s, self._since_s = self._since_s, max(now_s, self._since_s)
        if not travel or self._paused:
            return
        way = abs(travel) if self._speed == 0 else min(abs(travel), int(self._rate() * elapsed))
        step = way if travel > 0 else -way
        offset = (self._state.offset_um + step) % self._length
        self._state = _State(offset, travel - step, self._state.pick_offset_um)
        if step == travel:
            at_once = self._speed == 0
            self._arrived_s = now_s if at_once else start_s + abs(travel) / self._rate()
