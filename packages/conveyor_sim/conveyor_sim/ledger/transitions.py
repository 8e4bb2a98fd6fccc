"""What an event does to the place of a box, whatever comes twice, late or out of order."""

from __future__ import annotations

from conveyor_sim.ledger.ledger import BoxRecord, Place
from pack_msgs_py.codes import BoxEventKind

_GOES_TO = {
    BoxEventKind.PICKED: Place.PICKED,
    BoxEventKind.PLACED: Place.PLACED,
    BoxEventKind.LOST: Place.LOST,
    BoxEventKind.REJECTED: Place.REJECTED,
    BoxEventKind.RETURNED: Place.ON_BELT,
}

#: How far along its way a box is; a box at the induct or on the belt has not begun.
_PROGRESS = {
    Place.WAITING: 0,
    Place.ON_BELT: 0,
    Place.UNSEEN: 0,
    Place.PICKED: 1,
    Place.LOST: 2,
    Place.PLACED: 3,
    Place.REJECTED: 4,
}


def next_place(record: BoxRecord, event: BoxEventKind, stamp_ns: int) -> Place | None:
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
    if record.place is Place.REJECTED:
        taken = target in (Place.PICKED, Place.PLACED) and stamp_ns > record.stamp_ns
        return target if taken else None
    if target is Place.ON_BELT and record.place in (Place.WAITING, Place.UNSEEN):
        return None
    if target is Place.PICKED and record.place is Place.PLACED:
        return None
    forward = _PROGRESS[target] > _PROGRESS[record.place]
    if forward and not record.returned:
        return target
    return target if stamp_ns > record.stamp_ns else None
