"""What boxes take up once they are measured: more than was reserved, where they stick out of that.

A box that was knocked, or that the scanner saw too small, may stand a few millimetres beyond its
place. Its neighbour's margins bear a little; more, and what comes beside it catches on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pack_msgs_py.geometry.footprint import measured_footprint
from pack_msgs_py.values import BinSpec, PlacedBox

#: A box may stick out by so much, mm: that leaves a third of the margin of what comes beside it.
STICKS_OUT_MM = 2.0


def taken_up(
    boxes: Sequence[PlacedBox], bin_spec: BinSpec, step_mm: int
) -> tuple[PlacedBox, ...]:  # fmt: skip
    """``boxes`` in places that also hold them where they were measured, on a grid of ``step_mm``.

    Each is the same object where it does not stick out.
    """
    return tuple(_grown(placed, bin_spec, step_mm) for placed in boxes)


def _grown(placed: PlacedBox, bin_spec: BinSpec, step_mm: int) -> PlacedBox:
    if placed.measured_mm is None:
        return placed
    corner, far = list(placed.corner_mm), list(placed.far_mm)
    footprint = measured_footprint(placed)
    for axis in (0, 1):
        low, high = footprint[axis], footprint[axis + 2]
        if low < corner[axis] - STICKS_OUT_MM:
            corner[axis] = max(0, int(low // step_mm) * step_mm)
        if high > far[axis] + STICKS_OUT_MM:
            far[axis] = min(bin_spec.size_mm[axis], -int(-high // step_mm) * step_mm)
    if corner == list(placed.corner_mm) and far == list(placed.far_mm):
        return placed
    size = (far[0] - corner[0], far[1] - corner[1], placed.size_mm[2])
    return replace(placed, corner_mm=(corner[0], corner[1], corner[2]), size_mm=size)
