"""What counts as placed, for the arm that measures in physics."""

from __future__ import annotations

import math
from dataclasses import dataclass

from arm_executor.model.arm_interface import PlaceRequest
from pack_msgs_py.codes import ErrorCode


@dataclass(frozen=True)
class Tolerances:
    """Metres and radians."""

    position_m: float = 0.005
    angle_rad: float = math.radians(1.0)
    others_m: float = 0.005

    def judged(
        self, request: PlaceRequest, error_m: float, angle_rad: float, moved_m: float
    ) -> tuple[ErrorCode, str]:
        """Code and message for a box that rests so far off, and moved another one so far."""
        box_id = request.box.id
        if error_m > self.position_m or angle_rad > self.angle_rad:
            return ErrorCode.PLACED_OUT_OF_TOLERANCE, (
                f'box {box_id} rests {1000 * error_m:.1f} mm and {math.degrees(angle_rad):.2f} '
                f'degrees off; {1000 * self.position_m:g} mm and '
                f'{math.degrees(self.angle_rad):g} degrees are allowed'
            )
        if moved_m > self.others_m:
            return ErrorCode.OTHERS_DISTURBED, (
                f'placing box {box_id} moved another box of bin {request.station} by '
                f'{1000 * moved_m:.1f} mm; {1000 * self.others_m:g} mm are allowed'
            )
        return ErrorCode.NONE, ''
