"""Template paths of a placement: which way the pad goes, before any joint is considered.

Down to the box; with it across, as low as what stands on the way allows, and straight down into
its place; back over the pick point. Metres and radians, frame `cell`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm_executor.motion.path import Waypoint, waypoint
from arm_executor.motion.stances import Stance
from arm_executor.motion.swing import Carried, Obstacles, taut
from arm_executor.motion.task import OpenFront, Task
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Distance between a box and the edges of an open front that it goes round.
_BEFORE_FRONT = 0.03
#: A box reaches its place behind a front from this much aside and before: where the last 2 cm
#: begin, it must be 12 mm (:data:`~arm_executor.motion.obstacle_world.WIDE_MARGIN`) beside the
#: wall, though the corner there is rounded.
_ASIDE = 0.020
#: Samples of a way across, and their spacing where the way has corners.
_ACROSS, _SPACING = 48, 0.03
#: The empty pad at any turn, with some air.
_PAD = Carried((0.065, 0.065), 0.0)


@dataclass(frozen=True)
class PathStyle:
    """How boldly a path is drawn.

    ``corner`` is the distance within which corners are rounded, ``lift`` raises the way across,
    ``slant`` lets a box go through an open front at an angle, and come down beside its place.
    """

    corner: float
    lift: float = 0.0
    slant: bool = True


@dataclass(frozen=True)
class Way:
    """The way of the pad for one stance: four points, and the legs between them."""

    task: Task
    begin: Waypoint
    grip: Waypoint
    place: Waypoint
    hover: Waypoint

    def approach(self, style: PathStyle, obstacles: Obstacles) -> list[Waypoint]:
        """From the beginning to the box at the pick point, which stands there as well."""
        around = _with_box(obstacles, self.task.pick, self.task.size)
        return _leg(_straight(self.begin, self.grip), self.begin, self.grip, _PAD, style, around)

    def carry(self, style: PathStyle, obstacles: Obstacles) -> list[Waypoint]:
        """With the box to its place."""
        (length, breadth, height), task = self.task.size, self.task
        box = Carried((length / 2, breadth / 2), height, task.pick_yaw - self.grip[4])
        if task.front is None:
            across = _straight(self.grip, self.place)
        else:
            across = _through(task.front, self.grip, self.place, box, style)
        return _leg(across, self.grip, self.place, box, style, obstacles)

    def retreat(self, style: PathStyle, obstacles: Obstacles) -> list[Waypoint]:
        """From the box in its place to where the pad waits."""
        around = _with_box(obstacles, self.task.place, self.task.size)
        if self.task.front is None:
            across = _straight(self.place, self.hover)
        else:
            across = _through(self.task.front, self.hover, self.place, _PAD, style)[::-1]
        return _leg(across, self.place, self.hover, _PAD, style, around)


def find_way(
    task: Task, stance: Stance, begin: Waypoint, last_joint: float, shoulder: float
) -> Way:
    """The way from ``begin`` to do ``task`` in one stance.

    ``last_joint`` is the angle of the last joint at ``begin``; ``shoulder`` is d4 of the arm with
    the sign of the posture, and says how far the first joint is ahead of theta.
    """

    def first_joint(point: Waypoint) -> float:
        return point[1] + math.copysign(math.acos(abs(shoulder) / point[2]), shoulder)

    grip_yaw = nearest(task.pick_yaw, begin[4], math.pi / 2)
    grip = waypoint(stance.pick_rail, task.pick, grip_yaw, begin[1])
    place = waypoint(stance.place_rail, task.place, 0.0, grip[1])
    place = _with_theta(place, place[1] + stance.around)
    # The last joint turns by what the first turns less what the box turns: keep that small.
    period = math.pi if task.symmetric else 2 * math.pi
    still = grip_yaw + first_joint(place) - first_joint(grip)
    place = _with_yaw(place, nearest(grip_yaw + task.turn, still, period))
    hover = waypoint(stance.pick_rail, task.hover, 0.0, grip[1])
    # Back above the pick point with the last joint near its middle.
    middle = begin[4] + last_joint + first_joint(hover) - first_joint(begin)
    hover = _with_yaw(hover, nearest(task.pick_yaw, middle, math.pi / 2))
    return Way(task, begin, grip, place, hover)


def _leg(
    across: Array, start: Waypoint, end: Waypoint, what: Carried, style: PathStyle, over: Obstacles
) -> list[Waypoint]:
    line = taut(across, (start[3], end[3]), what, over, style.corner)
    return [line[0], *(_raised(point, style.lift) for point in line[1:-1]), line[-1]]


def _straight(start: Waypoint, end: Waypoint) -> Array:
    """Samples (n, 5) of the way across, seen from above; heights are 0."""
    samples = np.linspace(start, end, _ACROSS)
    samples[:, 3] = 0.0
    return samples


def _through(
    front: OpenFront, outer: Waypoint, inner: Waypoint, what: Carried, style: PathStyle
) -> Array:
    """Samples (n, 5) from outside through an open front to a place behind it; heights are 0.

    Round the edge of the side wall, past it, and in; turned before it goes in.
    """
    (x, y), (tx, ty) = _xy(outer), _xy(inner)
    ex, ey = what.footprint(np.array([inner[4]]))[0]
    ahead = math.copysign(1.0, ty)
    side = 1.0 if x > (front.x_low + front.x_high) / 2 else -1.0
    wall = front.x_high if side > 0 else front.x_low
    # Past the walls with some air; the last little way sideways and back.
    low, high = (front.x_low + ex, front.x_high - ex)
    air = min(_ASIDE, (high - low) / 2)
    beside = (min(max(tx, low + air), high - air), ty - ahead * _ASIDE)
    inside = wall - side * (ex + _BEFORE_FRONT + style.corner / 4)
    slant = style.slant and low < inside < high
    turn_x = inside if slant else beside[0]
    # Rounding a corner cuts it by a sixth; going straight in, the round must be over before.
    room = _BEFORE_FRONT + style.corner / 6 if slant else max(_BEFORE_FRONT, style.corner / 2)
    line_y = front.y - ahead * (ey + room)
    if y * ahead < 0:
        # From behind the rail: round the arm to before the place, then straight in.
        before = waypoint(inner[0], (beside[0], line_y, 0.0), inner[4], inner[1])
        entry = _cartesian([before, inner], [_xy(before), beside, (tx, ty)])
        return np.vstack([_straight(outer, before)[:-1], entry])
    corner_x = wall + side * (front.wall + ex + room)
    points = [(x, y)]
    if (x - corner_x) * side > 0 and (y - line_y) * ahead > 0:
        points.append((corner_x, line_y))
    points += [(turn_x, line_y), beside, (tx, ty)]
    return _cartesian([outer, inner], points)


def _cartesian(ends: Sequence[Waypoint], points: Sequence[tuple[float, float]]) -> Array:
    """Samples (n, 5) along ``points``, straight in x and y; turned two points before the end."""
    table = np.array(points)
    lengths = np.linalg.norm(np.diff(table, axis=0), axis=1)
    knots = np.r_[0.0, np.cumsum(lengths)]
    at = np.linspace(0.0, knots[-1], max(8, math.ceil(knots[-1] / _SPACING)))
    begin, end = ends
    share = at / knots[-1]
    rail = begin[0] + (end[0] - begin[0]) * share
    yaw = begin[4] + (end[4] - begin[4]) * np.minimum(1.0, at / (knots[-3] or knots[-1]))
    x, y = (np.interp(at, knots, column) for column in table.T)
    theta = np.unwrap(np.r_[begin[1], np.arctan2(y, x - rail)])[1:]
    return np.stack([rail, theta, np.hypot(x - rail, y), np.zeros_like(at), yaw], axis=1)


def _with_box(obstacles: Obstacles, top: Vec3, size: Vec3) -> Obstacles:
    """``obstacles`` and the box itself, which stands with its top there."""
    half = min(size[:2]) / 2
    low = np.array([top[0] - half, top[1] - half, top[2] - size[2]])
    high = np.array([top[0] + half, top[1] + half, top[2]])
    return Obstacles(np.vstack([obstacles.low, low]), np.vstack([obstacles.high, high]))


def _xy(point: Waypoint) -> tuple[float, float]:
    rail, theta, radius, *_ = point
    return rail + radius * math.cos(theta), radius * math.sin(theta)


def _raised(point: Waypoint, lift: float) -> Waypoint:
    return (*point[:3], point[3] + lift, point[4])


def _with_yaw(point: Waypoint, yaw: float) -> Waypoint:
    return (*point[:4], yaw)


def _with_theta(point: Waypoint, theta: float) -> Waypoint:
    return (point[0], theta, *point[2:])


def nearest(angle: float, wanted: float, period: float) -> float:
    """``angle`` plus the whole ``period`` that brings it nearest to ``wanted``."""
    return angle + period * round((wanted - angle) / period)
