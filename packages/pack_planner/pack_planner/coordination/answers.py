"""What the arm answers about a placement, and what it means."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.codes import ErrorCode

#: Endings, and answers, that say nothing about the placement.
TRANSIENT = frozenset(
    {
        ErrorCode.UNKNOWN,
        ErrorCode.STALE_BIN_REVISION,
        ErrorCode.BUSY,
        ErrorCode.NOT_ACTIVE,
        ErrorCode.BOX_NOT_ON_BELT,
        ErrorCode.STALE_GOAL,
        ErrorCode.START_STATE_INVALID,
        ErrorCode.BOX_NOT_PRESENTED,
        ErrorCode.CANCELED,
        ErrorCode.PROTECTIVE_STOP,
    }
)


@dataclass(frozen=True)
class CheckAnswer:
    """What the arm says of one candidate; see PlacementCheck.msg.

    ``motion_s`` is the time that it would take, 0 when there is no motion; ``predicted`` says that
    it was refused by a prediction alone, without planning.
    """

    code: ErrorCode
    motion_s: float = 0.0
    predicted: bool = False

    @property
    def possible(self) -> bool:
        """Whether there is a motion, however long it takes."""
        slow = self.code is ErrorCode.DEADLINE_UNREACHABLE and self.predicted
        return slow or self.code is ErrorCode.NONE


def refusal_of(answer: CheckAnswer, limit_s: float) -> ErrorCode:
    """Why a candidate cannot be done; ``NONE`` when it can, or when nobody knows."""
    if answer.possible:
        slow = answer.motion_s > limit_s
        return ErrorCode.DEADLINE_UNREACHABLE if slow else ErrorCode.NONE
    return ErrorCode.NONE if answer.code in TRANSIENT else answer.code
