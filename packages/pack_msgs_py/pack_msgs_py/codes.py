"""Codes of the interfaces for ROS-free code; a test holds them equal to the generated messages."""

from __future__ import annotations

from enum import IntEnum


class ErrorCode(IntEnum):
    """PlaceBox result codes; the first that applies wins, in this order."""

    NONE = 0
    UNKNOWN = 100
    INVALID_GOAL = 101
    STALE_BIN_REVISION = 102
    BUSY = 103
    NOT_ACTIVE = 104
    DUPLICATE_BOX = 105
    BOX_NOT_ON_BELT = 106
    RULE_VIOLATION = 107
    STALE_GOAL = 108
    DEADLINE_UNREACHABLE = 110
    NO_IK_SOLUTION = 111
    START_STATE_INVALID = 112
    PATH_IN_COLLISION = 113
    LIMITS_EXCEEDED = 114
    BOX_NOT_PRESENTED = 115
    GRASP_FAILED = 120
    BOX_LOST = 121
    PATH_TOLERANCE_VIOLATED = 122
    PLACED_OUT_OF_TOLERANCE = 123
    DEADLINE_MISSED = 124
    OTHERS_DISTURBED = 125
    BOX_MISMATCH = 126
    COLLISION = 127
    MOTION_OVERDUE = 128
    CANCELED = 130
    PROTECTIVE_STOP = 131

    @property
    def box_is_in_bin(self) -> bool:
        """Whether a goal that ended with this code left the box in the bin."""
        return self in _IN_BIN


_IN_BIN = frozenset(
    {
        ErrorCode.NONE,
        ErrorCode.PLACED_OUT_OF_TOLERANCE,
        ErrorCode.DEADLINE_MISSED,
        ErrorCode.OTHERS_DISTURBED,
    }
)


class Phase(IntEnum):
    """PlaceBox feedback phases."""

    PLANNING = 0
    WAITING = 1
    APPROACHING = 2
    GRASPING = 3
    TRANSFERRING = 4
    LOWERING = 5
    RELEASING = 6
    RETREATING = 7
    SETTLING = 8


class BoxEventKind(IntEnum):
    """BoxEvent.event."""

    PICKED = 1
    PLACED = 2
    RETURNED = 3
    REJECTED = 4
    LOST = 5
    UNKNOWN = 6


class Reason(IntEnum):
    """BoxEvent.reason."""

    NONE = 0
    INVALID_DATA = 1
    DUPLICATE_ID = 2
    OVERSIZE = 3
    OVERWEIGHT = 4
    NO_READ = 5
    MAX_LAPS = 6
    OPERATOR = 7
    UNREACHABLE = 8
    FAULT = 9


class PlacementStatus(IntEnum):
    """PlacementDecision.status."""

    OPTIMAL = 0
    BUDGET = 1
    FALLBACK = 2
    REJECT = 3


class Mode(IntEnum):
    """ExecutorState.mode."""

    INACTIVE = 0
    IDLE = 1
    EXECUTING = 2
    PROTECTIVE_STOP = 3
    FAULT = 4
    PAUSED = 5
    ALARM = 6


class BinStatus(IntEnum):
    """BinState.status."""

    UNKNOWN = 0
    OPEN = 1
    CLOSED = 2
    BLOCKED = 3
    HELD = 4


class Command(IntEnum):
    """Operate.command: what an operator wants of a node."""

    PAUSE = 1
    RESUME = 2
    STOP = 3
    RESET = 4
    ACKNOWLEDGE = 5
    SWAP_BIN = 6
    CLOSE_BIN = 7
    HOLD_BIN = 8
    RELEASE_BIN = 9
    CLOSE_ALL = 10
    DRAIN = 11
    FEED = 12
    EMPTY = 13


class Severity(IntEnum):
    """Alarm.severity."""

    WARNING = 1
    ALARM = 2


class Condition(IntEnum):
    """CellState.state."""

    UNKNOWN = 0
    STARTING = 1
    RUNNING = 2
    WAITING = 3
    DRAINING = 4
    ENDED = 5
    PAUSED = 6
    STOPPED = 7
    ALARM = 8
    FAULT = 9


class Level(IntEnum):
    """NodeState.level."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
