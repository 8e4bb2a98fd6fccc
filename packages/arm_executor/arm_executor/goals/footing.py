"""Whether a box stands firmly by what was measured, not only by the space that was reserved.

A reservation is larger than its box: by the clearance, the margin for the scanner's error, and the
rounding to the grid. Two boxes whose reservations share a strip of a grid step may not touch at
all, and a box that has its third corner on such a strip tips over. Tops that were planned level may
not be: a box stands on the highest ones, and leans over to the next.
"""

from __future__ import annotations

from collections.abc import Sequence

from pack_msgs_py.geometry.footprint import measured_footprint
from pack_msgs_py.geometry.polygon import hull_distance, overlap
from pack_msgs_py.geometry.resting import measured_top_mm
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import centre_of_mass, supporters
from pack_msgs_py.values import PlacedBox

#: The centre of mass lies so far inside the support polygon, mm: scanner and arm are a little off.
LEAST_MARGIN_MM = 4.0
#: Tops this far below the highest one carry nothing, mm: a box that leans so far is 1 degree off.
LEVEL_MM = 4.0


def footing_errors(placed: PlacedBox, others: Sequence[PlacedBox], profile: Profile) -> list[str]:
    """Why ``placed`` would not stand firmly on ``others``; nothing where no rule asks for it."""
    if placed.corner_mm[2] == 0 or profile.com_margin_mm is None:
        return []
    base = measured_footprint(placed)
    below = [
        one
        for one in supporters(placed, others, profile.support_tolerance_mm)
        if overlap(base, measured_footprint(one)) is not None
    ]
    highest_mm = max(map(measured_top_mm, below), default=0.0)
    carrying = [one for one in below if measured_top_mm(one) >= highest_mm - LEVEL_MM]
    shared = (overlap(base, measured_footprint(one)) for one in carrying)
    contact = [rect for rect in shared if rect is not None]
    inside = hull_distance(contact, centre_of_mass(placed))
    if inside >= LEAST_MARGIN_MM:
        return []
    names = ', '.join(repr(one.box.id) for one in carrying) or 'nothing'
    text = (
        f'box {placed.box.id!r} would tip over on {names}: by measured sizes its centre of mass '
        f'lies {inside:.1f} mm inside what carries it, {LEAST_MARGIN_MM:g} mm are needed'
    )
    return [text]
