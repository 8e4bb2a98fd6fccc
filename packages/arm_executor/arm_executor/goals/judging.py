"""How a placement is judged once the box lies still."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

from arm_executor.goals.admission import rotation_matrix
from arm_executor.model.arm_interface import MotionResult
from arm_executor.parameters import Tolerance
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry2d import overlap
from pack_msgs_py.orientation import oriented_size
from pack_msgs_py.rules import footprint
from pack_msgs_py.values import PlacedBox, Vec3


def corner_distance(size_mm: Vec3, a: Pose, b: Pose) -> float:
    """Largest distance between a corner of the box at pose ``a`` and at ``b``, metres."""
    half = [edge / 2e3 for edge in size_mm]
    ra, rb = rotation_matrix(a.quaternion), rotation_matrix(b.quaternion)

    def corner(pose: Pose, rotation: Sequence[Vec3], signs: Sequence[int]) -> list[float]:
        local = [sign * edge for sign, edge in zip(signs, half, strict=True)]
        return [
            centre + sum(r * v for r, v in zip(row, local, strict=True))
            for centre, row in zip(pose.position, rotation, strict=True)
        ]

    return max(
        math.dist(corner(a, ra, signs), corner(b, rb, signs))
        for signs in product((-1, 1), repeat=3)
    )


def angle_between(a: Pose, b: Pose) -> float:
    """Angle of the rotation from ``a`` to ``b``, radians."""
    dot = abs(sum(p * q for p, q in zip(a.quaternion, b.quaternion, strict=True)))
    return 2.0 * math.acos(min(1.0, dot))


def resting_pose(
    placed: PlacedBox, target: Pose, others: Sequence[PlacedBox], poses: Mapping[str, Pose]
) -> Pose:
    """Where the box must come to rest: over ``target``, on what really lies below.

    Planned heights are rounded up to the resolution, so that a stack is in truth a little lower
    than planned. ``poses`` are the measured centres of ``others``, bin frame, metres.
    """
    below = [
        one
        for one in others
        if one.top_mm <= placed.corner_mm[2]
        and overlap(footprint(one), footprint(placed)) is not None
    ]
    tops = [poses[one.box.id].position[2] + _half_height(one) for one in below]
    x, y, _ = target.position
    return replace(target, position=(x, y, max(tops, default=0.0) + _half_height(placed)))


def _half_height(placed: PlacedBox) -> float:
    """Half of the true height of a box in its bin, metres."""
    return oriented_size(placed.box.size_mm, placed.orientation)[2] / 2e3


def judge(
    result: MotionResult,
    placed: PlacedBox,
    expected: Pose,
    tolerance: Tolerance,
    *,
    slack_s: float,
) -> tuple[ErrorCode, str]:
    """Code and message for a box that is in its bin; the first code that applies wins.

    ``expected`` is where it should rest (:func:`resting_pose`), ``slack_s`` is negative when the
    deadline was missed.
    """
    box_id = placed.box.id
    if result.measured is None:
        return ErrorCode.PLACED_OUT_OF_TOLERANCE, f'box {box_id!r} could not be measured'
    distance = corner_distance(placed.box.size_mm, expected, result.measured)
    angle = angle_between(expected, result.measured)
    if distance > tolerance.position_m or angle > tolerance.angle_rad:
        return ErrorCode.PLACED_OUT_OF_TOLERANCE, (
            f'box {box_id!r} rests {1e3 * distance:.1f} mm and {math.degrees(angle):.1f} degrees '
            f'away from where it should, {1e3 * tolerance.position_m:g} mm and '
            f'{math.degrees(tolerance.angle_rad):g} degrees are allowed'
        )
    if result.code is ErrorCode.PLACED_OUT_OF_TOLERANCE:
        return result.code, result.message or f'the arm says box {box_id!r} is out of place'
    if slack_s < 0:
        return ErrorCode.DEADLINE_MISSED, f'box {box_id!r} is in place, {-slack_s:.2f} s late'
    if result.others_moved_m > tolerance.position_m:
        return ErrorCode.OTHERS_DISTURBED, (
            f'another box moved {1e3 * result.others_moved_m:.1f} mm, '
            f'{1e3 * tolerance.position_m:g} mm are allowed'
        )
    if result.code.box_is_in_bin:
        return result.code, result.message
    return ErrorCode.NONE, ''
