"""The belt that runs all the time, with a stop blade at the pick point.

It runs towards the pick point at constant speed. The blade goes up for the chosen box alone: the
box is held there while the belt slides on below it, and those behind it queue up with the
inter-box gap (zero-pressure accumulation). When the box is picked, or its time is over, the blade
goes down and all ride on; a box that was not picked comes round again. All others pass the pick
point, which is a lap for each.

New boxes are laid on at the induct, the far end of the top strand, wherever there is room.
Motion is a function of the time that each call is given; nothing here waits or reads a clock.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from conveyor_sim.belt.drive import Drive, Rider
from conveyor_sim.belt.loop import LIFT_M, OnBelt, longest_along_m
from pack_msgs_py.values import Box, Vec3

#: The blade stays up so much longer than it says, wall-clock time: news of a pick takes its time.
GRACE_S = 0.25
#: A box that is not held is expected no sooner than this: a scan never shows it as held.
SOONEST_S = 0.001
#: Less than this is no overlap, metres.
_TOUCH_M = 1e-9


@dataclass
class _RiderOnLoop(Rider):
    """Anywhere on the loop: its front face is at ``s_m``, its back face at ``end_m``."""

    s_m: float

    @property
    def depth_m(self) -> float:
        return self.box.size_mm[1] / 1000.0

    @property
    def end_m(self) -> float:
        return self.s_m + self.depth_m


class RunningBelt(Drive):
    """A :class:`conveyor_sim.belt.loop.Belt` that never stops; see the module.

    Parameters
    ----------
    length_m : length of the loop.
    slots : how many boxes it carries at most, the look-ahead.
    belt_speed : m/s of robot time.
    speed : robot seconds per second of the time that calls are given. With 0 it stands until a box
        is chosen, has run until that box is there, and holds it until it is picked.
    gap_m : least free way between two boxes.
    window_s : robot time for which the blade holds a box.
    """

    def __init__(
        self,
        length_m: float,
        slots: int,
        belt_speed: float = 1.5,
        speed: float = 1.0,
        *,
        gap_m: float = 0.3,
        window_s: float = 4.0,
    ) -> None:
        super().__init__(longest_along_m(length_m, slots, gap_m), belt_speed, speed)
        self._length = length_m
        self._induct_m = length_m / 2 - LIFT_M
        self._gap = gap_m
        self._window_s = window_s
        self._riders: list[_RiderOnLoop | None] = [None] * slots
        self._restored: dict[str, float] = {}
        self._wanted: int | None = None
        #: Robot seconds for which the belt has run, and what that was at the last pick.
        self._run_s = self._picked_s = 0.0
        #: The box at the blade: since when (run and wall time), and wall seconds until it drops.
        self._held: int | None = None
        self._held_run_s = self._held_since_s = self._left_s = 0.0
        self._missed: list[str] = []
        self._since_s = 0.0

    @property
    def geometry(self) -> str:
        """Equal for belts on which a state means the same."""
        return f'up to {len(self._riders)} boxes on {self._length:g} m, running'

    def restore(self, state: str, now_s: float) -> None:
        """Go on from ``state``; a box that was at the blade comes to it anew."""
        values = json.loads(state) if state else {}
        self._restored = values.get('places', {})
        self._run_s, self._picked_s = values.get('run_s', 0.0), values.get('picked_s', 0.0)
        self._wanted = values.get('wanted')
        self._since_s = now_s

    def state(self, now_s: float) -> str:
        """What :meth:`restore` needs, as JSON."""
        self._advance(now_s)
        places = {str(slot): rider.s_m for slot, rider in self._taken()}
        return json.dumps(
            {
                'places': places,
                'run_s': self._run_s,
                'picked_s': self._picked_s,
                'wanted': self._wanted,
            }
        )

    def set_motion(
        self,
        now_s: float,
        *,
        belt_speed: float | None = None,
        speed: float | None = None,
        paused: bool | None = None,
    ) -> None:
        """Change how the belt moves from now on; a window that has begun keeps its wall time."""
        stood = self._speed == 0
        super().set_motion(now_s, belt_speed=belt_speed, speed=speed, paused=paused)
        if self._held is not None and stood and self._speed:
            self._hold(self._held, now_s)
        self._run_until_held(now_s)

    def room_for(self, box: Box, now_s: float) -> int | None:
        """A free slot, when there is room for ``box`` at the induct."""
        self._advance(now_s)
        self._restored = {}
        free = [slot for slot, rider in enumerate(self._riders) if rider is None]
        return free[0] if free and self._spot(box) is not None else None

    def put(self, box: Box, slot: int, now_s: float, laps: int = 0) -> None:
        """Lay ``box`` on at the induct, or where it was before a restart."""
        self._advance(now_s)
        spot = self._restored.pop(str(slot), None)
        spot = self._spot(box) if spot is None else spot
        if self._riders[slot] is not None or spot is None:
            msg = f'slot {slot} is taken or the induct is full, box {box.id!r} cannot go there'
            raise ValueError(msg)
        self._riders[slot] = _RiderOnLoop(box, laps, spot)
        self._run_until_held(now_s)

    def put_back(
        self, box: Box, slot: int | None, now_s: float, laps: int
    ) -> tuple[int, list[tuple[Box, int]]]:
        """Lay ``box`` down at the blade, which holds it; who stands there makes room."""
        self._advance(now_s)
        rider = _RiderOnLoop(box, laps, 0.0)
        guests = [taken for taken, other in self._taken() if self._conflict(rider, other)]
        if not guests and all(other is not None for other in self._riders):
            guests = [max(self._taken(), key=_how_far)[0]]
        pushed = []
        for guest in guests:
            other = self._riders[guest]
            assert other is not None
            pushed.append((other.box, self.take(guest, now_s, picked=False)))
        free = [number for number, other in enumerate(self._riders) if other is None]
        at = free[0] if slot is None or slot not in free else slot
        self._riders[at] = rider
        self._let_go()
        self._wanted = at
        self._hold(at, now_s)
        return at, pushed

    def take(self, slot: int, now_s: float, *, picked: bool) -> int:
        """Empty a slot and return the laps of the box that was in it.

        ``picked``: travel times count from now on.
        """
        self._advance(now_s)
        rider, self._riders[slot] = self._riders[slot], None
        if self._held == slot:
            self._held = None
        if self._wanted == slot:
            self._wanted = None
        if picked:
            self._picked_s = self._run_s
        return 0 if rider is None else rider.laps

    def bring(self, slot: int, now_s: float, up: str = 'z') -> None:
        """Raise the blade for this box; whichever other one it holds rides on. It is not tipped."""
        self._advance(now_s)
        if self._wanted == slot:
            return
        self._let_go()
        self._wanted = slot
        self._run_until_held(now_s)

    def brings(self, slot: int, up: str = 'z') -> bool:
        """Whether the blade is, or will be, raised for this box."""
        return self._wanted == slot

    def view(self, now_s: float) -> list[OnBelt]:
        """Every box, in the order in which they come to the pick point."""
        self._advance(now_s)
        boxes = []
        for slot, rider in sorted(self._taken(), key=_how_far):
            held = slot == self._held
            opens_s, closes_s = self._window(rider, held=held, now_s=now_s)
            at_run_s = self._held_run_s if held else self._run_s + rider.s_m / self._belt_speed
            boxes.append(
                OnBelt(
                    box=rider.box,
                    slot=slot,
                    s_m=rider.s_m,
                    distance_m=rider.s_m,
                    travel_time_s=max(0.0, at_run_s - self._picked_s),
                    laps=rider.laps,
                    held=held,
                    opens_s=opens_s,
                    closes_s=closes_s,
                )
            )
        return boxes

    def moves(self, now_s: float) -> bool:
        """Whether the belt runs."""
        return self._speed > 0 and not self._paused

    def next_change_s(self, now_s: float) -> float | None:
        """When the chosen box is at the blade, or its time there is over."""
        self._advance(now_s)
        if not self.moves(now_s) or self._wanted is None:
            return None
        if self._held is not None:
            return now_s + self._left_s
        rider = self._riders[self._wanted]
        return None if rider is None else now_s + rider.s_m / self._rate()

    def velocity(self, now_s: float) -> Vec3:
        """Velocity of the top strand in the cell frame, metres per second of the given time."""
        return (0.0, -self._rate(), 0.0) if self.moves(now_s) else (0.0, 0.0, 0.0)

    def missed(self) -> list[str]:
        """Ids of boxes whose window has closed unused since this was asked last."""
        missed, self._missed = self._missed, []
        return missed

    def _rate(self) -> float:
        """Metres per second of the given time."""
        return self._belt_speed * self._speed

    def _taken(self) -> list[tuple[int, _RiderOnLoop]]:
        return [(slot, rider) for slot, rider in enumerate(self._riders) if rider is not None]

    def _window(
        self, rider: _RiderOnLoop, *, held: bool, now_s: float
    ) -> tuple[float | None, float | None]:
        if held and self._speed == 0:
            return self._held_since_s, None
        if held:
            return self._held_since_s, max(self._held_since_s, now_s + self._left_s - GRACE_S)
        if not self.moves(now_s):
            return None, None
        opens_s = now_s + max(SOONEST_S, rider.s_m / self._rate())
        return opens_s, opens_s + self._window_s / self._speed

    def _spot(self, box: Box) -> float | None:
        """Where ``box`` can be laid on: at the induct, at speed 0 wherever there is room."""
        spots = [self._induct_m]
        if self._speed == 0:
            others = [(rider.end_m + self._gap) % self._length for _, rider in self._taken()]
            spots += sorted(others, key=lambda s: (s - self._induct_m) % self._length)
        for spot in spots:
            new = _RiderOnLoop(box, 0, spot)
            if not any(self._conflict(new, rider) for _, rider in self._taken()):
                return spot
        return None

    def _conflict(self, rider: _RiderOnLoop, other: _RiderOnLoop) -> bool:
        """Whether two boxes stand nearer to each other than the gap, round the loop."""
        ahead = (other.s_m - rider.s_m) % self._length
        behind = (rider.s_m - other.s_m) % self._length
        return (
            ahead < rider.depth_m + self._gap - _TOUCH_M
            or behind < other.depth_m + self._gap - _TOUCH_M
        )

    def _hold(self, slot: int, now_s: float) -> None:
        self._held, self._held_run_s, self._held_since_s = slot, self._run_s, now_s
        self._left_s = GRACE_S + (self._window_s / self._speed if self._speed else 0.0)

    def _let_go(self) -> None:
        """Lower the blade; the box that it held has passed."""
        rider = None if self._held is None else self._riders[self._held]
        self._held = None
        if rider is not None:
            rider.laps += 1
            rider.s_m = self._length

    def _run_until_held(self, now_s: float) -> None:
        """At speed 0: the belt has run until the chosen box is at the blade."""
        if self._speed or self._paused or self._wanted is None or self._held is not None:
            return
        rider = self._riders[self._wanted]
        if rider is not None:
            way_m = rider.s_m
            self._move(way_m)
            self._run_s += way_m / self._belt_speed
            rider.s_m = 0.0
            self._hold(self._wanted, now_s)

    def _advance(self, now_s: float) -> None:
        """Bring every place and the blade up to ``now_s``."""
        elapsed = now_s - self._since_s
        self._since_s = max(now_s, self._since_s)
        if elapsed <= 0 or not self.moves(now_s):
            return
        while elapsed > 0:
            wanted = None if self._wanted is None else self._riders[self._wanted]
            if self._held is not None:
                step = min(elapsed, self._left_s)
                self._left_s -= step
                self._move(step * self._rate())
            elif wanted is not None:
                step = min(elapsed, wanted.s_m / self._rate())
                self._move(step * self._rate())
            else:
                step = elapsed
                self._move(step * self._rate())
            elapsed -= step
            self._run_s += step * self._speed
            if self._held is not None and self._left_s <= 0:
                held = self._riders[self._held]
                self._missed += [held.box.id] if held is not None else []
                self._let_go()
            elif self._held is None and wanted is not None and wanted.s_m <= _TOUCH_M:
                wanted.s_m = 0.0
                assert self._wanted is not None
                self._hold(self._wanted, now_s - elapsed)

    def _move(self, way_m: float) -> None:
        """Move everything that nothing holds back by ``way_m``; the chosen box never passes."""
        free_m = 0.0
        for slot, rider in sorted(self._taken(), key=_how_far):
            if self._held is not None:
                if slot != self._held:
                    rider.s_m = min(rider.s_m, max(rider.s_m - way_m, free_m))
                free_m = rider.end_m + self._gap
                continue
            rider.s_m -= way_m
            if slot == self._wanted:
                rider.s_m = max(0.0, rider.s_m)
            while rider.s_m < 0.0:
                rider.s_m += self._length
                rider.laps += 1


def _how_far(taken: tuple[int, _RiderOnLoop]) -> float:
    """How far a box is from the pick point."""
    return taken[1].s_m
