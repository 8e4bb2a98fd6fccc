"""Where a box should rest, and how its placement is judged once it lies still."""

from __future__ import annotations

import math
from dataclasses import replace

from arm_executor.model.arm_interface import MotionResult
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.geometry.tolerance import Tolerance
from pack_msgs_py.values import PlacedBox, Vec3


def expected_rest(rest: Pose, aside: Vec3, measured: Pose | None) -> Pose:
    """Where the scanned middle of a box should be when the point that the pad took is at ``rest``.

    Parameters
    ----------
    rest : of the point that the pad took, bin frame.
    aside : where that point lies from the scanned middle, bin frame, metres; or the other way,
        where the arm turned the box by half a turn more.
    measured : where the box is; of the two the nearer counts.
    """
    (x, y, z), (dx, dy, dz) = rest.position, aside
    usual = replace(rest, position=(x - dx, y - dy, z - dz))
    turned = replace(rest, position=(x + dx, y + dy, z + dz))
    if measured is None:
        return usual
    return min(usual, turned, key=lambda pose: math.dist(pose.position, measured.position))


def judge(
    result: MotionResult,
    placed: PlacedBox,
    expected: Pose,
    tolerance: Tolerance,
    *,
    size_sigmas: float,
    slack_s: float,
) -> tuple[ErrorCode, str]:
    """Code and message for a box that is in its bin; the first code that applies wins.

    Parameters
    ----------
    result : what the arm measured.
    placed : the box as it was planned.
    expected : where it should rest (:func:`expected_rest`).
    tolerance : what still counts as placed, by a scanner without error.
    size_sigmas : so many standard deviations of size and angle may the scanner be wrong by: the
        middle of the box, or its ends, may then be half as far from those of the scanned one, and
        the box that much more turned.
    slack_s : time left until the deadline, negative when it was missed.
    """
    box_id = placed.box.id
    if result.measured is None:
        return ErrorCode.PLACED_OUT_OF_TOLERANCE, f'box {box_id!r} could not be measured'
    box = placed.box
    askew_mm = box.yaw_stddev_rad * math.hypot(*box.size_mm)
    scan_error_m = size_sigmas * math.hypot(*box.size_stddev_mm, askew_mm) / 2e3
    size_m = metres(box.size_mm)
    tolerance = replace(
        tolerance,
        position_m=tolerance.position_m + scan_error_m,
        angle_rad=tolerance.angle_rad + size_sigmas * box.yaw_stddev_rad,
    )
    misplaced = tolerance.out_of_place(box_id, size_m, expected, result.measured)
    if misplaced:
        return ErrorCode.PLACED_OUT_OF_TOLERANCE, misplaced
    if result.code is ErrorCode.PLACED_OUT_OF_TOLERANCE:
        return result.code, result.message or f'the arm says box {box_id!r} is out of place'
    if slack_s < 0:
        return ErrorCode.DEADLINE_MISSED, f'box {box_id!r} is in place, {-slack_s:.2f} s late'
    disturbed = tolerance.others_disturbed(box_id, result.others_moved_m)
    if disturbed:
        return ErrorCode.OTHERS_DISTURBED, disturbed
    if result.code.box_is_in_bin:
        return result.code, result.message
    return ErrorCode.NONE, ''
