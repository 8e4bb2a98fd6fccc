"""The loop that both belts run on: its shape, what can ride on it, and what a belt can do.

It runs over and under: along the top strand away from the pick point, down a lift, back on the
return strand below, and up a lift to the pick point. A place on it is ``s``, the way from the
pick point along the top strand, 0 <= s < length; forward motion makes ``s`` smaller. A box at
``s`` has its front face there and reaches to ``s`` plus its depth.

The look-ahead is what the belt holds: "The number of boxes available to the robot in look ahead
is fixed depending on the pick conveyor's length, maximum box dimension to be packed, and inter-box
gap" (Ojha et al., section I).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box, Vec3

PICK_Y_M = 0.55
TOP_Z_M = 0.75
RETURN_Z_M = 0.25
LIFT_M = TOP_Z_M - RETURN_Z_M

#: The arm's infeed is 0.7 m wide.
MAX_ACROSS_MM = 660.0
#: Higher boxes on the return strand would touch the top strand.
MAX_HEIGHT_MM = 500.0
#: Every box up to this depth must be able to ride: a belt on which it cannot is too short.
SHORTEST_PITCH_MM = 400.0


@dataclass(frozen=True)
class OnBelt:
    """One box on the belt at one instant; times are seconds of the steady clock.

    ``held``: it is at the pick point and stays there. ``opens_s`` says since when, or when it is
    expected there; ``closes_s`` until when it is held, ``None`` for until it is picked.
    ``travel_time_s`` is robot time since the last pick until it is there. On a tilt tray it is
    tipped by ``tipped`` of the way to bring its axis ``up`` up; ``to_be_up`` is the one that will
    be, once it is there.
    """

    box: Box
    slot: int
    s_m: float
    distance_m: float
    travel_time_s: float
    laps: int
    held: bool = False
    opens_s: float | None = None
    closes_s: float | None = None
    up: str = 'z'
    tipped: float = 0.0
    to_be_up: str = 'z'


class Belt(Protocol):
    """What the conveyor needs of a belt. A slot is the number under which it carries a box."""

    @property
    def geometry(self) -> str:
        """Equal for belts on which a state means the same."""

    @property
    def empty(self) -> bool:
        """Whether no box rides."""

    def restore(self, state: str, now_s: float) -> None:
        """Go on from ``state``, before any box is laid on."""

    def state(self, now_s: float) -> str:
        """What :meth:`restore` needs, as text."""

    def set_motion(
        self,
        now_s: float,
        *,
        belt_speed: float | None = None,
        speed: float | None = None,
        paused: bool | None = None,
    ) -> None:
        """Change how the belt moves from now on."""

    def refusal(self, box: Box) -> str:
        """Why ``box`` cannot ride on this belt; empty when it can."""

    def room_for(self, box: Box, now_s: float) -> int | None:
        """The slot in which ``box`` can be laid on now."""

    def put(self, box: Box, slot: int, now_s: float, laps: int = 0) -> None:
        """Lay a new box on, or one that was there before a restart."""

    def put_back(
        self, box: Box, slot: int | None, now_s: float, laps: int
    ) -> tuple[int, list[tuple[Box, int]]]:
        """Lay a box that the arm brought back at the pick point, or where it goes there next.

        ``slot`` is where it rode. Returns where it rides now, and the boxes that had to make
        room for it, with their laps.
        """

    def take(self, slot: int, now_s: float, *, picked: bool) -> int:
        """Empty a slot and return the laps of the box that was in it."""

    def bring(self, slot: int, now_s: float, up: str = 'z') -> None:
        """Have this box at the pick point next, its axis ``up`` up if there is a tilt tray."""

    def brings(self, slot: int, up: str = 'z') -> bool:
        """Whether this box is so at the pick point, or the next that is to be there so."""

    def view(self, now_s: float) -> list[OnBelt]:
        """Every box, nearest to the pick point first."""

    def moves(self, now_s: float) -> bool:
        """Whether anything is in motion."""

    def next_change_s(self, now_s: float) -> float | None:
        """When a motion that is under way brings its box, or a window closes."""

    def velocity(self, now_s: float) -> Vec3:
        """Velocity of the top strand in the cell frame, metres per second of the given time."""

    def missed(self) -> list[str]:
        """Ids of boxes whose window has closed unused since this was asked last."""


def longest_along_m(length_m: float, slots: int, gap_m: float) -> float:
    """Depth of the longest box of which ``slots`` fit on the loop with ``gap_m`` between them.

    Raises
    ------
    ValueError
        So many boxes do not fit on a loop that short.
    """
    longest = length_m / slots - gap_m
    if 1000.0 * longest < SHORTEST_PITCH_MM:
        msg = (
            f'{slots} boxes with a gap of {gap_m:g} m on a belt of {length_m:g} m leave '
            f'{longest:.2f} m for each, at least {SHORTEST_PITCH_MM / 1000.0:g} m are needed: '
            'take a longer belt_length, a smaller gap or a smaller look_ahead'
        )
        raise ValueError(msg)
    return longest


def ride_refusal(box: Box, along_m: float) -> str:
    """Why ``box`` cannot ride where ``along_m`` are free for it; empty when it can."""
    limits = (
        ('x', MAX_ACROSS_MM, 'across the belt'),
        ('y', 1000.0 * along_m, 'along the belt'),
        ('z', MAX_HEIGHT_MM, 'in height'),
    )
    for (axis, limit, where), edge in zip(limits, box.size_mm, strict=True):
        if edge > limit:
            return f'size {axis} is {edge:g} mm; {where} at most {limit:g} mm fit'
    return ''


def loop_pose(s_m: float, length_m: float, size_mm: Vec3) -> Pose:
    """Pose of the centre of a box whose front face is at ``s_m`` on the loop, cell frame, metres.

    At ``s_m`` = 0 the front face, the one with the lowest y, is at y = 0.55 m. The axes of the box
    lie along those of the cell.
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
