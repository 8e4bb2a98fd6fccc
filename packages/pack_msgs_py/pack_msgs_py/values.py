"""Values that every part of the cell shares: boxes, bins, placements.

Lengths in the core are millimetres. Planned geometry is integer millimetres in the bin frame:
origin at the inner front-left-bottom corner, x along the length, y along the breadth, z up.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from enum import Enum

Vec3 = tuple[float, float, float]
Int3 = tuple[int, int, int]

MAX_EDGE_MM = 10_000.0
MAX_WEIGHT_KG = 10_000.0
MAX_STDDEV_MM = 1000.0
MAX_YAW_STDDEV_RAD = 0.2
MAX_TOP_LOAD_N = 1e7

#: Faces that may point up; a box's ``allowed_up`` is a bitwise OR of these.
UP_POS_X, UP_NEG_X, UP_POS_Y, UP_NEG_Y, UP_POS_Z, UP_NEG_Z = 1, 2, 4, 8, 16, 32
UP_ANY = 63

_BIN_SIZE_CM = re.compile(r'^(\d+(?:\.\d)?)x(\d+(?:\.\d)?)x(\d+(?:\.\d)?)$')


@dataclass(frozen=True)
class Box:
    """A rigid rectangular box.

    Attributes
    ----------
    id : names the box for its whole life.
    size_mm : edge lengths along the box's own x, y, z, as measured; z stands up on the belt.
    weight_kg : total mass.
    com_offset_mm : centre of mass relative to the geometric centre, box axes.
    allowed_up : faces that may point up, OR of the ``UP_*`` constants.
    max_top_load_n : load the top may carry, newtons; 0 none, ``None`` not known.
    destination : where it is bound for, empty when the cell does not sort.
    size_stddev_mm : one standard deviation of the measured edges; 0 when not estimated.
    extra : what others know of it, such as `barcode`, `sku`, `order_id`, and further columns of a
        box file: kept as it came; no decision rests on it.
    yaw_stddev_rad : one standard deviation of the angle about the vertical at which it lies.
    """

    id: str
    size_mm: Vec3
    weight_kg: float = 1.0
    com_offset_mm: Vec3 = (0.0, 0.0, 0.0)
    allowed_up: int = UP_ANY
    max_top_load_n: float | None = None
    destination: str = ''
    size_stddev_mm: Vec3 = (0.0, 0.0, 0.0)
    extra: tuple[tuple[str, str], ...] = field(default=(), compare=False)
    yaw_stddev_rad: float = 0.0

    @property
    def volume_mm3(self) -> float:
        """True volume, cubic millimetres."""
        return self.size_mm[0] * self.size_mm[1] * self.size_mm[2]

    def room_stddev(self, stddev: float, across: float) -> float:
        """Standard deviation of the room along a level edge, in the unit of both.

        ``stddev`` is that of the edge, ``across`` the length of the other level one: a box that
        lies askew by a small angle takes up that share of it more.
        """
        return math.hypot(stddev, self.yaw_stddev_rad * across)


class Walls(str, Enum):
    """What stands around a bin's floor; the value is how it is written after a kind of bin."""

    CLOSED = 'box'
    OPEN_FRONT = 'cage'
    NONE = 'pallet'


@dataclass(frozen=True)
class BinSpec:
    """A kind of bin: its name, its inner size (L, B, H) in millimetres, and its walls."""

    name: str
    size_mm: Int3
    walls: Walls = Walls.CLOSED

    @property
    def volume_mm3(self) -> int:
        """Inner volume, cubic millimetres."""
        return self.size_mm[0] * self.size_mm[1] * self.size_mm[2]


@dataclass(frozen=True)
class PlacedBox:
    """A box in a bin, as planned, and where it was measured to rest.

    Attributes
    ----------
    box : the box itself, true size.
    corner_mm : planned corner nearest the bin's origin.
    size_mm : planned sizes along the bin's axes, after rotation, clearance and rounding.
    orientation : box axes along the bin's x, y, z, for example ``'yxz'``.
    measured_mm : measured centre in the bin frame, ``None`` before it was measured.
    """

    box: Box
    corner_mm: Int3
    size_mm: Int3
    orientation: str = 'xyz'
    measured_mm: Vec3 | None = None

    @property
    def top_mm(self) -> int:
        """Height of the planned top face above the bin floor."""
        return self.corner_mm[2] + self.size_mm[2]

    @property
    def far_mm(self) -> Int3:
        """Planned corner farthest from the bin's origin."""
        c, s = self.corner_mm, self.size_mm
        return (c[0] + s[0], c[1] + s[1], c[2] + s[2])


@dataclass(frozen=True)
class Bin:
    """One bin that stands, or stood, in the cell.

    ``serial`` counts bins in the order they were opened, from 1; ``revision`` grows with each
    change of content. ``destination`` is the only one whose boxes may go in, empty for any box.
    """

    id: str
    serial: int
    spec: BinSpec
    boxes: tuple[PlacedBox, ...] = ()
    station: str = 'A'
    revision: int = 0
    destination: str = ''

    @property
    def fill_rate(self) -> float:
        """Share of the inner volume that true box volumes take, 0 to 1 (eq. 2 of Ojha et al.)."""
        return sum(p.box.volume_mm3 for p in self.boxes) / self.spec.volume_mm3

    @property
    def weight_kg(self) -> float:
        """Total mass of the boxes inside."""
        return sum(p.box.weight_kg for p in self.boxes)


#: The kinds of bin that have a name: those of Ojha et al., section IV. One line adds another.
BIN_TYPES: dict[str, BinSpec] = {
    spec.name: spec
    for spec in (
        BinSpec('LDC', (1200, 800, 800)),
        BinSpec('RC', (1200, 700, 1600), Walls.OPEN_FRONT),
        BinSpec('PAL', (2200, 1200, 800), Walls.NONE),
        BinSpec('EQ', (800, 800, 800)),
        BinSpec('SYN', (800, 450, 450)),
    )
}
#: How a kind of bin is written, for help texts and tables.
BIN_KINDS = (
    f'{", ".join(BIN_TYPES)} or LxBxH in centimetres such as 100x60x60; '
    ':box (closed), :cage (open front) or :pallet (no walls) may follow'
)


def parse_bin(text: str) -> BinSpec:
    """Turn ``'LDC'`` or ``'120x80x80'`` (L x B x H in centimetres) into a :class:`BinSpec`.

    The walls may follow: ``'120x80x150:pallet'``, ``'120x80x150:cage'``, ``'RC:box'``. Without
    them a bin has those of its kind, and ``LxBxH`` is a closed box; so the name leaves them out.

    Raises
    ------
    ValueError
        The text is neither a known bin nor three sizes between 1 cm and 10 m, or the walls are not
        known.
    """
    kind, colon, word = text.strip().partition(':')
    plain = BIN_TYPES.get(kind.upper()) or _bin_of_size(kind, text)
    if not colon:
        return plain
    try:
        walls = Walls(word.strip().lower())
    except ValueError:
        known = ', '.join(f'{kind}:{walls.value}' for walls in Walls)
        msg = f'bin {text!r} has unknown walls {word!r}: use one of {known}'
        raise ValueError(msg) from None
    if walls is plain.walls:
        return plain
    return replace(plain, name=f'{plain.name}:{walls.value}', walls=walls)


def _bin_of_size(kind: str, text: str) -> BinSpec:
    match = _BIN_SIZE_CM.match(kind.lower())
    known = ', '.join(BIN_TYPES)
    if match is None:
        msg = f'unknown bin {text!r}: use one of {known}, or LxBxH in centimetres such as 100x60x60'
        raise ValueError(msg)
    length, breadth, height = (round(float(group) * 10) for group in match.groups())
    if not all(10 <= edge <= MAX_EDGE_MM for edge in (length, breadth, height)):
        msg = f'bin {text!r} is out of range: each edge must be between 1 and 1000 cm'
        raise ValueError(msg)
    return BinSpec(kind.lower(), (length, breadth, height))


def bin_called(name: str, size_mm: Int3) -> BinSpec:
    """The kind of bin that a message or a journal calls ``name``, with the size it gives.

    Its walls follow from the name as in :func:`parse_bin`; names of other people are closed boxes.

    Raises
    ------
    ValueError
        A kind that is known has another size.
    """
    kind, _, word = name.partition(':')
    known = BIN_TYPES.get(kind)
    if known is not None and known.size_mm != size_mm:
        msg = f'{kind} is a bin of {known.size_mm} mm, not of {size_mm} mm'
        raise ValueError(msg)
    if word in {walls.value for walls in Walls}:
        return BinSpec(name, size_mm, Walls(word))
    return BinSpec(name, size_mm, Walls.CLOSED if known is None else known.walls)


#: Where bins stand in the cell.
STATIONS = ('A', 'B', 'C')


def frame_name(station: str) -> str:
    """Name of the frame of the bin that stands at ``station``."""
    return f'bin_{station.lower()}'


def shortened(text: str, most: int = 60) -> str:
    """``text`` in quotes, as much of it as fits into a message."""
    return repr(text) if len(text) <= most else f'{text[:most]!r}... ({len(text)} characters)'


def check_box(box: Box) -> Box:
    """Return ``box`` unchanged, or raise ``ValueError`` saying which value is wrong and why."""
    if not box.id or len(box.id) > 200 or not box.id.isprintable():
        msg = f'box id {shortened(box.id)} must be 1 to 200 printable characters'
        raise ValueError(msg)
    for axis, edge in zip('xyz', box.size_mm, strict=True):
        if not math.isfinite(edge) or edge <= 0 or edge > MAX_EDGE_MM:
            msg = (
                f'box {box.id!r}: size {axis} is {edge:g} mm; '
                f'it must be above 0 and at most {MAX_EDGE_MM:g}'
            )
            raise ValueError(msg)
    if not math.isfinite(box.weight_kg) or box.weight_kg <= 0 or box.weight_kg > MAX_WEIGHT_KG:
        msg = (
            f'box {box.id!r}: weight is {box.weight_kg:g} kg; '
            f'it must be above 0 and at most {MAX_WEIGHT_KG:g}'
        )
        raise ValueError(msg)
    for axis, offset, edge in zip('xyz', box.com_offset_mm, box.size_mm, strict=True):
        if not math.isfinite(offset) or abs(offset) > edge / 2:
            msg = f'box {box.id!r}: centre of mass offset {axis} {offset:g} mm lies outside the box'
            raise ValueError(msg)
    if not 1 <= box.allowed_up <= UP_ANY:
        msg = f'box {box.id!r}: allowed_up is {box.allowed_up}; it must be 1 to {UP_ANY}'
        raise ValueError(msg)
    for axis, deviation in zip('xyz', box.size_stddev_mm, strict=True):
        if not 0 <= deviation <= MAX_STDDEV_MM:
            msg = (
                f'box {box.id!r}: standard deviation of size {axis} is {deviation:g} mm; '
                f'it must be 0 to {MAX_STDDEV_MM:g}'
            )
            raise ValueError(msg)
    if not 0 <= box.yaw_stddev_rad <= MAX_YAW_STDDEV_RAD:
        msg = (
            f'box {box.id!r}: standard deviation of the yaw is {box.yaw_stddev_rad:g} rad; '
            f'it must be 0 to {MAX_YAW_STDDEV_RAD:g}'
        )
        raise ValueError(msg)
    load = box.max_top_load_n
    if load is not None and not 0 <= load <= MAX_TOP_LOAD_N:
        msg = f'box {box.id!r}: max_top_load is {load:g} N; it must be 0 to {MAX_TOP_LOAD_N:g}'
        raise ValueError(msg)
    return box
