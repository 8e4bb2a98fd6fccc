"""Where a box comes to rest in its bin: on the highest top that is really under it.

Planned heights are rounded up to the resolution and scanned heights are off by millimetres, so a
stack stands a little lower or higher than planned. Reserved footprints are larger than boxes, by
clearance, scanner margin and rounding: two that share a strip may belong to boxes that do not
touch. So what counts is what was measured, and the true sizes. Planner and executor both ask here,
and expect a box at the same height.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pack_msgs_py.geometry.footprint import measured_footprint, planned_footprint, true_size
from pack_msgs_py.geometry.polygon import overlap
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import PlacedBox


def with_measured(placed: PlacedBox, pose: Pose) -> PlacedBox:
    """``placed`` with the centre of ``pose`` (bin frame, metres) as its measured centre."""
    x, y, z = (round(1e3 * value, 6) for value in pose.position)
    return replace(placed, measured_mm=(x, y, z))


def with_poses(boxes: Sequence[PlacedBox], poses: Mapping[str, Pose]) -> tuple[PlacedBox, ...]:
    """``boxes`` with their centres at ``poses``, by box id, as measured centres."""
    return tuple(with_measured(placed, poses[placed.box.id]) for placed in boxes)


def measured_top_mm(placed: PlacedBox) -> float:
    """How high the top of a box is where it was measured, else where it was planned."""
    if placed.measured_mm is None:
        return float(placed.top_mm)
    return placed.measured_mm[2] + true_size(placed)[2] / 2


def rest_height_mm(placed: PlacedBox, others: Sequence[PlacedBox]) -> float:
    """Height above the floor at which the base of ``placed`` comes to rest, millimetres.

    The highest top, as measured or else as planned, among the boxes of ``others`` that lie under it
    by plan and also with their true sizes where they were measured. Without any it is the planned
    height. Where ``placed`` has a measured centre, that is where it is let go.
    """
    base_mm = placed.corner_mm[2]
    if base_mm == 0:
        return 0.0
    tops = [
        measured_top_mm(other)
        for other in others
        if other.top_mm <= base_mm
        and overlap(planned_footprint(other), planned_footprint(placed)) is not None
        and overlap(measured_footprint(other), measured_footprint(placed)) is not None
    ]
    return max(tops, default=float(base_mm))


def resting_pose(placed: PlacedBox, target: Pose, others: Sequence[PlacedBox]) -> Pose:
    """``target`` (bin frame) at the height at which the box comes to rest on ``others``."""
    height_mm = rest_height_mm(with_measured(placed, target), others)
    x, y, _ = target.position
    return replace(target, position=(x, y, (height_mm + true_size(placed)[2] / 2) / 1000))
