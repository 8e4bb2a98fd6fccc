"""How a placement is judged once the box lies still."""

from __future__ import annotations

from arm_executor.model.arm_interface import MotionResult
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.geometry.tolerance import Tolerance
from pack_msgs_py.values import PlacedBox


def judge(
    result: MotionResult,
    placed: PlacedBox,
    expected: Pose,
    tolerance: Tolerance,
    *,
    slack_s: float,
) -> tuple[ErrorCode, str]:
    """Code and message for a box that is in its bin; the first code that applies wins.

    Parameters
    ----------
    result : what the arm measured.
    placed : the box as it was planned.
    expected : where it should rest (:func:`pack_msgs_py.geometry.resting.resting_pose`).
    tolerance : what still counts as placed.
    slack_s : time left until the deadline, negative when it was missed.
    """
    box_id = placed.box.id
    if result.measured is None:
        return ErrorCode.PLACED_OUT_OF_TOLERANCE, f'box {box_id!r} could not be measured'
    size_m = metres(placed.box.size_mm)
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
