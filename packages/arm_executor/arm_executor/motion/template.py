"""Template paths of a placement: which way the pad goes, before any joint is considered.

Over the box and down to it; up over the highest obstacle on the way, across, down into the bin; up
and back over the pick point. Metres and radians, frame `cell`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arm_executor.arm import MotionError, PlaceRequest
from arm_executor.layout import NO_WALLS, OPEN_FRONT, BinFrame, Layout
from arm_executor.motion.path import Waypoint, waypoint
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import BinSpec, Vec3

#: Air under the box while it swings, and under the empty pad.
CLEAR = 0.05
#: The box is let go this far above what it stands on.
DROP = 0.0005
#: How far under the commanded pose the box may be lowered to what really is there, and how far
#: that may stand above it.
_LOWEST, _HIGHEST = 0.010, 0.003
#: Distance between a box and the open front while it waits before it.
_BEFORE_FRONT = 0.06


@dataclass(frozen=True)
class Standing:
    """A box that stands in a bin: its extent in `cell`."""

    box_id: str
    low: Vec3
    high: Vec3


@dataclass(frozen=True)
class Site:
    """The target bin as the planner sees it."""

    station: str
    spec: BinSpec
    frame: BinFrame
    standing: Sequence[Standing]


@dataclass(frozen=True)
class Task:
    """A request in `cell`.

    Attributes
    ----------
    pick, place : the pad on the box's top, when it is taken and when it is let go.
    pick_yaw, turn : the box's yaw on the belt, and how far it is to be turned.
    size : of the box along its own axes.
    symmetric : whether half a turn more or less makes no difference.
    hover : where the pad waits afterwards.
    swings : heights of the pad for the way across, lowest first.
    rise : least height of the empty pad on its way back.
    front_y : where the box waits before an open front; ``None`` when it enters from above.
    entry : height of the pad on the way in through an open front.
    """

    pick: Vec3
    place: Vec3
    pick_yaw: float
    turn: float
    size: Vec3
    symmetric: bool
    hover: Vec3
    swings: tuple[float, ...]
    rise: float
    front_y: float | None
    entry: float


@dataclass(frozen=True)
class Stance:
    """How a task is done: arm posture (branch), places on the rail, height and side of the swing.

    ``around`` is 0, or a whole turn to swing the other way round.
    """

    estimate: float
    branch: int
    pick_rail: float
    place_rail: float
    swing: float
    around: float = 0.0


def hover_point(layout: Layout, belt_tops: Sequence[float] = ()) -> Vec3:
    """Where the pad waits: above the pick point and every box that may come there."""
    belt = layout.conveyor
    height = max([belt.tallest_box + belt.top_z, *belt_tops]) + CLEAR
    return (0.0, belt.front_y + 0.20, height)


def make_task(request: PlaceRequest, site: Site, layout: Layout) -> Task:
    """Turn a request into pad positions and heights.

    Raises
    ------
    MotionError
        ``NO_IK_SOLUTION`` when the box is to be tipped over, ``PATH_IN_COLLISION`` when something
        stands where it is to go.
    """
    name = request.box.id
    pick_yaw = _upright_yaw(request.pick, name, 'pick')
    target = site.frame.to_cell(request.target)
    place_yaw = _upright_yaw(target, name, 'target')
    size = metres(request.box.size_mm)
    ex, ey = _half_extent(size, place_yaw)
    x, y, z = target.position
    base = z - size[2] / 2
    floor = site.frame.origin[2]
    under, corridor = _heights_at(site, (x, y), (ex, ey), base, name)
    bottom = max(under, base - _LOWEST) + DROP
    place = (x, y, bottom + size[2])
    tops = [pose.position[2] + box.size_mm[2] / 2000 for box, pose in request.belt]
    over_belt = layout.conveyor.top_z + CLEAR
    stack = max([floor, *(one.high[2] for one in site.standing)])
    open_front = site.spec.name in OPEN_FRONT
    if open_front:
        low, rise = max(corridor, over_belt), place[2]
        front_y: float | None = site.frame.origin[1] - math.copysign(ey + _BEFORE_FRONT, y)
    else:
        walls = 0.0 if site.spec.name in NO_WALLS else site.spec.size_mm[2] / 1000
        rise = max(stack, floor + walls)
        low, front_y = max(rise, over_belt, bottom), None
    high = max([low, *tops])
    return Task(
        pick=_top(request.pick, size),
        place=place,
        pick_yaw=pick_yaw,
        turn=place_yaw - pick_yaw,
        size=size,
        symmetric=request.box.com_offset_mm[:2] == (0.0, 0.0),
        hover=hover_point(layout, tops),
        swings=tuple(sorted({one + CLEAR + size[2] for one in (low, high, high + 0.25)})),
        rise=max(rise, place[2], over_belt) + CLEAR,
        front_y=front_y,
        entry=max(corridor, bottom) + CLEAR + size[2],
    )


def _heights_at(
    site: Site, at: tuple[float, float], half: tuple[float, float], base: float, name: str
) -> tuple[float, float]:
    """Height of what is under a footprint, and of what lies between it and the open front."""
    (x, y), (ex, ey) = at, half
    under, what = site.frame.origin[2], f'the floor of bin {site.station}'
    corridor = base
    for one in site.standing:
        if one.low[0] >= x + ex or one.high[0] <= x - ex:
            continue
        if one.low[1] < y + ey and one.high[1] > y - ey and one.high[2] > under:
            under, what = one.high[2], f'box {one.box_id}'
        if (one.low[1] < y + ey) if y > 0 else (one.high[1] > y - ey):
            corridor = max(corridor, one.high[2])
    if under > base + _HIGHEST:
        msg = (
            f'box {name}: {what} reaches {1000 * (under - base):.0f} mm above where the base of '
            'the box is to be'
        )
        raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
    return under, corridor


@dataclass(frozen=True)
class Legs:
    """Waypoints of approach, carry and retreat."""

    approach: list[Waypoint]
    carry: list[Waypoint]
    retreat: list[Waypoint]


def template(
    task: Task, stance: Stance, begin: Waypoint, last_joint: float, d4: float, shoulder: int
) -> Legs:
    """Waypoints from ``begin`` for one stance.

    ``last_joint`` is the angle of the last joint at ``begin``; ``d4`` and the sign of the
    ``shoulder`` say how far the first joint is ahead of theta.
    """

    def first_joint(point: Waypoint) -> float:
        return point[1] + shoulder * math.acos(d4 / point[2])

    pick_rail, place_rail = stance.pick_rail, stance.place_rail
    grip_yaw = nearest(task.pick_yaw, begin[4], math.pi / 2)
    grip = waypoint(pick_rail, task.pick, grip_yaw, begin[1])
    place = waypoint(place_rail, task.place, 0.0, grip[1])
    place = _with_theta(place, place[1] + stance.around)
    # The last joint turns by what the first turns less what the box turns: keep that small.
    period = math.pi if task.symmetric else 2 * math.pi
    still = grip_yaw + first_joint(place) - first_joint(grip)
    place = _with_yaw(place, nearest(grip_yaw + task.turn, still, period))
    hover = waypoint(pick_rail, task.hover, 0.0, grip[1])
    # Back above the pick point with the last joint near its middle.
    middle = begin[4] + last_joint + first_joint(hover) - first_joint(begin)
    hover = _with_yaw(hover, nearest(task.pick_yaw, middle, math.pi / 2))

    if task.front_y is None:
        carry = [grip, _at(grip, stance.swing), _at(place, stance.swing), place]
        retreat = [place, _at(place, max(task.rise, place[3] + CLEAR)), hover]
    else:
        carry, retreat = _through_front(task, grip, place, hover, stance.swing)
    return Legs(_approach(task, begin, grip), carry, retreat)


def _approach(task: Task, begin: Waypoint, grip: Waypoint) -> list[Waypoint]:
    above = max(task.pick[2] + CLEAR, min(begin[3], task.pick[2] + 0.15))
    x = begin[0] + begin[2] * math.cos(begin[1])
    y = begin[2] * math.sin(begin[1])
    if math.dist((x, y), task.pick[:2]) < 0.5 and begin[3] >= above:
        return [begin, _at(grip, above), grip]
    # From elsewhere, after a stop: straight up first, then high across.
    safe = max(begin[3], task.rise, task.hover[2])
    return [begin, _at(begin, safe), _at(grip, safe), grip]


def _through_front(
    task: Task, grip: Waypoint, place: Waypoint, hover: Waypoint, swing: float
) -> tuple[list[Waypoint], list[Waypoint]]:
    """Carry and retreat through the open front of a roller cage, above what stands in it."""
    assert task.front_y is not None
    leave = max(task.entry - task.size[2], task.place[2] + CLEAR)
    # Across along a line before the cage: straight in x and y, so in several points.
    start = task.pick if task.pick[1] * task.place[1] > 0 else task.place
    line: list[Waypoint] = []
    for share in np.linspace(0.0, 1.0, 7)[1:]:
        x = start[0] + (task.place[0] - start[0]) * share
        rail = grip[0] + (place[0] - grip[0]) * share
        yaw = grip[4] + (place[4] - grip[4]) * share
        near = line[-1][1] if line else grip[1]
        line.append(waypoint(rail, (x, task.front_y, max(swing, task.entry)), yaw, near))
    carry = [grip, _at(grip, max(swing, task.entry)), *line, _at(place, task.entry), place]
    back = [_with_yaw(_at(one, max(leave, task.hover[2])), place[4]) for one in reversed(line)]
    retreat = [place, _at(place, leave), _at(_with_yaw(line[-1], place[4]), leave), *back, hover]
    return carry, retreat


def _at(point: Waypoint, height: float) -> Waypoint:
    return (point[0], point[1], point[2], height, point[4])


def _with_yaw(point: Waypoint, yaw: float) -> Waypoint:
    return (*point[:4], yaw)


def _with_theta(point: Waypoint, theta: float) -> Waypoint:
    return (point[0], theta, *point[2:])


def nearest(angle: float, wanted: float, period: float) -> float:
    """``angle`` plus the whole ``period`` that brings it nearest to ``wanted``."""
    return angle + period * round((wanted - angle) / period)


def metres(values_mm: Vec3) -> Vec3:
    """Millimetres to metres."""
    x, y, z = values_mm
    return (x / 1000, y / 1000, z / 1000)


def _top(pose: Pose, size: Vec3) -> Vec3:
    x, y, z = pose.position
    return (x, y, z + size[2] / 2)


def _upright_yaw(pose: Pose, box_id: str, what: str) -> float:
    x, y, z, w = pose.quaternion
    if math.hypot(x, y) > 0.01:
        msg = (
            f'box {box_id}: the {what} quaternion ({x:.3f}, {y:.3f}, {z:.3f}, {w:.3f}) tips the '
            'box over; this arm picks from above only, so a box can only turn about the vertical'
        )
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    return 2 * math.atan2(z, w)


def _half_extent(size: Vec3, yaw: float) -> tuple[float, float]:
    """Half extents along x and y of a box turned by ``yaw``."""
    cosine, sine = abs(math.cos(yaw)), abs(math.sin(yaw))
    return (cosine * size[0] + sine * size[1]) / 2, (sine * size[0] + cosine * size[1]) / 2
