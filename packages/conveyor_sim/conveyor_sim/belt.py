"""The circular belt: slots on a loop, how it moves, where each box is.

The loop runs over and under: along the top strand away from the pick point, down a lift, back on
the return strand below, and up a lift to the pick point. A place on it is ``s``, the way from the
pick point along the top strand, 0 <= s < length; forward motion makes ``s`` smaller. Slots stand
at equal pitch, and all move together, either way.

Motion is a function of the time that each call is given; nothing here waits or reads a clock.
Places are whole micrometres, so that a slot is at the pick point exactly or not at all.
"""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.cell_values import Pose
from pack_msgs_py.values import Box, Vec3

PICK_Y_M = 0.55
TOP_Z_M = 0.75
RETURN_Z_M = 0.25
LIFT_M = TOP_Z_M - RETURN_Z_M

#: The arm's infeed is 0.7 m wide.
MAX_ACROSS_MM = 660.0
#: Higher boxes on the return strand would touch the top strand.
MAX_HEIGHT_MM = 500.0
#: Free way between two boxes on the loop.
MIN_GAP_M = 0.05

_UM = 1_000_000


@dataclass(frozen=True)
class BeltState:
    """Where the belt is, in micrometres: what a restart needs to go on.

    ``travel_um`` is how far it still has to move, signed; ``pick_offset_um`` where it was when a
    box was last picked.
    """

    offset_um: int = 0
    travel_um: int = 0
    pick_offset_um: int = 0


@dataclass(frozen=True)
class OnBelt:
    """One box on the belt at one instant. ``arrived_s`` is ``None`` unless it can be picked."""

    box: Box
    slot: int
    s_m: float
    distance_m: float
    travel_time_s: float
    laps: int
    arrived_s: float | None


@dataclass
class _Rider:
    box: Box
    laps: int
    since_s: float


class Belt:
    """Slots on the loop and the boxes that ride on them.

    Parameters
    ----------
    length_m : length of the loop.
    slots : how many boxes it holds, the look-ahead.
    belt_speed : m/s of robot time.
    speed : robot seconds per second of the time that calls are given; 0 moves at once.
    """

    def __init__(
        self, length_m: float, slots: int, belt_speed: float = 1.5, speed: float = 1.0
    ) -> None:
        self._length = round(length_m * _UM)
        self._phase = [index * self._length // slots for index in range(slots)]
        self._riders: list[_Rider | None] = [None] * slots
        self._state = BeltState()
        self._since_s = 0.0
        self._arrived_s = 0.0
        self._belt_speed = belt_speed
        self._speed = speed
        self._paused = False

    @property
    def geometry(self) -> str:
        """Equal for belts on which a :class:`BeltState` means the same."""
        return f'{len(self._phase)} slots on {self._length / _UM:g} m'

    @property
    def empty(self) -> bool:
        """Whether no box rides."""
        return all(rider is None for rider in self._riders)

    def restore(self, state: BeltState, now_s: float) -> None:
        """Go on from ``state``; a motion that was under way starts again from there."""
        self._state = state
        self._since_s = self._arrived_s = now_s

    def state(self, now_s: float) -> BeltState:
        """What :meth:`restore` needs."""
        self._advance(now_s)
        return self._state

    def set_motion(
        self,
        now_s: float,
        *,
        belt_speed: float | None = None,
        speed: float | None = None,
        paused: bool | None = None,
    ) -> None:
        """Change how the belt moves from now on."""
        self._advance(now_s)
        self._belt_speed = self._belt_speed if belt_speed is None else belt_speed
        self._speed = self._speed if speed is None else speed
        self._paused = self._paused if paused is None else paused

    def refusal(self, box: Box) -> str:
        """Why ``box`` cannot ride on this belt; empty when it can."""
        along = 1000.0 * (self._length / _UM / len(self._phase) - MIN_GAP_M)
        limits = (
            ('x', MAX_ACROSS_MM, 'across the belt'),
            ('y', along, 'along the belt'),
            ('z', MAX_HEIGHT_MM, 'in height'),
        )
        for (axis, limit, where), edge in zip(limits, box.size_mm, strict=True):
            if edge > limit:
                return f'size {axis} is {edge:g} mm; {where} at most {limit:g} mm fit'
        return ''

    def free_slots(self, now_s: float) -> list[int]:
        """Empty slots, nearest to the pick point first."""
        self._advance(now_s)
        empty = [slot for slot, rider in enumerate(self._riders) if rider is None]
        return sorted(empty, key=self._nearness)

    def nearest_slot(self, now_s: float) -> int:
        """The slot nearest to the pick point, empty or not."""
        self._advance(now_s)
        return min(range(len(self._riders)), key=self._nearness)

    def occupant(self, slot: int) -> Box | None:
        """The box in a slot."""
        rider = self._riders[slot]
        return None if rider is None else rider.box

    def put(self, box: Box, slot: int, now_s: float, laps: int = 0) -> None:
        """Lay ``box`` into an empty slot."""
        self._advance(now_s)
        if self._riders[slot] is not None:
            msg = f'slot {slot} is taken, box {box.id!r} cannot go there'
            raise ValueError(msg)
        self._riders[slot] = _Rider(box, laps, now_s)

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
            self._state = BeltState(state.offset_um, state.travel_um, at_pick)
        return 0 if rider is None else rider.laps

    def bring(self, slot: int, now_s: float) -> None:
        """Move ``slot`` to the pick point, the shorter way round."""
        self._advance(now_s)
        place = self._place(slot)
        travel = -place if 2 * place <= self._length else self._length - place
        if self._state.travel_um and not travel:
            self._arrived_s = now_s
        self._state = BeltState(self._state.offset_um, travel, self._state.pick_offset_um)
        self._advance(now_s)

    def brings(self, slot: int) -> bool:
        """Whether ``slot`` is at the pick point, or will be when the motion under way ends."""
        return (self._place(slot) + self._state.travel_um) % self._length == 0

    def view(self, now_s: float) -> list[OnBelt]:
        """Every box, nearest to the pick point first."""
        self._advance(now_s)
        found = []
        for slot in sorted(range(len(self._riders)), key=self._nearness):
            rider = self._riders[slot]
            if rider is None:
                continue
            place = self._place(slot)
            before = (self._phase[slot] + self._state.pick_offset_um) % self._length
            pickable = place == 0 and self._state.travel_um == 0
            found.append(
                OnBelt(
                    box=rider.box,
                    slot=slot,
                    s_m=place / _UM,
                    distance_m=self._distance(place) / _UM,
                    travel_time_s=self._distance(before) / _UM / self._belt_speed,
                    laps=rider.laps,
                    arrived_s=max(self._arrived_s, rider.since_s) if pickable else None,
                )
            )
        return found

    def arrival_s(self, now_s: float) -> float | None:
        """When the motion under way ends; ``None`` at rest and while paused."""
        self._advance(now_s)
        if not self._state.travel_um or self._paused:
            return None
        return self._since_s + abs(self._state.travel_um) / self._rate()

    def velocity(self, now_s: float) -> Vec3:
        """Velocity of the top strand in the cell frame, metres per second of the given time."""
        if self.arrival_s(now_s) is None:
            return (0.0, 0.0, 0.0)
        speed = self._rate() / _UM
        return (0.0, speed if self._state.travel_um > 0 else -speed, 0.0)

    def pose(self, item: OnBelt) -> Pose:
        """Pose of a box's centre in the cell frame, metres; its axes along those of the cell."""
        return loop_pose(item.s_m, self._length / _UM, item.box.size_mm)

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
        """Bring offset, travel and laps up to ``now_s``."""
        travel = self._state.travel_um
        elapsed = max(0.0, now_s - self._since_s)
        start_s, self._since_s = self._since_s, max(now_s, self._since_s)
        if not travel or self._paused:
            return
        way = abs(travel) if self._speed == 0 else min(abs(travel), int(self._rate() * elapsed))
        step = way if travel > 0 else -way
        for slot, rider in enumerate(self._riders):
            if rider is not None:
                rider.laps += self._passes(self._place(slot), step)
        offset = (self._state.offset_um + step) % self._length
        self._state = BeltState(offset, travel - step, self._state.pick_offset_um)
        if step == travel:
            at_once = self._speed == 0
            self._arrived_s = now_s if at_once else start_s + abs(travel) / self._rate()

    def _passes(self, place: int, step: int) -> int:
        """How often a box at ``place`` leaves the pick point behind in a move of ``step``."""
        if step == 0:
            return 0
        if step < 0:
            return place // self._length - (place + step) // self._length
        return -(-(place + step) // self._length) + (-place // self._length)


def loop_pose(s_m: float, length_m: float, size_mm: Vec3) -> Pose:
    """Pose of the centre of a box whose front face is at ``s_m`` on the loop, cell frame, metres.

    At ``s_m`` = 0 the front face, the one with the lowest y, is at y = 0.55 m.
    """
    strand = length_m / 2 - LIFT_M
    if s_m <= strand:
        front, base = s_m, TOP_Z_M
    elif s_m <= strand + LIFT_M:
        front, base = strand, TOP_Z_M - (s_m - strand)
    elif s_m <= 2 * strand + LIFT_M:
        front, base = 2 * strand + LIFT_M - s_m, RETURN_Z_M
    else:
        front, base = 0.0, RETURN_Z_M + (s_m - 2 * strand - LIFT_M)
    depth, height = size_mm[1] / 1000.0, size_mm[2] / 1000.0
    return Pose((0.0, PICK_Y_M + front + depth / 2, base + height / 2))
