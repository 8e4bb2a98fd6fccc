"""Static equilibrium of stacks: load-bearable support, passed down to the floor.

A box can stand firmly on tops that reach it and still be the straw that tips what carries them: raw
contact under one box says nothing of the boxes below. Here every box has a *bearing polygon*, the
part of its top on which it may be loaded at any point, by any weight, and nothing below it tips.

- On the floor it is the whole of what the box surely covers.
- Higher up it is the convex hull of what the box shares with the bearing polygons of its
  supporters: a force on a point of that hull is carried by forces on those shared parts, each of
  which goes down the same way, to the floor.

A box whose centre of mass lies over its own bearing polygon therefore stands whatever the weights
are, and nothing that is placed on bearing polygons later changes that (load-bearable convex
polygons, arXiv 2507.09123). A linear program over all contact forces is the weaker condition that
tests hold this against.

*Surely covers*: the scanned size, not the space that was reserved, in the middle of that space, and
on each side less by ``Profile.bearing_inset_mm``, which stands for the error of scanner and arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from pack_msgs_py.geometry.footprint import planned_footprint, true_size
from pack_msgs_py.geometry.polygon import (
    Point,
    Polygon,
    Rect,
    area,
    clipped,
    convex_hull,
    distance_inside,
    overlap,
)
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import PlacedBox

#: Polygons lie on a grid of a micrometre, so that no edge is so short that its direction is noise.
DECIMALS = 3
#: What is shared is no contact when it has less than this, square millimetres.
LEAST_AREA_MM2 = 1e-3

#: What a box surely covers, ``None`` for nothing.
Footprint = Callable[[PlacedBox], 'Rect | None']
#: Which of some boxes carry one.
Carriers = Callable[[PlacedBox, Sequence[PlacedBox]], Sequence[PlacedBox]]


class Bearing:
    """Bearing polygons of the boxes of one bin, each found once.

    Parameters
    ----------
    boxes : those that may carry others.
    tolerance_mm : how far below its base a top may lie to carry a box, by plan.
    footprint : what a box surely covers, bin frame, millimetres.
    carriers : which boxes with such tops really carry a box.
    """

    def __init__(
        self,
        boxes: Sequence[PlacedBox],
        tolerance_mm: int,
        footprint: Footprint,
        carriers: Carriers,
    ) -> None:
        self._tolerance_mm, self._footprint, self._carriers = tolerance_mm, footprint, carriers
        self._known: dict[str, Polygon] = {}
        self._by_top: dict[int, list[PlacedBox]] = {}
        for placed in boxes:
            self._by_top.setdefault(placed.top_mm, []).append(placed)

    def of(self, placed: PlacedBox) -> Polygon:
        """Where ``placed`` may be loaded, counter-clockwise; empty when nothing carries it."""
        if placed.box.id not in self._known:
            self._known[placed.box.id] = self._find(placed)
        return self._known[placed.box.id]

    def stability_mm(self, placed: PlacedBox, centre: Point) -> float:
        """How far ``centre``, the centre of mass of ``placed``, lies inside its bearing polygon.

        Millimetres, negative outside, negative infinity where nothing carries the box.
        """
        polygon = self.of(placed)
        return distance_inside(polygon, centre) if len(polygon) > 2 else -math.inf

    def _find(self, placed: PlacedBox) -> Polygon:
        base = self._footprint(placed)
        if base is None:
            return []
        if placed.corner_mm[2] == 0:
            x0, y0, x1, y1 = base
            return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        shared: Polygon = []
        base_mm = placed.corner_mm[2]
        below = [
            other
            for top_mm in range(base_mm - self._tolerance_mm, base_mm + 1)
            for other in self._by_top.get(top_mm, ())
        ]
        for other in self._carriers(placed, below):
            part = clipped(self.of(other), base)
            if area(part) >= LEAST_AREA_MM2:
                shared += [(round(x, DECIMALS), round(y, DECIMALS)) for x, y in part]
        hull = convex_hull(shared)
        return hull if len(hull) > 2 else []


def planned_bearing(boxes: Sequence[PlacedBox], profile: Profile) -> Bearing:
    """Bearing polygons by plan: scanned sizes in the middle of the reserved space."""

    tolerance_mm = profile.support_tolerance_mm

    def footprint(placed: PlacedBox) -> Rect | None:
        return sure_footprint(placed, profile.bearing_inset_mm)

    def carriers(placed: PlacedBox, others: Sequence[PlacedBox]) -> list[PlacedBox]:
        return supporters(placed, others, tolerance_mm)

    return Bearing(boxes, tolerance_mm, footprint, carriers)


def supporters(placed: PlacedBox, others: Sequence[PlacedBox], tolerance: int) -> list[PlacedBox]:
    """Boxes that share area with the base and whose tops lie at most ``tolerance`` mm under it."""
    base, footprint = placed.corner_mm[2], planned_footprint(placed)
    return [
        other
        for other in others
        if 0 <= base - other.top_mm <= tolerance
        and overlap(footprint, planned_footprint(other)) is not None
    ]


def sure_footprint(placed: PlacedBox, inset_mm: float) -> Rect | None:
    """What ``placed`` covers for certain, (x0, y0, x1, y1) in the bin frame, millimetres.

    ``None`` when nothing is left of it.
    """
    (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
    length, breadth, _ = true_size(placed)
    half_x, half_y = length / 2 - inset_mm, breadth / 2 - inset_mm
    if half_x <= 0 or half_y <= 0:
        return None
    centre_x, centre_y = x + dx / 2, y + dy / 2
    return (centre_x - half_x, centre_y - half_y, centre_x + half_x, centre_y + half_y)
