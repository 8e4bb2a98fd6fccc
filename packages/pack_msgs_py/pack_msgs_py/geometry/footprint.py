"""What a placed box covers: as it was planned, and as it was measured. Bin frame, millimetres."""

from __future__ import annotations

from pack_msgs_py.geometry.polygon import Rect
from pack_msgs_py.geometry.pose import rotated
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.values import PlacedBox, Vec3


def true_size(placed: PlacedBox) -> Vec3:
    """Sizes of the box along the bin's axes without what was reserved around it, mm."""
    return oriented_size(placed.box.size_mm, placed.orientation)


def oriented_offset(offset_mm: Vec3, orientation: str) -> Vec3:
    """``offset_mm``, box axes, along the bin's axes once the box is placed in ``orientation``."""
    x, y, z = rotated(QUATERNIONS[orientation], offset_mm)
    return (round(x, 9), round(y, 9), round(z, 9))


def planned_footprint(placed: PlacedBox) -> Rect:
    """What is reserved for a box, bin frame, mm."""
    (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
    return (x, y, x + dx, y + dy)


def measured_footprint(placed: PlacedBox) -> Rect:
    """What a box covers by its scanned size, where it was measured or is to stand, mm."""
    length, breadth, _ = true_size(placed)
    (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
    centre = placed.measured_mm or (x + dx / 2, y + dy / 2, 0.0)
    return (
        centre[0] - length / 2,
        centre[1] - breadth / 2,
        centre[0] + length / 2,
        centre[1] + breadth / 2,
    )
