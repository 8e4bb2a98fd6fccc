"""Codes in the words of somebody who stands beside the cell."""

from __future__ import annotations

from pack_msgs_py.cell_values import Decision, RunnerUp
from pack_msgs_py.codes import ErrorCode, Reason

#: How a goal ended, or why the arm would not take a placement.
ENDINGS = {
    ErrorCode.NONE: 'done',
    ErrorCode.UNKNOWN: 'the arm failed and does not know how',
    ErrorCode.INVALID_GOAL: 'the order was not valid',
    ErrorCode.STALE_BIN_REVISION: 'the bin had changed meanwhile',
    ErrorCode.BUSY: 'the arm was busy',
    ErrorCode.NOT_ACTIVE: 'the arm was paused',
    ErrorCode.DUPLICATE_BOX: 'the box is in a bin already',
    ErrorCode.BOX_NOT_ON_BELT: 'the box was not on the belt',
    ErrorCode.RULE_VIOLATION: 'it would break a packing rule',
    ErrorCode.STALE_GOAL: 'the order came too late',
    ErrorCode.DEADLINE_UNREACHABLE: 'the way is too long for the deadline',
    ErrorCode.NO_IK_SOLUTION: 'the arm cannot reach there',
    ErrorCode.START_STATE_INVALID: 'the arm was not where it should be',
    ErrorCode.PATH_IN_COLLISION: 'something is in the way',
    ErrorCode.LIMITS_EXCEEDED: 'too heavy for arm or suction',
    ErrorCode.BOX_NOT_PRESENTED: 'the belt did not bring the box',
    ErrorCode.GRASP_FAILED: 'the pad could not take hold',
    ErrorCode.BOX_LOST: 'the box was lost on the way',
    ErrorCode.PATH_TOLERANCE_VIOLATED: 'the arm strayed from its path',
    ErrorCode.PLACED_OUT_OF_TOLERANCE: 'placed, but not quite where it should be',
    ErrorCode.DEADLINE_MISSED: 'placed, but late',
    ErrorCode.OTHERS_DISTURBED: 'placed, but pushed other boxes',
    ErrorCode.BOX_MISMATCH: 'the box is not what was scanned',
    ErrorCode.COLLISION: 'the arm touched something',
    ErrorCode.MOTION_OVERDUE: 'the motion did not come to an end',
    ErrorCode.CANCELED: 'called off',
    ErrorCode.PROTECTIVE_STOP: 'protective stop',
}

#: Why a box left the cell by the reject lane.
REASONS = {
    Reason.NONE: 'no reason given',
    Reason.INVALID_DATA: 'data missing or wrong',
    Reason.DUPLICATE_ID: 'label used twice',
    Reason.OVERSIZE: 'too large for the bins',
    Reason.OVERWEIGHT: 'too heavy',
    Reason.NO_READ: 'label not read',
    Reason.MAX_LAPS: 'too many laps',
    Reason.OPERATOR: 'taken by a person',
    Reason.UNREACHABLE: 'out of reach of the arm',
    Reason.FAULT: 'failed three times',
}


def runner_up_lines(decision: Decision | None) -> list[tuple[str, str]]:
    """What ``decision`` was preferred to, and why, best first; each place once, however turned."""
    if decision is None:
        return []
    lines = [
        (
            _place_text(other),
            'fills less well'
            if other.refusal is ErrorCode.NONE
            else f'the arm: {ENDINGS[other.refusal]}',
        )
        for other in decision.runners_up
    ]
    return list(dict.fromkeys(lines))


def _place_text(other: RunnerUp) -> str:
    x, y, z = other.corner_mm
    return f'{other.box_id} → {other.bin_id} at x {x}, y {y}, z {z}'
