"""What is wrong with a placement that is asked for: rules, commanded pose, footing.

A box must stand firmly by what was measured, not only by the space that was reserved. A reservation
is larger than its box: by the clearance, the margin for the scanner's error, and the rounding to
the grid. Two boxes whose reservations share a strip of a grid step may not touch at all, and a box
that has its third corner on such a strip tips over. Tops that were planned level may not be: a box
stands on the highest ones, and leans over to the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from arm_executor.bins.records import placed_of
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.geometry.footprint import measured_footprint, true_size
from pack_msgs_py.geometry.polygon import overlap
from pack_msgs_py.geometry.pose import Pose, Quaternion, rotation_matrix
from pack_msgs_py.geometry.resting import measured_top_mm, rest_height_mm, with_measured
from pack_msgs_py.geometry.tolerance import HEIGHT_TOLERANCE_MM
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import centre_of_mass
from pack_msgs_py.statics import Bearing, supporters
from pack_msgs_py.validator import broken_rules
from pack_msgs_py.values import Bin, PlacedBox, Vec3

#: A box may be turned so far from the orientation that was planned.
ANGLE_TOLERANCE_RAD = math.radians(1.0)
#: The centre of mass lies so far inside the support polygon, mm: scanner and arm are a little off.
LEAST_MARGIN_MM = 4.0
#: Tops this far below the highest one carry nothing, mm and as a share of the shorter edge of the
#: base: a box that leans so far is 1 degree off.
LEVEL_MM, LEVEL_SHARE = 4.0, math.sin(math.radians(1.0))


def placement_errors(decision: Decision, target: Bin, profile: Profile) -> list[str]:
    """Which rules the placement breaks in ``target`` as it is now, one sentence each.

    Those of the profile, that the commanded pose is the one that was planned, and that the box
    stands firmly by what was measured.
    """
    placed, boxes = placed_of(decision), target.boxes
    broken = broken_rules(placed, boxes, target.spec, profile, target.destination)
    return [
        *map(str, broken),
        *commanded_pose_errors(placed, decision.target, profile, boxes),
        *footing_errors(placed, boxes, profile),
    ]


def commanded_pose_errors(
    placed: PlacedBox, target: Pose, profile: Profile, others: Sequence[PlacedBox] = ()
) -> list[str]:
    """How ``target`` (bin frame) contradicts the corner, size and orientation of ``placed``.

    A stack of boxes stands a little higher or lower than planned: the base may also be where it is
    expected to rest, and where the tops of those of ``others`` that carry the box were measured.
    """
    errors = []
    size = true_size(placed)
    planned: Vec3 = (
        placed.corner_mm[0] + placed.size_mm[0] / 2,
        placed.corner_mm[1] + placed.size_mm[1] / 2,
        placed.corner_mm[2] + size[2] / 2,
    )
    steps = (profile.resolution_mm, profile.resolution_mm, profile.resolution_z_mm)
    base_mm = placed.corner_mm[2]
    below = supporters(placed, others, profile.support_tolerance_mm)
    heights_mm = [
        base_mm,
        rest_height_mm(placed, others),
        rest_height_mm(with_measured(placed, target), others),
        *map(measured_top_mm, below),
    ]
    for axis, wanted, metres, step in zip('xyz', planned, target.position, steps, strict=True):
        off = 1e3 * metres - wanted
        low, high, allowed = 0.0, 0.0, step + 1e-6
        if axis == 'z':
            low, high = min(heights_mm) - base_mm, max(heights_mm) - base_mm
            allowed += HEIGHT_TOLERANCE_MM
        if not low - allowed <= off <= high + allowed:
            errors.append(
                f'pose.{axis} is {1e3 * metres:.1f} mm where corner, size and orientation '
                f'put the centre at {wanted:.1f} mm, more than {allowed:g} mm away'
            )
    angle = orientation_error(target.quaternion, placed.orientation)
    if angle > ANGLE_TOLERANCE_RAD:
        errors.append(
            f'pose turns the box {math.degrees(angle):.1f} degrees away from '
            f'orientation {placed.orientation!r}'
        )
    return errors


def orientation_error(quaternion: Quaternion, orientation: str) -> float:
    """Largest angle between a box axis and the bin axis it should lie along, radians.

    The sign of an axis is free, since a rectangular box looks the same either way.
    """
    matrix = rotation_matrix(quaternion)
    return max(
        math.acos(min(1.0, abs(matrix[row]['xyz'.index(axis)])))
        for row, axis in enumerate(orientation)
    )


def footing_errors(placed: PlacedBox, others: Sequence[PlacedBox], profile: Profile) -> list[str]:
    """Why ``placed`` would not stand firmly on ``others``; nothing where no rule asks for it.

    What carries it is followed down to the floor (:mod:`pack_msgs_py.statics`).
    """
    asked = (profile.com_margin_mm, profile.stability_margin_mm)
    if placed.corner_mm[2] == 0 or asked == (None, None):
        return []

    tolerance_mm = profile.support_tolerance_mm

    def carriers(upper: PlacedBox, boxes: Sequence[PlacedBox]) -> list[PlacedBox]:
        return _level(upper, supporters(upper, boxes, tolerance_mm))

    bearing = Bearing(others, tolerance_mm, measured_footprint, carriers)
    inside = bearing.stability_mm(placed, centre_of_mass(placed))
    if inside >= LEAST_MARGIN_MM:
        return []
    names = ', '.join(repr(other.box.id) for other in carriers(placed, others)) or 'nothing'
    text = (
        f'box {placed.box.id!r} would tip over on {names}: by measured sizes its centre of mass '
        f'lies {inside:.1f} mm inside what carries it, {LEAST_MARGIN_MM:g} mm are needed'
    )
    return [text]


def _level(upper: PlacedBox, below: Sequence[PlacedBox]) -> list[PlacedBox]:
    """Those of ``below`` that really lie under ``upper``, and high enough to carry it."""
    base = measured_footprint(upper)
    under = [other for other in below if overlap(base, measured_footprint(other)) is not None]
    highest_mm = max(map(measured_top_mm, under), default=0.0)
    level_mm = min(LEVEL_MM, LEVEL_SHARE * min(base[2] - base[0], base[3] - base[1]))
    return [other for other in under if measured_top_mm(other) >= highest_mm - level_mm]
