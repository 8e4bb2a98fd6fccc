"""How far a box may rest from where it should, and another may move. Metres and radians."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pack_msgs_py.geometry.pose import Pose, corner_distance, turn_between
from pack_msgs_py.values import Vec3

#: How far the height of a place may be from what is known, mm: when the planner asked, the box
#: below was still under way, and half of what the scanner is wrong about its height is seen later.
#: One box in 740 is so much higher than a scanner of 2 mm says; nothing went on top of it.
HEIGHT_TOLERANCE_MM = 6.0


@dataclass(frozen=True)
class Tolerance:
    """What still counts as placed.

    Attributes
    ----------
    position_m : largest distance of a corner of the box from where it should be.
    angle_rad : largest turn away from the orientation that was asked for.
    others_m : farthest that a corner of another box of the bin may have moved.
    """

    position_m: float = 0.005
    angle_rad: float = math.radians(1.0)
    others_m: float = 0.005

    def out_of_place(self, box_id: str, size_m: Vec3, expected: Pose, measured: Pose) -> str:
        """What is wrong with a box of ``size_m`` that rests at ``measured``; empty when nothing."""
        distance = corner_distance(expected, measured, size_m)
        angle = turn_between(expected, measured)
        if distance <= self.position_m and angle <= self.angle_rad:
            return ''
        return (
            f'box {box_id!r} rests {1e3 * distance:.1f} mm and {math.degrees(angle):.1f} degrees '
            f'away from where it should, {1e3 * self.position_m:.3g} mm and '
            f'{math.degrees(self.angle_rad):.3g} degrees are allowed'
        )

    def others_disturbed(self, box_id: str, moved_m: float) -> str:
        """What is wrong when placing a box moved another one by ``moved_m``; empty if nothing."""
        if moved_m <= self.others_m:
            return ''
        return (
            f'placing box {box_id!r} moved another box of its bin by {1e3 * moved_m:.1f} mm, '
            f'{1e3 * self.others_m:g} mm are allowed'
        )
