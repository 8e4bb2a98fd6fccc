"""What happened lately that was not as it should be."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from pack_cell.view.plain_words import ENDINGS, REASONS
from pack_msgs_py.cell_values import BoxEvent, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode

#: How many are kept.
MOST = 20
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


@dataclass(frozen=True)
class Happening:
    """One thing that happened: when (seconds since the epoch), what, and its code."""

    stamp_s: float
    text: str
    code: str


class Happenings:
    """The last :data:`MOST`, newest first."""

    def __init__(self) -> None:
        self._last: deque[Happening] = deque(maxlen=MOST)

    def __iter__(self) -> Iterator[Happening]:
        return iter(self._last)

    def add_report(self, report: Report) -> None:
        """A goal has ended."""
        if report.code not in _USUAL:
            text = f'{report.box_id}: {ENDINGS[report.code]}'
            self._last.appendleft(Happening(report.stamp_s, text, report.code.name))

    def add_event(self, event: BoxEvent) -> None:
        """Something happened to a box."""
        if event.event is BoxEventKind.REJECTED:
            text = f'{event.box_id} to the reject lane: {REASONS[event.reason]}'
            self._last.appendleft(Happening(event.stamp_s, text, event.reason.name))
        elif event.event in (BoxEventKind.LOST, BoxEventKind.UNKNOWN):
            text = f'nobody knows where {event.box_id} is'
            self._last.appendleft(Happening(event.stamp_s, text, event.event.name))
