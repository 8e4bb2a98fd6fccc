"""Where everything stands in the cell, and whether it fits.

Frame `cell`: x along the rail, +y towards the infeed, z up, origin on the floor under the middle
of the rail. Metres, seconds, kilograms. ``config/layout.yaml`` holds the same values as the
defaults here; docs/cell_layout.md describes them, :mod:`arm_executor.reach.layout_file` reads them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from arm_executor.model.robot_data import find_robot
from pack_msgs_py.geometry.pose import Pose, about_z, quaternion_product
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.values import STATIONS, BinSpec, Vec3, Walls


@dataclass(frozen=True)
class Rail:
    """The linear axis that carries the arm along x. Speed, acceleration and force are assumed.

    At 1.45 m a UR20 reaches the top of a roller cage at its back, and over the stacks before it; at
    1.30 m it does not (docs/benchmarks/execution.md).

    Where ``x_min`` and ``x_max`` are the same, the arm stands there and there is no rail.
    """

    x_min: float = -2.4
    x_max: float = 2.4
    speed: float = 1.5
    acceleration: float = 3.0
    force: float = 3000.0
    base_height: float = 1.45
    pedestal_radius: float = 0.15

    @property
    def fixed(self) -> bool:
        """Whether the arm stands still."""
        return self.x_min == self.x_max

    def nearest(self, x: float) -> float:
        """Where on the rail the arm stands nearest to ``x``."""
        return min(max(x, self.x_min), self.x_max)


@dataclass(frozen=True)
class Tool:
    """A suction mast: a thin tube with a square pad at its end.

    With 0.65 m the wrist stays above the rim of an 80 cm bin for every box on its floor; with
    0.50 m it does not, and one placement in twenty needed another posture of the arm.

    ``vacuum`` is the pressure below that of the air under the pad, Pa; ``friction`` that between
    pad and box; ``safety`` what planning keeps of reserve (:mod:`arm_executor.model.suction`).
    All three are assumed.
    """

    length: float = 0.65
    diameter: float = 0.06
    pad_edge: float = 0.09
    mass: float = 3.0
    vacuum: float = 60_000.0
    friction: float = 0.5
    safety: float = 1.5


@dataclass(frozen=True)
class ConveyorLayout:
    """The head of the belt; ``tallest_box`` is what the waiting arm leaves room for."""

    width: float = 0.70
    front_y: float = 0.55
    length: float = 1.60
    top_z: float = 0.75
    tallest_box: float = 0.50


@dataclass(frozen=True)
class Stations:
    """Where bins stand: A and B beside the belt, C behind the rail."""

    gap_x: float = 0.45
    near_y: float = 0.55
    near_y_open_front: float = 0.85
    deck_z: float = 0.15
    wall: float = 0.02


@dataclass(frozen=True)
class Layout:
    """The whole cell; ``robot`` is a name of :data:`arm_executor.model.robot_data.ROBOTS`."""

    robot: str = 'ur20'
    rail: Rail = field(default_factory=Rail)
    tool: Tool = field(default_factory=Tool)
    conveyor: ConveyorLayout = field(default_factory=ConveyorLayout)
    stations: Stations = field(default_factory=Stations)


@dataclass(frozen=True)
class Block:
    """A named axis-aligned block, frame `cell`, metres."""

    name: str
    low: Vec3
    high: Vec3

    @property
    def centre(self) -> Vec3:
        """Middle of the block."""
        x, y, z = ((a + b) / 2 for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)

    @property
    def size(self) -> Vec3:
        """Edge lengths."""
        x, y, z = (b - a for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)

    def overlaps(self, other: Block) -> bool:
        """Whether the two share volume; touching faces do not."""
        return all(
            a < d - 1e-9 and c < b - 1e-9
            for a, b, c, d in zip(self.low, self.high, other.low, other.high, strict=True)
        )


#: Where every node of the cell knows the pick point (docs/architecture.md): the front face of a
#: box there, and the top of the belt.
PICK_POINT = {'front_y': 0.55, 'top_z': 0.75}

#: Parts of a layout that hold numbers, and what these may be: lengths and the like up to 50, the
#: others as given; above the lower end, or from it on.
_PARTS = ('rail', 'tool', 'conveyor', 'stations')
_LONGEST = 50.0
_RANGES = {
    'rail.x_min': (-_LONGEST, _LONGEST),
    'rail.x_max': (-_LONGEST, _LONGEST),
    'rail.force': (0.0, 1e6),
    'tool.vacuum': (0.0, 101_325.0),
    'tool.friction': (0.0, 2.0),
    'tool.safety': (1.0, 10.0),
}
_FROM = frozenset({'rail.x_min', 'rail.x_max', 'tool.safety'})


class LayoutError(ValueError):
    """The layout cannot be built; the message names the value or the parts that overlap."""


@dataclass(frozen=True)
class BinFrame:
    """A bin frame in `cell`: its origin and its turn about z (0, or pi at station C)."""

    origin: Vec3
    yaw: float

    def to_cell(self, pose: Pose) -> Pose:
        """``pose`` given in the bin frame, in `cell`."""
        return self._moved(pose, self.origin, self.yaw)

    def from_cell(self, pose: Pose) -> Pose:
        """``pose`` given in `cell`, in the bin frame."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = self.origin
        inverse = (-cosine * x - sine * y, sine * x - cosine * y, -z)
        return self._moved(pose, inverse, -self.yaw)

    @staticmethod
    def _moved(pose: Pose, origin: Vec3, yaw: float) -> Pose:
        cosine, sine = math.cos(yaw), math.sin(yaw)
        x, y, z = pose.position
        position = (
            origin[0] + cosine * x - sine * y,
            origin[1] + sine * x + cosine * y,
            origin[2] + z,
        )
        return Pose(position, quaternion_product(about_z(yaw), pose.quaternion))


def bin_frame(layout: Layout, station: str, spec: BinSpec) -> BinFrame:
    """Frame of a bin of kind ``spec`` at ``station``; :class:`LayoutError` for another station.

    The origin is at the corner nearest the rail, but for a bin with an open front at the corner
    farthest behind it: bins are filled from their origin, and nothing may bar the way in.
    """
    length, breadth, _ = (edge / 1000 for edge in spec.size_mm)
    place = layout.stations
    left = {'A': -place.gap_x - length, 'B': place.gap_x, 'C': -length / 2}.get(station)
    if left is None:
        msg = f'no station {station!r} in this cell: use one of {", ".join(STATIONS)}'
        raise LayoutError(msg)
    from_behind = spec.walls is Walls.OPEN_FRONT
    away = place.near_y_open_front + breadth if from_behind else place.near_y
    side = -1 if station == 'C' else 1
    turned = from_behind == (side > 0)
    return BinFrame(
        (left + length if turned else left, side * away, place.deck_z), math.pi if turned else 0.0
    )


def bin_blocks(layout: Layout, station: str, spec: BinSpec) -> tuple[Block, ...]:
    """Deck and walls of a bin as blocks in `cell`.

    The left wall is where x of the bin frame is 0, the back wall is away from the rail.
    """
    length, breadth, height = (edge / 1000 for edge in spec.size_mm)
    wall, deck = layout.stations.wall, layout.stations.deck_z
    parts: list[tuple[str, Vec3, Vec3]] = [
        ('floor', (-wall, -wall, -deck), (length + wall, breadth + wall, 0.0))
    ]
    at_origin = ((-wall, -wall, 0.0), (length + wall, 0.0, height))
    opposite = ((-wall, breadth, 0.0), (length + wall, breadth + wall, height))
    if spec.walls is not Walls.NONE:
        parts += [
            ('left wall', (-wall, 0.0, 0.0), (0.0, breadth, height)),
            ('right wall', (length, 0.0, 0.0), (length + wall, breadth, height)),
        ]
        if spec.walls is Walls.OPEN_FRONT:
            parts.append(('back wall', *at_origin))
        else:
            parts += [('front wall', *at_origin), ('back wall', *opposite)]
    frame = bin_frame(layout, station, spec)
    return tuple(_block(frame, f'bin {station} {name}', low, high) for name, low, high in parts)


def _block(frame: BinFrame, name: str, low: Vec3, high: Vec3) -> Block:
    corner, opposite = frame.to_cell(Pose(low)).position, frame.to_cell(Pose(high)).position
    pairs = [(min(a, b), max(a, b)) for a, b in zip(corner, opposite, strict=True)]
    return Block(
        name, (pairs[0][0], pairs[1][0], pairs[2][0]), (pairs[0][1], pairs[1][1], pairs[2][1])
    )


def conveyor_block(layout: Layout) -> Block:
    """The head of the conveyor, floor to belt."""
    belt = layout.conveyor
    return Block(
        'conveyor',
        (-belt.width / 2, belt.front_y, 0.0),
        (belt.width / 2, belt.front_y + belt.length, belt.top_z),
    )


def rail_block(layout: Layout) -> Block:
    """The rail on the floor."""
    rail = layout.rail
    reach = rail.pedestal_radius + 0.05
    return Block('rail', (rail.x_min - reach, -0.12, 0.0), (rail.x_max + reach, 0.12, 0.10))


def _pedestal_sweep(layout: Layout) -> Block:
    rail = layout.rail
    radius = rail.pedestal_radius
    return Block(
        'rail and pedestal',
        (rail.x_min - radius, -radius, 0.0),
        (rail.x_max + radius, radius, rail.base_height),
    )


def pick_pose(layout: Layout, size_mm: Vec3, lies: str = 'xyz') -> Pose:
    """Centre of a box of ``size_mm`` at the pick point, frame `cell`.

    ``lies`` names the axes of the box along those of the frame: a tilt tray may have tipped it.
    """
    belt = layout.conveyor
    _, depth, height = oriented_size(size_mm, lies)
    centre = (0.0, belt.front_y + depth / 2000, belt.top_z + height / 2000)
    return Pose(centre, QUATERNIONS[lies])


def lifting_limit(layout: Layout) -> float:
    """Heaviest box that the robot lifts with its mast held vertical, kg (data sheet)."""
    return find_robot(layout.robot).payload_tool_down - layout.tool.mass


def check_layout(layout: Layout, bins: Mapping[str, BinSpec]) -> Layout:
    """Return ``layout`` when it can be built with ``bins`` by station; else :class:`LayoutError`.

    Checks the robot's name, signs and sizes of all values, that the pick point is where the other
    nodes know it, the order of the rail's ends, and that no two of conveyor, rail, pedestal and
    bins overlap.
    """
    try:
        find_robot(layout.robot)
    except ValueError as error:
        raise LayoutError(f'layout: {error}') from None
    if lifting_limit(layout) <= 0:
        msg = (
            f'layout: tool.mass is {layout.tool.mass:g} kg, all that {layout.robot} lifts; '
            'take a lighter tool or a stronger robot'
        )
        raise LayoutError(msg)
    for name in _PARTS:
        part = getattr(layout, name)
        for value in fields(part):
            _check_number(f'{name}.{value.name}', getattr(part, value.name))
    for name, fixed in PICK_POINT.items():
        value = getattr(layout.conveyor, name)
        if value != fixed:
            msg = (
                f'layout: conveyor.{name} is {value:g}; planner and conveyor know the pick point '
                f'as {fixed:g} m, so leave it and move rail and stations instead'
            )
            raise LayoutError(msg)
    if layout.rail.x_min > layout.rail.x_max:
        msg = (
            f'layout: rail.x_min {layout.rail.x_min} is above rail.x_max {layout.rail.x_max}; '
            'the arm stands still where both are the same'
        )
        raise LayoutError(msg)
    blocks = [conveyor_block(layout), _pedestal_sweep(layout)]
    for station, spec in bins.items():
        blocks += bin_blocks(layout, station, spec)
    for block, other in itertools.combinations(blocks, 2):
        if block.name.split()[:2] != other.name.split()[:2] and block.overlaps(other):
            msg = (
                f'layout: {block.name} ({_span(block)}) overlaps {other.name} ({_span(other)}); '
                'move the station or use a smaller bin'
            )
            raise LayoutError(msg)
    return layout


def _check_number(name: str, number: float) -> None:
    where = f'layout: {name} is {number}'
    if not math.isfinite(number):
        raise LayoutError(f'{where}; it must be finite')
    least, most = _RANGES.get(name, (0.0, _LONGEST))
    if number <= least and name not in _FROM:
        raise LayoutError(f'{where}; it must be above {least:g}')
    if number < least or number > most:
        raise LayoutError(f'{where}; it must be {least:g} to {most:g}')


def _span(block: Block) -> str:
    return ', '.join(
        f'{axis} {low:.2f} to {high:.2f} m'
        for axis, low, high in zip('xyz', block.low, block.high, strict=True)
    )
