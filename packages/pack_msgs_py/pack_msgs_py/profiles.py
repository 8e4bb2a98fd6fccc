"""Rule profiles: which packing rules hold, and with which margins."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pack_msgs_py.orientation import ORIENTATION_RULES, UPRIGHT_OR_TIPPED, oriented_size
from pack_msgs_py.values import Box, Int3


@dataclass(frozen=True)
class Profile:
    """A named set of packing rules (design: 'Rules of a placement').

    Attributes
    ----------
    resolution_mm : grid of x, y positions and sizes; sizes are rounded up to it.
    resolution_z_mm : the same along z.
    clearance_mm : added to a box's x and y size before rounding, half on each side, so that this
        much air stays between neighbours and half of it to a wall.
    orientations : a key of :data:`pack_msgs_py.orientation.ORIENTATION_RULES`.
    min_vertices : base vertices that must rest on box tops (or all on the floor).
    support_tolerance_mm : how far below the base a top may lie and still count as supporting.
    com_margin_mm : least distance of the centre of mass from the edge of the support polygon;
        ``None`` switches the rule off. Not asked of a box on the floor.
    min_support_share : least share of the base area that rests on something, 0 to 1.
    stability_margin_mm : least distance of the centre of mass from the edge of the bearing polygon,
        which is what carries a box all the way down (:mod:`pack_msgs_py.statics`); ``None``
        switches the rule off. Not asked of a box on the floor.
    bearing_inset_mm : how far the edges of a box may lie further in than its scanned size in the
        middle of its reserved space, by the errors of scanner and arm; for the bearing polygon.
    max_payload_kg : heaviest box the arm may lift; ``None`` for no limit.
    max_bin_weight_kg : heaviest total of a bin; ``None`` for no limit.
    check_top_load : whether ``Box.max_top_load_n`` is honoured down the stack.
    size_sigmas : how many standard deviations of the room that a box takes up, by its measured size
        and the angle at which it lies, are added to its footprint, so that the true box fits;
        heights are taken as measured (docs/decisions.md).
    """

    name: str
    resolution_mm: int = 10
    resolution_z_mm: int = 10
    clearance_mm: float = 0.0
    orientations: str = 'largest_not_vertical'
    min_vertices: int = 3
    support_tolerance_mm: int = 0
    com_margin_mm: float | None = None
    min_support_share: float = 0.0
    stability_margin_mm: float | None = None
    bearing_inset_mm: float = 0.0
    max_payload_kg: float | None = None
    max_bin_weight_kg: float | None = None
    check_top_load: bool = False
    size_sigmas: float = 0.0

    def __post_init__(self) -> None:
        if self.orientations not in ORIENTATION_RULES:
            known = ', '.join(ORIENTATION_RULES)
            msg = f'unknown orientation rule {self.orientations!r}: use one of {known}'
            raise ValueError(msg)
        if self.resolution_mm < 1 or self.resolution_z_mm < 1:
            msg = f'resolution must be at least 1 mm, got {self.resolution_mm} mm'
            raise ValueError(msg)
        if not 0 <= self.clearance_mm < math.inf:
            msg = f'clearance must be 0 mm or more, got {self.clearance_mm} mm'
            raise ValueError(msg)


PROFILES: dict[str, Profile] = {
    # The rules of Ojha et al., section II-B, with all six rotations as in their experiments (IV).
    'paper': Profile('paper', orientations='any'),
    # What a real arm with a suction pad needs; docs/decisions.md says where the margins come from.
    'cell': Profile(
        'cell',
        resolution_z_mm=1,
        clearance_mm=2.0,
        orientations='upright',
        support_tolerance_mm=2,
        com_margin_mm=15.0,
        min_support_share=0.5,
        stability_margin_mm=5.0,
        bearing_inset_mm=5.0,
        max_payload_kg=20.0,
        max_bin_weight_kg=500.0,
        check_top_load=True,
        size_sigmas=2.0,
    ),
    # Support by mechanics instead of vertices, the tightest margins that physics confirms, and the
    # faces up that a tilt tray brings up for an arm that takes boxes from above.
    'dense': Profile(
        'dense',
        resolution_z_mm=1,
        clearance_mm=2.0,
        orientations=UPRIGHT_OR_TIPPED,
        min_vertices=0,
        support_tolerance_mm=2,
        min_support_share=0.6,
        stability_margin_mm=15.0,
        bearing_inset_mm=5.0,
        max_payload_kg=20.0,
        max_bin_weight_kg=500.0,
        check_top_load=True,
        size_sigmas=2.0,
    ),
}


def find_profile(name: str) -> Profile:
    """The profile called ``name``; ``ValueError`` lists the known ones."""
    try:
        return PROFILES[name]
    except KeyError:
        msg = f'unknown profile {name!r}: use one of {", ".join(PROFILES)}'
        raise ValueError(msg) from None


def adapted(
    profile: Profile,
    *,
    orientations: str = '',
    size_sigmas: float = -1.0,
    clearance_mm: float = -1.0,
    resolution_mm: int = 0,
) -> Profile:
    """``profile`` as a cell is set up: each value instead of its own, unless it is the default.

    Planner, executor and report call this with the same values, and so judge by the same rules.

    >>> adapted(PROFILES['dense'], clearance_mm=2.0).clearance_mm
    2.0
    """
    given: dict[str, object] = {}
    if orientations:
        given['orientations'] = orientations
    if size_sigmas >= 0:
        given['size_sigmas'] = size_sigmas
    if clearance_mm >= 0:
        given['clearance_mm'] = clearance_mm
    if resolution_mm > 0:
        given['resolution_mm'] = resolution_mm
    return replace(profile, **given)  # type: ignore[arg-type]


def _round_up(value: float, step: int) -> int:
    return math.ceil(round(value / step, 6)) * step


def planned_size(box: Box, orientation: str, profile: Profile) -> Int3:
    """Space to reserve for ``box`` in ``orientation``, mm.

    Rotated, clearance and the margin for the scanner's error added, rounded up.
    """
    dx, dy, dz = oriented_size(box.size_mm, orientation)
    sx, sy, _ = oriented_size(box.size_stddev_mm, orientation)
    sx, sy = box.room_stddev(sx, dy), box.room_stddev(sy, dx)
    margin, sigmas = profile.clearance_mm, profile.size_sigmas
    return (
        _round_up(dx + margin + sigmas * sx, profile.resolution_mm),
        _round_up(dy + margin + sigmas * sy, profile.resolution_mm),
        _round_up(dz, profile.resolution_z_mm),
    )
