"""Boxes and bins."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time as TimeMsg
from diagnostic_msgs.msg import KeyValue

from pack_msgs.msg import (
    BinState,
    BinStateArray,
)
from pack_msgs.msg import Box as BoxMsg
from pack_msgs.msg import PlacedBox as PlacedBoxMsg
from pack_msgs_py.cell_values import BinSnapshot
from pack_msgs_py.checks import (
    InvalidValue,
    check_count,
    check_finite,
    check_length,
    check_name,
    check_orientation,
    check_whole_mm,
    clean_text,
)
from pack_msgs_py.codes import BinStatus
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros.conversions.basic import (
    pose_from_ros,
    pose_to_ros,
    tidy,
    time_from_ros,
    time_to_ros,
    vector_from_ros,
    vector_to_ros,
)
from pack_msgs_py.values import (
    Bin,
    Box,
    Int3,
    PlacedBox,
    bin_called,
    check_box,
    frame_name,
    shortened,
)

#: More than any bin, and any cell, holds.
MOST_BOXES, MOST_BINS = 10_000, 100

#: More than this is no description of a box any more: number of attributes.
MAX_ATTRIBUTES = 64


def attributes_to_ros(extra: Sequence[tuple[str, str]]) -> list[KeyValue]:
    """What else is known of a box as diagnostic_msgs/KeyValue."""
    return [KeyValue(key=key, value=value) for key, value in extra]


def attributes_from_ros(name: str, msgs: Sequence[KeyValue]) -> tuple[tuple[str, str], ...]:
    """diagnostic_msgs/KeyValue as checked pairs; refuses empty and repeated keys."""
    if len(msgs) > MAX_ATTRIBUTES:
        text = f'{name}: there are {len(msgs)} of them; at most {MAX_ATTRIBUTES} are taken'
        raise InvalidValue(text)
    pairs = tuple((check_name(f'{name} key', item.key), clean_text(item.value)) for item in msgs)
    keys = [key for key, _ in pairs]
    if '' in keys or len(set(keys)) != len(keys):
        text = f'{name}: the keys {keys} must not be empty, and each be there once'
        raise InvalidValue(text)
    return pairs


def box_to_ros(box: Box) -> BoxMsg:
    """A box as pack_msgs/Box."""
    return BoxMsg(
        id=box.id,
        size=vector_to_ros(box.size_mm, 1e-3),
        mass=float(box.weight_kg),
        com_offset=vector_to_ros(box.com_offset_mm, 1e-3),
        allowed_up=box.allowed_up,
        max_top_load=-1.0 if box.max_top_load_n is None else float(box.max_top_load_n),
        destination=box.destination,
        size_stddev=vector_to_ros(box.size_stddev_mm, 1e-3),
        yaw_stddev=float(box.yaw_stddev_rad),
        attributes=attributes_to_ros(box.extra),
    )


def box_from_ros(msg: BoxMsg) -> Box:
    """pack_msgs/Box as a checked value."""
    load = check_finite('max_top_load', msg.max_top_load)
    name = f'box {shortened(msg.id)}'
    return check_box(
        Box(
            id=msg.id,
            size_mm=tidy(vector_from_ros(f'{name} size', msg.size, 1e3)),
            weight_kg=check_finite(f'{name} mass', msg.mass),
            com_offset_mm=tidy(vector_from_ros('com_offset', msg.com_offset, 1e3)),
            allowed_up=msg.allowed_up,
            max_top_load_n=None if load < 0 else load,
            destination=check_name('destination', msg.destination),
            size_stddev_mm=tidy(vector_from_ros('size_stddev', msg.size_stddev, 1e3)),
            yaw_stddev_rad=check_finite(f'{name} yaw_stddev', msg.yaw_stddev),
            extra=attributes_from_ros(f'{name} attributes', msg.attributes),
        )
    )


def placed_box_to_ros(placed: PlacedBox, pose: Pose) -> PlacedBoxMsg:
    """A placed box with its measured ``pose`` (bin frame) as pack_msgs/PlacedBox."""
    return PlacedBoxMsg(
        box=box_to_ros(placed.box),
        orientation=placed.orientation,
        planned_corner=vector_to_ros(placed.corner_mm, 1e-3),
        planned_size=vector_to_ros(placed.size_mm, 1e-3),
        pose=pose_to_ros(pose),
    )


def placed_box_from_ros(msg: PlacedBoxMsg) -> PlacedBox:
    """pack_msgs/PlacedBox as a checked value."""
    pose = pose_from_ros('pose', msg.pose)
    corner, size = msg.planned_corner, msg.planned_size
    x, y, z = pose.position
    return PlacedBox(
        box=box_from_ros(msg.box),
        corner_mm=check_whole_mm('planned_corner', (corner.x, corner.y, corner.z)),
        size_mm=check_whole_mm('planned_size', (size.x, size.y, size.z)),
        orientation=check_orientation(msg.orientation),
        measured_mm=tidy((1e3 * x, 1e3 * y, 1e3 * z)),
    )


def bin_to_ros(bin_: Bin, poses: dict[str, Pose], stamp: TimeMsg, status: BinStatus) -> BinState:
    """A bin as pack_msgs/BinState; ``poses`` holds the measured pose of each box by id."""
    msg = BinState(
        bin_id=bin_.id,
        serial=bin_.serial,
        bin_type=bin_.spec.name,
        station=bin_.station,
        destination=bin_.destination,
        revision=bin_.revision,
        size=vector_to_ros(bin_.spec.size_mm, 1e-3),
        status=int(status),
        boxes=[placed_box_to_ros(placed, poses[placed.box.id]) for placed in bin_.boxes],
    )
    msg.header.stamp = stamp
    msg.header.frame_id = frame_name(bin_.station)
    return msg


def bin_from_ros(msg: BinState) -> Bin:
    """pack_msgs/BinState as a checked value; refuses boxes that do not lie in the bin."""
    for name in ('bin_id', 'bin_type', 'station', 'destination'):
        check_name(name, getattr(msg, name))
    check_length(f'bin {msg.bin_id!r}', msg.boxes, MOST_BOXES)
    size = check_whole_mm('bin size', (msg.size.x, msg.size.y, msg.size.z))
    if not msg.bin_id or min(size) <= 0:
        text = f'bin {msg.bin_id!r} of size {size} mm must have an id and positive sizes'
        raise InvalidValue(text)
    try:
        spec = bin_called(msg.bin_type, size)
    except ValueError as error:
        text = f'bin {msg.bin_id!r} cannot be used: {error}'
        raise InvalidValue(text) from error
    return Bin(
        id=msg.bin_id,
        serial=msg.serial,
        spec=spec,
        boxes=tuple(_inside(placed_box_from_ros(placed), size) for placed in msg.boxes),
        station=msg.station,
        revision=check_count('revision', msg.revision),
        destination=msg.destination,
    )


def _inside(placed: PlacedBox, bin_size: Int3) -> PlacedBox:
    """``placed`` if its plan lies within a bin of ``bin_size`` millimetres."""
    corner, size = placed.corner_mm, placed.size_mm
    ends = tuple(low + edge for low, edge in zip(corner, size, strict=True))
    if min(corner) < 0 or min(size) <= 0 or any(map(int.__gt__, ends, bin_size)):
        text = (
            f'box {placed.box.id!r} is planned from {corner} to {ends} mm; '
            f'it must lie in its bin of {bin_size} mm'
        )
        raise InvalidValue(text)
    return placed


def bins_to_ros(
    snapshot: BinSnapshot, poses: dict[str, Pose], status: dict[str, BinStatus] | None = None
) -> BinStateArray:
    """All standing bins as pack_msgs/BinStateArray; ``status`` by bin id, open if not named."""
    stamp = time_to_ros(snapshot.stamp_s)
    states = status or {}
    msg = BinStateArray(
        revision=snapshot.revision,
        bins=[
            bin_to_ros(bin_, poses, stamp, states.get(bin_.id, BinStatus.OPEN))
            for bin_ in snapshot.bins
        ],
    )
    msg.header.stamp = stamp
    return msg


def bins_from_ros(msg: BinStateArray, *, every: bool = False) -> BinSnapshot:
    """pack_msgs/BinStateArray as a checked value; only bins that accept boxes, or ``every`` one."""
    check_length('bin_state', msg.bins, MOST_BINS)
    bins = [
        bin_from_ros(state) for state in msg.bins if every or state.status == BinState.STATUS_OPEN
    ]
    ids = [bin_.id for bin_ in bins]
    if len(set(ids)) != len(ids):
        text = f'bin ids {", ".join(ids)} must differ'
        raise InvalidValue(text)
    ordered = tuple(sorted(bins, key=lambda bin_: bin_.serial))
    revision = check_count('revision', msg.revision)
    return BinSnapshot(revision, time_from_ros(msg.header.stamp), ordered)
