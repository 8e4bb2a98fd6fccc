"""Whether the gripper reaches a box where the belt holds it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from arm_executor.model.layout import Layout
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose, extent, metres, tilt_between
from pack_msgs_py.picking import FLAT_RAD, is_presented, lies_as, turn_from
from pack_msgs_py.values import Box

#: The bellows reach a box whose top is so much higher or lower than one that stands on the belt.
LEVEL_M = 0.012
#: A box may stick out over the head of the belt, and stay behind it, by this much.
AHEAD_M, BEHIND_M = 0.03, 0.30
#: And it must keep so far clear of the bins beside the belt.
BESIDE_M = 0.02


@dataclass(frozen=True)
class PickArea:
    """The head of the belt, from which the arm takes boxes."""

    layout: Layout = field(default_factory=Layout)

    def refusal_now(self, box_id: str, wanted: Pose, scan: Scan | None) -> str:
        """The same for a box that ``scan`` shows at the pick point, the wanted face up."""
        scanned = None if scan is None else scan.find(box_id)
        if scan is None or scanned is None or not is_presented(scanned, scan.stamp_s):
            return ''
        if not lies_as(scanned.pose, wanted):
            return ''
        return self.refusal(scanned.box, scanned.pose, wanted)

    def refusal(self, box: Box, pose: Pose, wanted: Pose) -> str:
        """Why ``box`` cannot be taken at ``pose``; empty when nothing speaks against it.

        ``wanted`` says which face is to be up, and which way round counts as not turned.
        """
        why = self._why_not(box, pose, wanted)
        return f'{as_text(pose, wanted)}: {why}' if why else ''

    def _why_not(self, box: Box, pose: Pose, wanted: Pose) -> str:
        belt, bins_x = self.layout.conveyor, self.layout.stations.gap_x
        tilt = tilt_between(pose.quaternion, wanted.quaternion)
        if tilt > FLAT_RAD:
            return (
                f'another face is up than asked for, or it leans; at most '
                f'{math.degrees(FLAT_RAD):.1f} degrees are taken'
            )
        (low_x, low_y, low_z), (high_x, _, _) = extent(pose, metres(box.size_mm))
        if abs(low_z - belt.top_z) > LEVEL_M + math.sin(tilt) * max(box.size_mm) / 2e3:
            return (
                f'its base is at z = {low_z:.3f} m, the belt at {belt.top_z:g} m; the gripper '
                f'evens out {1e3 * LEVEL_M:g} mm'
            )
        if max(-low_x, high_x) > bins_x - BESIDE_M:
            return (
                f'it reaches from x = {low_x:.3f} to {high_x:.3f} m; bins stand from '
                f'{bins_x:g} m on, and {1e3 * BESIDE_M:g} mm are kept clear of them'
            )
        first, last = belt.front_y - AHEAD_M, belt.front_y + BEHIND_M
        if not first <= low_y <= last:
            return (
                f'its front is at y = {low_y:.3f} m; the arm takes boxes whose front is at '
                f'{first:g} to {last:g} m'
            )
        return ''


def as_text(pose: Pose, wanted: Pose) -> str:
    """Where a box lies, and how it is turned and tilted from ``wanted``."""
    x, y, z = pose.position
    turned = math.degrees(turn_from(pose, wanted))
    tilted = math.degrees(tilt_between(pose.quaternion, wanted.quaternion))
    return (
        f'({x:.3f}, {y:.3f}, {z:.3f}) m, turned by {turned:.1f} and tilted by {tilted:.1f} degrees'
    )
