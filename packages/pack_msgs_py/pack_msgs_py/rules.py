"""The packing rules, written to be obviously right; speed is for the planner's engine.

Every rule is judged on planned geometry: integer millimetres in the bin frame, sizes after
rotation, clearance and rounding (design: 'Rules of a placement').
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from pack_msgs_py.geometry.footprint import oriented_offset, planned_footprint
from pack_msgs_py.geometry.polygon import Rect, hull_distance, overlap
from pack_msgs_py.orientation import ORIENTATIONS, orientation_allowed
from pack_msgs_py.profiles import Profile, planned_size
from pack_msgs_py.statics import planned_bearing, supporters
from pack_msgs_py.values import BinSpec, Box, PlacedBox

#: Polygons of carried support are snapped to a micrometre.
STABILITY_TOLERANCE_MM = 0.01

GRAVITY = 9.80665  # m/s2, standard gravity (ISO 80000-3)


class Rule(str, Enum):
    """Names of the rules, as they appear in errors, reports and records."""

    INSIDE_BIN = 'inside_bin'
    ON_GRID = 'on_grid'
    PLANNED_SIZE = 'planned_size'
    NO_OVERLAP = 'no_overlap'
    ACCESS_FROM_ABOVE = 'access_from_above'
    SUPPORT = 'support'
    ORIENTATION = 'orientation'
    CENTRE_OF_MASS = 'centre_of_mass'
    SUPPORT_SHARE = 'support_share'
    STABILITY = 'stability'
    PAYLOAD = 'payload'
    BIN_WEIGHT = 'bin_weight'
    TOP_LOAD = 'top_load'
    DUPLICATE_BOX = 'duplicate_box'
    DESTINATION = 'destination'


@dataclass(frozen=True)
class Violation:
    """A broken rule: which box, which rule, and a sentence with the numbers."""

    box_id: str
    rule: Rule
    message: str

    def __str__(self) -> str:
        return f'box {self.box_id!r} breaks {self.rule.value}: {self.message}'


def supported_vertices(
    placed: PlacedBox, others: Sequence[PlacedBox], profile: Profile
) -> tuple[bool, bool, bool, bool]:
    """Which base vertices rest: (x0 y0), (x1 y0), (x0 y1), (x1 y1).

    A vertex rests when the resolution cell inside the footprint at that corner lies wholly on one
    box top; touching an edge is no support. On the floor all four rest.
    """
    if placed.corner_mm[2] == 0:
        return (True, True, True, True)
    x0, y0, x1, y1 = planned_footprint(placed)
    step_x = min(profile.resolution_mm, x1 - x0)
    step_y = min(profile.resolution_mm, y1 - y0)
    tops = [planned_footprint(b) for b in supporters(placed, others, profile.support_tolerance_mm)]

    def rests(cx: float, cy: float) -> bool:
        return any(
            top[0] <= cx and top[1] <= cy and cx + step_x <= top[2] and cy + step_y <= top[3]
            for top in tops
        )

    return (
        rests(x0, y0),
        rests(x1 - step_x, y0),
        rests(x0, y1 - step_y),
        rests(x1 - step_x, y1 - step_y),
    )


def contact_rects(placed: PlacedBox, others: Sequence[PlacedBox], tolerance: int) -> list[Rect]:
    """Rectangles where the base rests, bin frame; the whole footprint on the floor."""
    if placed.corner_mm[2] == 0:
        return [planned_footprint(placed)]
    shared = (
        overlap(planned_footprint(placed), planned_footprint(other))
        for other in supporters(placed, others, tolerance)
    )
    return [rect for rect in shared if rect is not None]


def top_loads(boxes: Sequence[PlacedBox], tolerance: int) -> dict[str, float]:
    """Load on the top face of each box, newtons, by box id.

    A box passes its weight and all that stands on it to its supporters in proportion to the area
    they share with it.
    """
    loads = {placed.box.id: 0.0 for placed in boxes}
    for placed in sorted(boxes, key=lambda p: p.corner_mm[2], reverse=True):
        force = loads[placed.box.id] + placed.box.weight_kg * GRAVITY
        below = supporters(placed, boxes, tolerance)
        areas = []
        for other in below:
            rect = overlap(planned_footprint(placed), planned_footprint(other))
            assert rect is not None
            areas.append((rect[2] - rect[0]) * (rect[3] - rect[1]))
        for other, area in zip(below, areas, strict=True):
            loads[other.box.id] += force * area / sum(areas)
    return loads


def may_enter(box: Box, destination: str) -> bool:
    """Whether ``box`` may go into a bin that serves ``destination``; empty serves any box."""
    return destination in ('', box.destination)


def violations(
    placed: PlacedBox,
    others: Sequence[PlacedBox],
    bin_spec: BinSpec,
    profile: Profile,
    destination: str = '',
) -> Iterator[Violation]:
    """Every rule that ``placed`` would break in a bin that already holds ``others``.

    ``destination`` is what the bin serves, empty for any box.
    """

    def broken(rule: Rule, message: str) -> Violation:
        return Violation(placed.box.id, rule, message)

    if any(other.box.id == placed.box.id for other in others):
        yield broken(Rule.DUPLICATE_BOX, 'a box with this id is already in the bin')
        return
    if not may_enter(placed.box, destination):
        bound = placed.box.destination
        yield broken(
            Rule.DESTINATION, f'wrong destination: bound for {bound!r}, the bin for {destination!r}'
        )
    if placed.orientation not in ORIENTATIONS:
        yield broken(
            Rule.ORIENTATION,
            f'{placed.orientation!r} is no orientation; use one of {", ".join(ORIENTATIONS)}',
        )
        return
    yield from _geometry(placed, others, bin_spec, profile)
    if not orientation_allowed(placed.box, placed.orientation, profile.orientations):
        yield broken(
            Rule.ORIENTATION,
            f'{placed.orientation!r} is not allowed by {profile.orientations!r} '
            f'and allowed_up {placed.box.allowed_up}',
        )
    yield from _support(placed, others, profile)
    yield from _loads(placed, others, profile)


def _geometry(
    placed: PlacedBox, others: Sequence[PlacedBox], bin_spec: BinSpec, profile: Profile
) -> Iterator[Violation]:
    """Rules 1 and 2: inside, on the grid, the right size, no overlap, reachable from above."""
    steps = (profile.resolution_mm, profile.resolution_mm, profile.resolution_z_mm)
    for axis, low, high, limit in zip(
        'xyz', placed.corner_mm, placed.far_mm, bin_spec.size_mm, strict=True
    ):
        if low < 0 or high > limit or high <= low:
            yield Violation(
                placed.box.id,
                Rule.INSIDE_BIN,
                f'{axis} runs from {low} to {high} mm in a bin of {limit} mm',
            )
    for axis, low, step in zip('xy', placed.corner_mm, steps, strict=False):
        if low % step:
            yield Violation(
                placed.box.id, Rule.ON_GRID, f'{axis} = {low} mm is not a multiple of {step} mm'
            )
    wanted = planned_size(placed.box, placed.orientation, profile)
    if placed.size_mm != wanted:
        yield Violation(
            placed.box.id,
            Rule.PLANNED_SIZE,
            f'reserves {placed.size_mm} mm where profile {profile.name!r} needs {wanted} mm',
        )
    base, top = placed.corner_mm[2], placed.top_mm
    for other in others:
        if overlap(planned_footprint(placed), planned_footprint(other)) is None:
            continue
        if other.top_mm > base and other.corner_mm[2] < top:
            yield Violation(
                placed.box.id,
                Rule.NO_OVERLAP,
                f'shares space with box {other.box.id!r} between z {base} and {other.top_mm} mm',
            )
        elif other.top_mm > base:
            yield Violation(
                placed.box.id,
                Rule.ACCESS_FROM_ABOVE,
                f'box {other.box.id!r} stands over it, up to z {other.top_mm} mm',
            )


def _support(
    placed: PlacedBox, others: Sequence[PlacedBox], profile: Profile
) -> Iterator[Violation]:
    """Rule 3, the centre of mass and the supported share. The floor carries everything."""
    if placed.corner_mm[2] == 0:
        return
    vertices = sum(supported_vertices(placed, others, profile))
    if vertices < profile.min_vertices:
        yield Violation(
            placed.box.id,
            Rule.SUPPORT,
            f'{vertices} of 4 base vertices rest at z = {placed.corner_mm[2]} mm, '
            f'{profile.min_vertices} must',
        )
    contact = contact_rects(placed, others, profile.support_tolerance_mm)
    if profile.com_margin_mm is not None:
        distance = hull_distance(contact, centre_of_mass(placed))
        if distance < profile.com_margin_mm - 1e-6:
            yield Violation(
                placed.box.id,
                Rule.CENTRE_OF_MASS,
                f'centre of mass lies {distance:.1f} mm inside the support polygon, '
                f'{profile.com_margin_mm:g} mm needed',
            )
    share = sum((r[2] - r[0]) * (r[3] - r[1]) for r in contact) / (
        placed.size_mm[0] * placed.size_mm[1]
    )
    if share < profile.min_support_share - 1e-9:
        yield Violation(
            placed.box.id,
            Rule.SUPPORT_SHARE,
            f'{share:.0%} of the base rests, {profile.min_support_share:.0%} needed',
        )
    if profile.stability_margin_mm is not None:
        bearing = planned_bearing(others, profile)
        inside = bearing.stability_mm(placed, centre_of_mass(placed))
        if inside < profile.stability_margin_mm - STABILITY_TOLERANCE_MM:
            yield Violation(
                placed.box.id,
                Rule.STABILITY,
                f'centre of mass lies {inside:.1f} mm inside what carries it down to the floor, '
                f'{profile.stability_margin_mm:g} mm needed',
            )


def centre_of_mass(placed: PlacedBox) -> tuple[float, float]:
    """Centre of mass over the footprint, bin frame, millimetres."""
    x0, y0, x1, y1 = planned_footprint(placed)
    dx, dy, _ = oriented_offset(placed.box.com_offset_mm, placed.orientation)
    return ((x0 + x1) / 2 + dx, (y0 + y1) / 2 + dy)


def _loads(placed: PlacedBox, others: Sequence[PlacedBox], profile: Profile) -> Iterator[Violation]:
    """Payload of the arm, weight of the bin, load bearing down the stack."""
    weight = placed.box.weight_kg
    if profile.max_payload_kg is not None and weight > profile.max_payload_kg:
        yield Violation(
            placed.box.id,
            Rule.PAYLOAD,
            f'weighs {weight:g} kg, the arm lifts {profile.max_payload_kg:g} kg',
        )
    total = weight + sum(other.box.weight_kg for other in others)
    if profile.max_bin_weight_kg is not None and total > profile.max_bin_weight_kg:
        yield Violation(
            placed.box.id,
            Rule.BIN_WEIGHT,
            f'brings the bin to {total:g} kg, limit {profile.max_bin_weight_kg:g} kg',
        )
    if not profile.check_top_load:
        return
    if all(other.box.max_top_load_n is None for other in others):
        return
    loads = top_loads([*others, placed], profile.support_tolerance_mm)
    for other in others:
        limit = other.box.max_top_load_n
        if limit is not None and loads[other.box.id] > limit + 1e-6:
            yield Violation(
                placed.box.id,
                Rule.TOP_LOAD,
                f'puts {loads[other.box.id]:.1f} N on box {other.box.id!r}, '
                f'which carries {limit:g} N',
            )
