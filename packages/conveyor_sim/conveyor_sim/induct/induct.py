"""The induct: which box is laid on the belt next, and which never is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from conveyor_sim.belt.loop import Belt
from conveyor_sim.belt.robot_clock import RobotClock
from conveyor_sim.induct.arrivals import Arrivals
from conveyor_sim.induct.box_book import BoxBook
from conveyor_sim.ledger.ledger import BoxRecord, Whereabouts
from conveyor_sim.scanning.inspection import MAX_SCANS, Inspection, joint
from conveyor_sim.streams.box_records import RejectedRow
from conveyor_sim.streams.repeating import entry_id
from conveyor_sim.streams.stream import Stream
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Box


class Induct:
    """Takes boxes from the stream as they arrive; ``refuse`` says why one cannot ride."""

    def __init__(
        self,
        stream: Stream,
        book: BoxBook,
        arrivals: Arrivals,
        inspection: Inspection,
        refuse: Callable[[Box], str],
    ) -> None:
        self._stream = stream
        self.book = book
        self._arrivals = arrivals
        self._inspection = inspection
        self._refuse = refuse

    @property
    def remaining(self) -> int:
        """Boxes of the stream that are still to come."""
        return len(self._stream) - self.book.supplied

    @property
    def at_end(self) -> bool:
        """Whether nothing will come any more."""
        return self.remaining == 0 and self.book.waiting() is None

    def next_arrival_s(self, robot_s: float) -> float | None:
        """When the next box comes; ``None`` when one is there, or none will come."""
        if self.remaining == 0 or self.book.waiting() is not None:
            return None
        return self._arrivals.next_s(self.book.supplied, robot_s)

    def first(self, robot_s: float, stamp_s: float) -> BoxRecord | None:
        """The next box that can ride: who waits comes before who is new.

        Those before it that cannot are rejected, or passed over when they are elsewhere already.
        It is given out, and counts as supplied, only once its record is set.
        """
        waiting = self.book.waiting()
        if waiting is not None:
            return waiting
        while self.remaining and self._arrivals.arrived(robot_s) > self.book.supplied:
            record = self._look_at(self.book.supplied, robot_s, stamp_s)
            if record is not None:
                return record
        return None

    def _look_at(self, ordinal: int, robot_s: float, stamp_s: float) -> BoxRecord | None:
        entry = self._stream[ordinal]
        if isinstance(entry, RejectedRow):
            bad = BoxRecord(ordinal, entry.box_id, Whereabouts.WAITING)
            self.book.reject(bad, entry.reason, entry.text, stamp_s)
            return None
        heard = self.book.heard_of(entry.id) or BoxRecord(ordinal, entry.id, Whereabouts.WAITING)
        record = replace(heard, ordinal=ordinal)
        if record.place is not Whereabouts.WAITING:
            self.book.note(f'{entry.id}: not fed, it is {record.place.value} already')
            self.book.set(record)
            return None
        stopped = self._stopped(entry, ordinal)
        if stopped is not None:
            self.book.reject(record, stopped[0], f'{entry.id}: {stopped[1]}', stamp_s)
            return None
        scans = self._inspection.read_at(ordinal)
        if scans != 1:
            record = replace(record, scans=scans or MAX_SCANS)
            self.book.note(f'{entry.id}: not read at the first scan, scanned again')
            self.book.set(record)
        elif self._inspection.touches_next(ordinal):
            self._cover_next(record, robot_s)
        return record

    def _stopped(self, box: Box, ordinal: int) -> tuple[Reason, str] | None:
        """Why gauge, checkweigher or scanner do not let a box pass."""
        body = self._inspection.body(box, ordinal)
        refusal = self._refuse(body)
        if refusal:
            return Reason.OVERSIZE, refusal
        refusal = self._inspection.refusal(body)
        if refusal:
            return Reason.OVERWEIGHT, refusal
        if self._inspection.has_label_of_last(ordinal):
            other = entry_id(self._stream[ordinal - 1])
            return Reason.DUPLICATE_ID, f'reads {other!r}, which was seen before'
        if self._inspection.read_at(ordinal) is None:
            return Reason.NO_READ, f'not read in {MAX_SCANS} scans'
        return None

    def _cover_next(self, record: BoxRecord, robot_s: float) -> None:
        """The box after this one touches it and is read as one with it, when both can ride so."""
        place = record.ordinal + 1
        if self.remaining < 2 or self._arrivals.arrived(robot_s) <= place:
            return
        hidden = self._stream[place]
        if isinstance(hidden, RejectedRow) or self.book.heard_of(hidden.id) is not None:
            return
        entry = self._stream[record.ordinal]
        assert isinstance(entry, Box)
        both = joint(
            self._inspection.body(entry, record.ordinal), self._inspection.body(hidden, place)
        )
        if self._refuse(both) or self._inspection.refusal(both):
            return
        self.book.set(record)
        self.book.set(BoxRecord(place, hidden.id, Whereabouts.UNSEEN, text=record.box_id))


def feed(
    induct: Induct, belt: Belt, clock: RobotClock, now_s: float, stamp_s: float, *, draining: bool
) -> None:
    """Lay on what has come, as long as there is room.

    Parameters
    ----------
    induct : where boxes come from.
    belt : where they go.
    clock : robot time; at speed 0 it skips to the next arrival when nothing else can happen.
    now_s : seconds of the steady clock.
    stamp_s : the same instant, seconds since the epoch, for those that are rejected.
    draining : only boxes that wait already are laid on, none of the stream.
    """
    book = induct.book
    while True:
        robot_s = clock.at(now_s)
        record = None
        if not draining or book.waiting() is not None:
            record = induct.first(robot_s, stamp_s)
        if record is None:
            due_s = induct.next_arrival_s(robot_s)
            if draining or due_s is None or not belt.empty or clock.speed:
                return
            # As fast as possible, and nothing else can happen before it comes.
            clock.skip_to(due_s)
            continue
        box = book.box(record)
        slot = belt.room_for(box, now_s)
        if slot is None:
            return
        belt.put(box, slot, now_s, record.laps)
        fed_s = robot_s if record.fed_s is None else record.fed_s
        book.set(replace(record, place=Whereabouts.ON_BELT, slot=slot, fed_s=fed_s))
