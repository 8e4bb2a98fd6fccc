"""What went wrong lately, until a person has seen it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from pack_cell.view.plain_words import ENDINGS, REASONS
from pack_msgs_py.cell_values import BoxEvent, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode

#: Alarms that are kept; the oldest acknowledged ones go first.
MOST = 50
#: Ends of a goal by which nothing has happened that a person should know.
_USUAL = frozenset(
    {
        ErrorCode.NONE,
        ErrorCode.STALE_BIN_REVISION,
        ErrorCode.BUSY,
        ErrorCode.NOT_ACTIVE,
        ErrorCode.STALE_GOAL,
        ErrorCode.CANCELED,
        ErrorCode.RULE_VIOLATION,
        ErrorCode.DEADLINE_UNREACHABLE,
        ErrorCode.NO_IK_SOLUTION,
        ErrorCode.PATH_IN_COLLISION,
        ErrorCode.LIMITS_EXCEEDED,
    }
)
_ACTIONS = {
    ErrorCode.BOX_LOST: 'Find the box, and look at the bin',
    ErrorCode.COLLISION: 'Look what the arm has touched',
    ErrorCode.OTHERS_DISTURBED: 'Look at the bin',
    ErrorCode.PLACED_OUT_OF_TOLERANCE: 'Look at the bin if this comes again',
    ErrorCode.GRASP_FAILED: 'Look at the pad if this comes again',
    ErrorCode.BOX_MISMATCH: 'Check the label and the scale if this comes again',
    ErrorCode.BOX_NOT_PRESENTED: 'Look at the belt if this comes again',
    ErrorCode.PROTECTIVE_STOP: 'See that the way is free, then press Reset',
}


@dataclass(frozen=True)
class AlarmLine:
    """One alarm: when (seconds since the epoch), what, the code, and what a person does."""

    number: int
    stamp_s: float
    text: str
    code: str
    action: str = ''
    grave: bool = False
    acknowledged: bool = False


class AlarmList:
    """Alarms, newest first."""

    def __init__(self) -> None:
        self._lines: list[AlarmLine] = []
        self._count = 0

    def __iter__(self) -> Iterator[AlarmLine]:
        return iter(self._lines)

    @property
    def open(self) -> int:
        """How many nobody has acknowledged."""
        return sum(not line.acknowledged for line in self._lines)

    def acknowledge_all(self) -> None:
        """A person has seen them."""
        self._lines = [replace(line, acknowledged=True) for line in self._lines]

    def add_report(self, report: Report) -> None:
        """A goal has ended."""
        if report.code in _USUAL:
            return
        text = f'{report.box_id}: {ENDINGS[report.code]}'
        grave = not report.code.box_is_in_bin
        action = _ACTIONS.get(report.code, '')
        self._add(report.stamp_s, text, report.code.name, action, grave=grave)

    def add_event(self, event: BoxEvent) -> None:
        """Something happened to a box."""
        if event.event is BoxEventKind.REJECTED:
            text = f'{event.box_id} to the reject lane: {REASONS[event.reason]}'
            self._add(event.stamp_s, text, f'REJECTED {event.reason.name}')
        elif event.event is BoxEventKind.LOST:
            self._add(event.stamp_s, f'{event.box_id} is lost', 'LOST', 'Find the box', grave=True)
        elif event.event is BoxEventKind.UNKNOWN:
            text, action = f'nobody knows where {event.box_id} is', 'Look in gripper and bins'
            self._add(event.stamp_s, text, 'UNKNOWN', action, grave=True)

    def _add(
        self, stamp_s: float, text: str, code: str, action: str = '', *, grave: bool = False
    ) -> None:
        self._count += 1
        self._lines.insert(0, AlarmLine(self._count, stamp_s, text, code, action, grave))
        while len(self._lines) > MOST:
            old = next((line for line in reversed(self._lines) if line.acknowledged), None)
            self._lines.remove(old or self._lines[-1])
