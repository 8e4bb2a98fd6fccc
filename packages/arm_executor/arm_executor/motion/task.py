"""What a placement asks of the pad, in `cell`: from a request and what stands in its bin.

Metres and radians, frame `cell`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.layout import BinFrame, Layout, bin_blocks
from arm_executor.motion.swing import CLEAR
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, metres, stands_upright, yaw_of
from pack_msgs_py.geometry.tolerance import HEIGHT_TOLERANCE_MM
from pack_msgs_py.values import BinSpec, Box, Vec3, Walls

#: The box is let go this far above what it stands on.
DROP = 0.0005
#: How far under the commanded pose the box may be lowered to what really is there.
_LOWEST = 0.010


@dataclass(frozen=True)
class StandingBox:
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
    boxes: Sequence[StandingBox]


@dataclass(frozen=True)
class OpenFront:
    """The open front of a roller cage: where it is, and the inner faces of its side walls.

    ``wall`` is their thickness, ``walls`` are the names of all of the cage.
    """

    y: float
    x_low: float
    x_high: float
    wall: float
    walls: tuple[str, ...]


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
    over : about how high the pad goes in between, for estimates.
    front : what the box has to go through, when it cannot enter from above.
    aside : how far beside its place, in x and y, the box comes down.
    """

    pick: Vec3
    place: Vec3
    pick_yaw: float
    turn: float
    size: Vec3
    symmetric: bool
    hover: Vec3
    over: float
    front: OpenFront | None
    aside: tuple[float, float] = (0.0, 0.0)


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
    ex, ey = half_extent(size, place_yaw)
    x, y, z = target.position
    base = z - size[2] / 2
    under = _height_under(site, (x, y), (ex, ey), base, name)
    bottom = max(under, base - _LOWEST) + DROP
    tops = [pose.position[2] + box.size_mm[2] / 2000 for box, pose in request.belt]
    floor = site.frame.origin[2]
    front = None
    rim = max([floor, *(box.high[2] for box in site.boxes)])
    if site.spec.walls is Walls.OPEN_FRONT:
        front = _front(site, layout)
        rim = floor
    elif site.spec.walls is not Walls.NONE:
        rim = max(rim, floor + site.spec.size_mm[2] / 1000)
    return Task(
        pick=_top(request.pick, size),
        place=(x, y, bottom + size[2]),
        pick_yaw=pick_yaw,
        turn=place_yaw - pick_yaw,
        size=size,
        symmetric=request.box.com_offset_mm[:2] == (0.0, 0.0),
        hover=hover_point(layout, tops),
        over=max(rim, layout.conveyor.top_z, bottom) + CLEAR + size[2],
        front=front,
    )


def largest(box: Box, size: Vec3) -> Vec3:
    """``size`` of ``box`` with one standard deviation of the room that it takes up on its sides."""
    length, breadth, height = size
    along, across, _ = metres(box.size_stddev_mm)
    along, across = box.room_stddev(along, breadth), box.room_stddev(across, length)
    return (length + along, breadth + across, height)


def _front(site: Site, layout: Layout) -> OpenFront:
    length, breadth, _ = metres(site.spec.size_mm)
    ends = [site.frame.to_cell(Pose((x, breadth, 0.0))).position for x in (0.0, length)]
    y, x = ends[0][1], min(end[0] for end in ends)
    blocks = bin_blocks(layout, site.station, site.spec)
    walls = tuple(block.name for block in blocks if block.name.endswith('wall'))
    return OpenFront(y, x, x + length, layout.stations.wall, walls)


def _height_under(
    site: Site, at: tuple[float, float], half: tuple[float, float], base: float, name: str
) -> float:
    """Height of what is under a footprint."""
    (x, y), (ex, ey) = at, half
    under, what = site.frame.origin[2], f'the floor of bin {site.station}'
    for box in site.boxes:
        beside_x = box.low[0] >= x + ex or box.high[0] <= x - ex
        beside_y = box.low[1] >= y + ey or box.high[1] <= y - ey
        if not beside_x and not beside_y and box.high[2] > under:
            under, what = box.high[2], f'box {box.box_id}'
    if 1e3 * (under - base) > HEIGHT_TOLERANCE_MM:
        msg = (
            f'box {name}: {what} reaches {1000 * (under - base):.0f} mm above where the base of '
            'the box is to be'
        )
        raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
    return under


def _top(pose: Pose, size: Vec3) -> Vec3:
    x, y, z = pose.position
    return (x, y, z + size[2] / 2)


def _upright_yaw(pose: Pose, box_id: str, what: str) -> float:
    if not stands_upright(pose.quaternion):
        x, y, z, w = pose.quaternion
        msg = (
            f'box {box_id}: the {what} quaternion ({x:.3f}, {y:.3f}, {z:.3f}, {w:.3f}) tips the '
            'box over; taken from above it can only turn about the vertical'
        )
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    return yaw_of(pose.quaternion)


def half_extent(size: Vec3, yaw: float) -> tuple[float, float]:
    """Half extents along x and y of a box turned by ``yaw``."""
    cosine, sine = abs(math.cos(yaw)), abs(math.sin(yaw))
    return (cosine * size[0] + sine * size[1]) / 2, (sine * size[0] + cosine * size[1]) / 2
