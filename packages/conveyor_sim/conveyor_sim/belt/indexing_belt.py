"""The belt that brings: it turns the chosen box to the pick point, the shorter way, and stops.

There a tilt tray may tip it, and tip it back before the belt moves on without it.
Slots stand at equal pitch and all move together, either way. Motion is a function of the time
that each call is given; nothing here waits or reads a clock. Places are whole micrometres, so
that a slot is at the pick point exactly or not at all.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace

from conveyor_sim.belt.drive import Drive, Rider
from conveyor_sim.belt.loop import OnBelt, longest_along_m
from conveyor_sim.belt.tilt_tray import TiltTray
from pack_msgs_py.values import Box, Vec3

_UM = 1_000_000
#: What takes no longer than this is done, seconds.
_MOMENT_S = 1e-9


@dataclass(frozen=True)
class _State:
    """Where the belt is, in micrometres.

    ``travel_um`` is how far it still has to move, signed; ``pick_offset_um`` where it was when a
    box was last picked, and ``pick_back_s`` how long the tray needed to go back then. ``up`` is the
    axis that is to be up of the box that is brought.
    """

    offset_um: int = 0
    travel_um: int = 0
    pick_offset_um: int = 0
    pick_back_s: float = 0.0
    up: str = 'z'


@dataclass(frozen=True)
class _Stages:
    """What is still to be done, in robot seconds, one after the other.

    The tray goes back alone, the belt travels, while an empty tray goes back too, the tray tips.
    """

    back_s: float
    travel_s: float
    tip_s: float

    @property
    def left_s(self) -> float:
        return self.back_s + self.travel_s + self.tip_s


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
    tilt_time_s : robot time in which a tray at the pick point tips a box; ``None`` for no tray.
    """

    def __init__(
        self,
        length_m: float,
        slots: int,
        belt_speed: float = 1.5,
        speed: float = 1.0,
        *,
        gap_m: float = 0.3,
        tilt_time_s: float | None = None,
    ) -> None:
        super().__init__(longest_along_m(length_m, slots, gap_m), belt_speed, speed)
        self._length = round(length_m * _UM)
        self._phase = [index * self._length // slots for index in range(slots)]
        self._riders: list[_RiderInSlot | None] = [None] * slots
        self._state = _State()
        self._tilt_time_s = tilt_time_s
        self._tray = TiltTray()
        self._since_s = 0.0
        self._arrived_s = 0.0

    @property
    def geometry(self) -> str:
        """Equal for belts on which a state means the same."""
        tray = '' if self._tilt_time_s is None else ', tilt tray'
        return f'{len(self._phase)} slots on {self._length / _UM:g} m{tray}'

    def restore(self, state: str, now_s: float) -> None:
        """Go on from ``state``; a motion that was under way starts again from there."""
        values = json.loads(state) if state else {}
        self._tray = TiltTray(**values.pop('tray', {}))
        self._state = _State(**values)
        self._since_s = self._arrived_s = now_s

    def state(self, now_s: float) -> str:
        """What :meth:`restore` needs, as JSON."""
        self._advance(now_s)
        return json.dumps({**asdict(self._state), 'tray': asdict(self._tray)})

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
        on_tray = self._place(slot) == 0
        if picked:
            self._state = replace(
                self._state,
                pick_offset_um=-self._phase[slot] % self._length,
                pick_back_s=replace(self._tray, loaded=False).back_s if on_tray else 0.0,
            )
            for other in self._riders:
                if other is not None:
                    other.laps += 1
        if on_tray:
            self._tray = replace(self._tray, loaded=False)
        if self._is_brought(slot):
            # There is nothing to tip any more, also when the belt is still under way.
            self._state = replace(self._state, up='z')
        return 0 if rider is None else rider.laps

    def bring(self, slot: int, now_s: float, up: str = 'z') -> None:
        """Move ``slot`` to the pick point, the shorter way round; then tip it, ``up`` up."""
        self._advance(now_s)
        place = self._place(slot)
        travel = -place if 2 * place <= self._length else self._length - place
        was_at_rest = self._at_rest
        self._state = replace(self._state, travel_um=travel, up=self._to_be_up(up))
        if self._at_rest and not was_at_rest:
            self._arrived_s = now_s
        self._advance(now_s)

    def brings(self, slot: int, up: str = 'z') -> bool:
        """Whether ``slot`` is at the pick point so, or will be when the motion under way ends."""
        return self._is_brought(slot) and self._state.up == self._to_be_up(up)

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
            held = place == 0 and self._at_rest
            on_tray = place == 0 and self._tray.loaded and self._tray.turned_s > 0
            way_s = self._distance(before) / _UM / self._belt_speed
            boxes.append(
                OnBelt(
                    box=rider.box,
                    slot=slot,
                    s_m=place / _UM,
                    distance_m=self._distance(place) / _UM,
                    travel_time_s=max(way_s, self._state.pick_back_s),
                    laps=rider.laps,
                    held=held,
                    opens_s=max(self._arrived_s, rider.since_s) if held else None,
                    up=self._tray.axis if on_tray else 'z',
                    tipped=self._tray.turned_s / self._full_s if on_tray else 0.0,
                    to_be_up=self._state.up if self._is_brought(slot) else 'z',
                )
            )
        return boxes

    def moves(self, now_s: float) -> bool:
        """Whether a motion is under way."""
        return self.next_change_s(now_s) is not None

    def next_change_s(self, now_s: float) -> float | None:
        """When the motion under way ends; ``None`` at rest and while paused."""
        self._advance(now_s)
        if self._at_rest or self._paused:
            return None
        return self._since_s + self._stages().left_s / self._speed

    def velocity(self, now_s: float) -> Vec3:
        """Velocity of the top strand in the cell frame, metres per second of the given time."""
        if not self.moves(now_s) or not self._state.travel_um or self._stages().back_s:
            return (0.0, 0.0, 0.0)
        speed = self._belt_speed * self._speed
        return (0.0, speed if self._state.travel_um > 0 else -speed, 0.0)

    def missed(self) -> list[str]:
        """None: a box is held until it is picked."""
        return []

    @property
    def _full_s(self) -> float:
        """Robot time of a whole tip."""
        return self._tilt_time_s or 0.0

    @property
    def _at_rest(self) -> bool:
        """Whether belt and tray are where they are to be."""
        return self._stages().left_s == 0

    def _is_brought(self, slot: int) -> bool:
        """Whether ``slot`` is at the pick point when the belt has moved."""
        return (self._place(slot) + self._state.travel_um) % self._length == 0

    def _to_be_up(self, up: str) -> str:
        """What of ``up`` this belt can do."""
        return 'z' if self._tilt_time_s is None else up

    def _stages(self) -> _Stages:
        tray, state = self._tray, self._state
        travel_s = abs(state.travel_um) / _UM / self._belt_speed
        goes_on = tray.loaded and not state.travel_um and tray.axis in ('z', state.up)
        back_s = 0.0 if goes_on else tray.back_s
        if not tray.loaded:
            back_s = max(0.0, back_s - travel_s)
        done_s = tray.turned_s if goes_on else 0.0
        tip_s = 0.0 if state.up == 'z' else self._full_s - done_s
        return _Stages(back_s, travel_s, tip_s)

    def _place(self, slot: int) -> int:
        return (self._phase[slot] + self._state.offset_um) % self._length

    def _distance(self, place: int) -> int:
        return min(place, self._length - place)

    def _nearness(self, slot: int) -> tuple[int, int]:
        place = self._place(slot)
        return (self._distance(place), place)

    def _advance(self, now_s: float) -> None:
        """Bring offset, travel and tray up to ``now_s``."""
        elapsed_s = max(0.0, now_s - self._since_s)
        start_s, self._since_s = self._since_s, max(now_s, self._since_s)
        stages = self._stages()
        if self._paused or not stages.left_s:
            return
        left_s = math.inf if self._speed == 0 else elapsed_s * self._speed
        ends = left_s >= stages.left_s - _MOMENT_S
        left_s = math.inf if ends else left_s
        step_s = min(left_s, stages.back_s)
        self._tray, left_s = self._tray.back(step_s), left_s - step_s
        if left_s > 0 and stages.travel_s:
            step_s = min(left_s, stages.travel_s)
            self._travel(step_s, whole=step_s == stages.travel_s)
            left_s -= step_s
        if left_s > 0 and not self._state.travel_um:
            there = any(self._place(n) == 0 for n, rider in enumerate(self._riders) if rider)
            self._tray = replace(self._tray, loaded=there)
            self._tray = self._tray.tipped(self._state.up, left_s, self._full_s)
        if ends:
            self._arrived_s = now_s if self._speed == 0 else start_s + stages.left_s / self._speed

    def _travel(self, seconds: float, *, whole: bool) -> None:
        """Move the belt for so much robot time, the tray goes back meanwhile if it has to."""
        travel = self._state.travel_um
        way = abs(travel) if whole else min(abs(travel), int(self._belt_speed * _UM * seconds))
        step = way if travel > 0 else -way
        offset = (self._state.offset_um + step) % self._length
        self._state = replace(self._state, offset_um=offset, travel_um=travel - step)
        self._tray = self._tray.back(math.inf if whole else seconds)
