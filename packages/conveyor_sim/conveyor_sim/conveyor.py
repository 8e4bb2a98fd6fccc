"""The conveyor without ROS: feeds the belt, follows decisions and events, keeps the ledger.

Every method that changes something takes the time, writes the ledger, and says what came of it in
an :class:`Outcome`; the caller then tells the others. Times are seconds of a steady clock, stamps
seconds since the epoch.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from conveyor_sim.belt import Belt, OnBelt
from conveyor_sim.ledger import BoxRecord, Ledger, LedgerError, Place
from conveyor_sim.streams.rows import RejectedRow
from conveyor_sim.streams.stream import Stream
from conveyor_sim.transitions import next_place
from pack_msgs_py.cell_values import BoxEvent, Decision, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, PlacementStatus, Reason
from pack_msgs_py.values import Box

#: Scan numbers reserved in the ledger at a time, so that they grow over restarts.
_SEQUENCE_BLOCK = 1000


@dataclass(frozen=True)
class Outcome:
    """What a call changed: whether the scan is another, events to publish, news for people.

    ``repeated`` are events of an earlier run, for those who were not there; ``complaints`` say
    what in a message made no sense.
    """

    changed: bool = False
    events: tuple[BoxEvent, ...] = ()
    repeated: tuple[BoxEvent, ...] = ()
    notes: tuple[str, ...] = ()
    complaints: tuple[str, ...] = ()


class Conveyor:
    """Owns the belt. Make it, then call :meth:`start` once.

    Raises
    ------
    LedgerError
        From any method: the ledger cannot be read or written.
    """

    def __init__(self, stream: Stream, belt: Belt, ledger: Ledger) -> None:
        self._stream = stream
        self._belt = belt
        self._ledger = ledger
        self._records: dict[str, BoxRecord] = {}
        self._waiting: dict[str, int] = {}
        self._elsewhere: dict[str, BoxRecord] = {}
        self._supplied = 0
        self._paused = False
        self._newest: tuple[float, int] | None = None
        self._pick_open: tuple[float, float] | None = None
        self._sequence = self._sequence_end = int(ledger.setting('scan_sequence', '0'))
        self._dirty: dict[str, BoxRecord] = {}
        self._events: list[BoxEvent] = []
        self._notes: list[str] = []

    @property
    def supplied(self) -> int:
        """Boxes that the stream has given out, rejected rows included."""
        return self._supplied

    @property
    def ended(self) -> bool:
        """Whether the stream is at its end and the belt empty."""
        at_end = self._supplied == len(self._stream)
        return at_end and not self._waiting and self._belt.empty

    def start(self, now_s: float, stamp_s: float) -> Outcome:
        """Take up the ledger where it ended, repeat the rejections it holds, and feed the belt."""
        records = self._ledger.records()
        self._check(records)
        self._records = {record.box_id: record for record in records}
        self._waiting = {r.box_id: r.ordinal for r in records if r.place is Place.WAITING}
        self._supplied = len(records)
        fits = self._ledger.setting('geometry', self._belt.geometry) == self._belt.geometry
        if fits:
            self._belt.restore(self._ledger.belt_state(), now_s)
        for record in records:
            if record.place is Place.ON_BELT and fits and record.slot is not None:
                self._belt.put(self._box(record), record.slot, now_s, record.laps)
            elif record.place is Place.ON_BELT:
                self._set(replace(record, place=Place.WAITING, slot=None))
        if records:
            counts = ', '.join(f'{n} {p.value}' for p, n in self._ledger.counts().items() if n)
            self._notes.append(f'goes on after {len(records)} boxes: {counts}')
        outcome = self._finish(now_s, stamp_s, moved=True)
        self._ledger.set_setting('geometry', self._belt.geometry)
        rejected = (_rejection(record) for record in records if record.place is Place.REJECTED)
        return replace(outcome, repeated=tuple(rejected))

    def on_decision(self, decision: Decision, now_s: float, stamp_s: float) -> Outcome:
        """Bring the box of the newest decision; divert a rejected one to the reject lane."""
        key = (decision.stamp_s, decision.sequence)
        newest = self._newest
        if newest is not None and key[0] <= newest[0] and key[1] <= newest[1]:
            return Outcome()
        self._newest = key
        record = self._records.get(decision.box.id)
        if record is None:
            if decision.box.id not in self._stream:
                return Outcome(complaints=(f'box {decision.box.id!r} is not of this stream',))
            return Outcome()
        if decision.status is PlacementStatus.REJECT:
            if record.place in (Place.ON_BELT, Place.WAITING):
                text = decision.reason or 'rejected by the planner'
                self._reject(record, decision.reject_reason, text, now_s, stamp_s)
            return self._finish(now_s, stamp_s)
        if record.place is Place.ON_BELT and record.slot is not None:
            self._belt.bring(record.slot, now_s)
            return self._finish(now_s, stamp_s, moved=True)
        return Outcome()

    def on_awaited(self, box_id: str, now_s: float, stamp_s: float) -> Outcome:
        """The arm waits for this box: bring it, whatever became of the decision that chose it."""
        record = self._records.get(box_id)
        on_belt = record is not None and record.place is Place.ON_BELT
        if record is None or record.slot is None or not on_belt or self._belt.brings(record.slot):
            return Outcome()
        self._notes.append(f'{box_id}: the arm waits for it')
        self._belt.bring(record.slot, now_s)
        return self._finish(now_s, stamp_s, moved=True)

    def on_event(self, event: BoxEvent, now_s: float, stamp_s: float) -> Outcome:
        """Follow what happened to a box; an event that comes twice or late changes nothing."""
        record = self._records.get(event.box_id) or self._elsewhere.get(event.box_id)
        if record is None:
            if event.box_id not in self._stream:
                return Outcome(complaints=(f'box {event.box_id!r} is not of this stream',))
            record = BoxRecord(-1, event.box_id, Place.WAITING)
        stamp_ns = round(1e9 * (event.stamp_s or stamp_s))
        place = next_place(record, event.event, stamp_ns)
        if place is None:
            if event.event is BoxEventKind.RETURNED and stamp_ns > record.stamp_ns:
                # Back before its picking was heard of: the late PICKED must not take it away.
                self._keep(replace(record, stamp_ns=stamp_ns, returned=True))
            return self._finish(now_s, stamp_s, feed=False)
        moved = replace(
            record,
            place=place,
            stamp_ns=stamp_ns,
            reason=event.reason,
            text=event.text,
            returned=record.returned or place is Place.ON_BELT,
        )
        if record.ordinal < 0:
            self._elsewhere[record.box_id] = replace(moved, place=_unfed(place))
            return Outcome()
        if place is Place.ON_BELT:
            self._take_back(moved, now_s)
        else:
            laps = self._leave_belt(record, now_s, picked=place in (Place.PICKED, Place.PLACED))
            self._set(replace(moved, laps=laps))
        if place in (Place.ON_BELT, Place.LOST):
            what = 'is back on the belt' if place is Place.ON_BELT else 'is lost'
            self._notes.append(f'{record.box_id} {what} {event.text}'.rstrip())
        return self._finish(now_s, stamp_s)

    def on_content(
        self, box_ids: Iterable[str], content_stamp_s: float, now_s: float, stamp_s: float
    ) -> Outcome:
        """Take every box that is in a bin as placed."""
        outcomes = [
            self.on_event(
                BoxEvent(one, BoxEventKind.PLACED, stamp_s=content_stamp_s), now_s, stamp_s
            )
            for one in box_ids
            if not self._is_placed(one)
        ]
        return Outcome(
            any(one.changed for one in outcomes),
            tuple(event for one in outcomes for event in one.events),
            notes=tuple(note for one in outcomes for note in one.notes),
            complaints=tuple(text for one in outcomes for text in one.complaints),
        )

    def pause(self, paused: bool, now_s: float, stamp_s: float) -> Outcome:
        """Stop or resume feeding and moving; what others do to boxes is followed all the same."""
        if paused == self._paused:
            return Outcome()
        self._paused = paused
        self._belt.set_motion(now_s, paused=paused)
        self._notes.append('paused' if paused else 'goes on')
        return self._finish(now_s, stamp_s, moved=True)

    def tune(self, now_s: float, *, belt_speed: float, speed: float) -> None:
        """Change the belt's speed and the speed factor."""
        self._belt.set_motion(now_s, belt_speed=belt_speed, speed=speed)

    def arrival_s(self, now_s: float) -> float | None:
        """When the motion under way ends; ``None`` at rest."""
        return self._belt.arrival_s(now_s)

    def scan(self, now_s: float, stamp_s: float) -> Scan:
        """The look-ahead at this instant; each call has the next sequence number."""
        if self._sequence >= self._sequence_end:
            self._sequence_end = self._sequence + _SEQUENCE_BLOCK
            self._ledger.set_setting('scan_sequence', str(self._sequence_end))
        self._sequence += 1
        return Scan(
            sequence=self._sequence,
            stamp_s=stamp_s,
            boxes=tuple(self._scanned(item, now_s, stamp_s) for item in self._belt.view(now_s)),
            belt_velocity=self._belt.velocity(now_s),
            supplied=self._supplied,
            remaining=len(self._stream) - self._supplied,
        )

    def _scanned(self, item: OnBelt, now_s: float, stamp_s: float) -> ScannedBox:
        pick_open = None
        if item.arrived_s is not None:
            if self._pick_open is None or self._pick_open[0] != item.arrived_s:
                self._pick_open = (item.arrived_s, stamp_s - (now_s - item.arrived_s))
            pick_open = self._pick_open[1]
        return ScannedBox(
            box=item.box,
            pose=self._belt.pose(item),
            pick_open_s=pick_open,
            travel_time_s=item.travel_time_s,
            laps=item.laps,
        )

    def _finish(
        self, now_s: float, stamp_s: float, *, feed: bool = True, moved: bool = False
    ) -> Outcome:
        """Fill the gaps, make it durable, and hand out what is to be told."""
        if feed and not self._paused:
            self._feed(now_s, stamp_s)
        changed = bool(self._dirty) or moved
        if changed:
            for item in self._belt.view(now_s):
                record = self._dirty.get(item.box.id, self._records[item.box.id])
                if record.laps != item.laps:
                    self._set(replace(record, laps=item.laps))
            self._ledger.save(self._dirty.values(), self._belt.state(now_s))
        outcome = Outcome(changed, tuple(self._events), notes=tuple(self._notes))
        self._dirty, self._events, self._notes = {}, [], []
        return outcome

    def _feed(self, now_s: float, stamp_s: float) -> None:
        """Fill every gap, nearest to the pick point first: who waits comes before who is new."""
        for slot in self._belt.free_slots(now_s):
            if self._waiting:
                record = self._records[min(self._waiting, key=self._waiting.__getitem__)]
            else:
                fresh = self._next_of_stream(stamp_s)
                if fresh is None:
                    return
                record = fresh
            self._belt.put(self._box(record), slot, now_s, record.laps)
            self._set(replace(record, place=Place.ON_BELT, slot=slot))

    def _next_of_stream(self, stamp_s: float) -> BoxRecord | None:
        """The next box that can ride; those before it that cannot are rejected or passed over."""
        while self._supplied < len(self._stream):
            ordinal = self._supplied
            entry = self._stream[ordinal]
            self._supplied += 1
            if isinstance(entry, RejectedRow):
                bad = BoxRecord(ordinal, entry.box_id, Place.WAITING)
                self._reject(bad, entry.reason, entry.text, 0.0, stamp_s)
                continue
            fresh = BoxRecord(ordinal, entry.id, Place.WAITING)
            record = replace(self._elsewhere.pop(entry.id, fresh), ordinal=ordinal)
            if record.place is not Place.WAITING:
                self._notes.append(f'{entry.id}: not fed, it is {record.place.value} already')
                self._set(record)
                continue
            refusal = self._belt.refusal(entry)
            if not refusal:
                return record
            self._reject(record, Reason.OVERSIZE, f'{entry.id}: {refusal}', 0.0, stamp_s)
        return None

    def _reject(
        self, record: BoxRecord, reason: Reason, text: str, now_s: float, stamp_s: float
    ) -> None:
        self._leave_belt(record, now_s, picked=False)
        rejected = replace(
            record, place=Place.REJECTED, reason=reason, text=text, stamp_ns=round(1e9 * stamp_s)
        )
        self._set(rejected)
        self._events.append(_rejection(rejected))

    def _leave_belt(self, record: BoxRecord, now_s: float, *, picked: bool) -> int:
        """Take a box off the belt if it is there; return its laps."""
        if record.place is Place.ON_BELT and record.slot is not None:
            return self._belt.take(record.slot, now_s, picked=picked)
        return record.laps

    def _take_back(self, record: BoxRecord, now_s: float) -> None:
        """Lay a box that the arm brought back into the gap it left, and bring it to the arm.

        The box that was fed into that gap goes back to the induct and comes again with the next.
        """
        slot = record.slot if record.slot is not None else self._belt.nearest_slot(now_s)
        guest = self._belt.occupant(slot)
        if guest is not None:
            laps = self._belt.take(slot, now_s, picked=False)
            back = replace(self._records[guest.id], place=Place.WAITING, slot=None, laps=laps)
            self._set(back)
        self._belt.put(self._box(record), slot, now_s, record.laps)
        self._set(replace(record, slot=slot))
        self._belt.bring(slot, now_s)

    def _is_placed(self, box_id: str) -> bool:
        record = self._records.get(box_id) or self._elsewhere.get(box_id)
        return record is not None and record.place is Place.PLACED

    def _keep(self, record: BoxRecord) -> None:
        if record.ordinal < 0:
            self._elsewhere[record.box_id] = record
        else:
            self._set(record)

    def _set(self, record: BoxRecord) -> None:
        self._records[record.box_id] = self._dirty[record.box_id] = record
        if record.place is Place.WAITING:
            self._waiting[record.box_id] = record.ordinal
        else:
            self._waiting.pop(record.box_id, None)

    def _box(self, record: BoxRecord) -> Box:
        entry = self._stream[record.ordinal]
        assert isinstance(entry, Box)
        return entry

    def _check(self, records: list[BoxRecord]) -> None:
        for ordinal, record in enumerate(records):
            entry = self._stream[ordinal] if ordinal < len(self._stream) else None
            known = entry.id if isinstance(entry, Box) else entry.box_id if entry else ''
            if record.ordinal != ordinal or record.box_id != known:
                msg = (
                    f'ledger {self._ledger.path} has box {record.box_id!r} at place '
                    f'{record.ordinal}, the stream {known!r} at {ordinal}: give another state_dir'
                )
                raise LedgerError(msg)


def _rejection(record: BoxRecord) -> BoxEvent:
    return BoxEvent(
        record.box_id,
        BoxEventKind.REJECTED,
        record.reason,
        record.text,
        stamp_s=record.stamp_ns / 1e9,
    )


def _unfed(place: Place) -> Place:
    """Where a box is that has not been fed: one that came back to the belt waits at the induct."""
    return Place.WAITING if place is Place.ON_BELT else place
