"""What an event does to the place of a box, whatever comes twice, late or out of order."""

from __future__ import annotations

from conveyor_sim.ledger.ledger import BoxRecord, Whereabouts
from pack_msgs_py.codes import BoxEventKind

_GOES_TO = {
    BoxEventKind.PICKED: Whereabouts.PICKED,
    BoxEventKind.PLACED: Whereabouts.PLACED,
    BoxEventKind.LOST: Whereabouts.LOST,
    BoxEventKind.REJECTED: Whereabouts.REJECTED,
    BoxEventKind.RETURNED: Whereabouts.ON_BELT,
}

#: How far along its way a box is; a box at the induct or on the belt has not begun.
_PROGRESS = {
    Whereabouts.WAITING: 0,
    Whereabouts.ON_BELT: 0,
    Whereabouts.UNSEEN: 0,
    Whereabouts.PICKED: 1,
    Whereabouts.LOST: 2,
    Whereabouts.PLACED: 3,
    Whereabouts.REJECTED: 4,
}


def next_place(record: BoxRecord, event: BoxEventKind, stamp_ns: int) -> Whereabouts | None:
    """Where ``event`` brings the box, or ``None`` when it changes nothing.

    A step forward (belt, picked, placed) is taken whatever its stamp says, so that a clock that
    was set back loses nothing. Everything else must be newer than the last change: a step back,
    which only ``RETURNED`` and finding a lost box are, and a step forward of a box that has come
    back before, since the event may be a late copy from its first journey. Rejected is final, but
    for a box that the arm was quicker to take than the reject lane.
    """
    target = _GOES_TO.get(event)
    if target is None or target is record.place:
        return None
    if record.place is Whereabouts.REJECTED:
        taken = target in (Whereabouts.PICKED, Whereabouts.PLACED) and stamp_ns > record.stamp_ns
        return target if taken else None
    if target is Whereabouts.ON_BELT and record.place in (Whereabouts.WAITING, Whereabouts.UNSEEN):
        return None
    if target is Whereabouts.PICKED and record.place is Whereabouts.PLACED:
        return None
    forward = _PROGRESS[target] > _PROGRESS[record.place]
    if forward and not record.returned:
        return target
    return target if stamp_ns > record.stamp_ns else None
