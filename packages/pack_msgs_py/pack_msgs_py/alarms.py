"""Alarms and warnings: what a person must know of, and which of it the arm must not move for.

An alarm stops: the arm begins no motion until a person has acknowledged it. A warning is shown, and
the cell goes on. A command that cannot be done is neither: its answer says what to do instead.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pack_msgs_py.codes import Severity

#: Warnings that a node shows at a time; alarms all stand until they are acknowledged.
MOST_WARNINGS = 10


@dataclass(frozen=True)
class Trouble:
    """What a code means for the cell: how grave it is, and the one thing that a person does."""

    severity: Severity
    action: str


_ALARM, _WARNING = Severity.ALARM, Severity.WARNING
_RECURS = 'Nothing now; if it comes again and again, look at'

#: What is raised, by its code; docs/operations.md explains each.
TROUBLES: dict[str, Trouble] = {
    'BOX_LOST': Trouble(
        _ALARM, 'Find the box and take it out of the cell, look at the bin, then: cell ack'
    ),
    'BOX_UNKNOWN': Trouble(
        _ALARM, 'Look for the box, then: cell resolve BOX --placed or --removed, and: cell ack'
    ),
    'COLLISION': Trouble(
        _ALARM, 'Look what the arm has touched and whether it is whole, then: cell ack'
    ),
    'SECOND_SOURCE': Trouble(
        _ALARM, 'End the other node, or the recording that is played, then: cell ack'
    ),
    'JAM': Trouble(_ALARM, 'Clear the belt, then: cell ack'),
    'GRASP_FAILED': Trouble(_WARNING, f'{_RECURS} the pad and at the faces of the boxes.'),
    'BOX_MISMATCH': Trouble(_WARNING, f'{_RECURS} the scanner.'),
    'PATH_TOLERANCE_VIOLATED': Trouble(_WARNING, f'{_RECURS} the drives of the arm.'),
    'MOTION_OVERDUE': Trouble(_WARNING, f'{_RECURS} the connection to the arm.'),
    'PLACED_OUT_OF_TOLERANCE': Trouble(_WARNING, 'Look at the bin when you pass by.'),
    'OTHERS_DISTURBED': Trouble(_WARNING, 'Look at the bin when you pass by.'),
    'DEADLINE_MISSED': Trouble(_WARNING, f'{_RECURS} the load of the computer.'),
}


@dataclass(frozen=True)
class Alarm:
    """One alarm or warning that stands; see pack_msgs/Alarm.

    ``raised_s`` is when it came up, seconds since the epoch.
    """

    code: str
    message: str
    severity: Severity = Severity.ALARM
    action: str = ''
    box_id: str = ''
    bin_id: str = ''
    raised_s: float = 0.0

    @property
    def blocks(self) -> bool:
        """Whether the arm must not begin a motion."""
        return self.severity is Severity.ALARM


def raised(
    code: str, message: str, now_s: float, *, box_id: str = '', bin_id: str = ''
) -> Alarm | None:
    """The alarm or warning for ``code``; ``None`` for a code that is neither."""
    trouble = TROUBLES.get(code)
    if trouble is None:
        return None
    return Alarm(code, message, trouble.severity, trouble.action, box_id, bin_id, now_s)


def with_new(standing: Iterable[Alarm], new: Alarm) -> tuple[Alarm, ...]:
    """What stands once ``new`` has come: once for each code, box and bin, and not too many."""
    about = (new.code, new.box_id, new.bin_id)
    kept = [alarm for alarm in standing if (alarm.code, alarm.box_id, alarm.bin_id) != about]
    kept.append(new)
    warnings = [alarm for alarm in kept if not alarm.blocks]
    too_old = set(warnings[:-MOST_WARNINGS])
    return tuple(alarm for alarm in kept if alarm not in too_old)
