"""Where every box is, in memory, and what has changed since it was last written down and told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from conveyor_sim.ledger.ledger import INSERTED_FROM, BoxRecord, Ledger, LedgerError, Whereabouts
from conveyor_sim.scanning.inspection import MAX_SCANS, Inspection, joint
from conveyor_sim.scanning.lie import Lie
from conveyor_sim.streams.stream import Stream
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box


class BoxBook:
    """The records of one ledger; changes are kept until :meth:`save`, news until :meth:`news`.

    Raises
    ------
    LedgerError
        From any method: the ledger cannot be read or written.
    """

    def __init__(self, stream: Stream, ledger: Ledger, inspection: Inspection) -> None:
        self.ledger = ledger
        self.supplied = 0
        self._stream = stream
        self._inspection = inspection
        self._inserted = ledger.inserted()
        self._records: dict[str, BoxRecord] = {}
        self._waiting: dict[str, int] = {}
        #: Boxes that nobody sees, by the box before them; their record's text names it too.
        self._unseen: dict[str, str] = {}
        self._elsewhere: dict[str, BoxRecord] = {}
        self._dirty: dict[str, BoxRecord] = {}
        self._events: list[BoxEvent] = []
        self._notes: list[str] = []

    @property
    def inserted(self) -> int:
        """How many boxes were inserted by hand."""
        return len(self._records) - self.supplied

    @property
    def changed(self) -> bool:
        """Whether anything has changed since it was written down."""
        return bool(self._dirty)

    def load(self) -> list[BoxRecord]:
        """Read what the ledger holds; it must be that of this stream."""
        records = self.ledger.records()
        for number, record in enumerate(records):
            if record.ordinal < INSERTED_FROM:
                self._check(number, record)
            self._records[record.box_id] = record
            self._note_place(record)
        return records

    def record(self, box_id: str) -> BoxRecord | None:
        """A box that was given out."""
        return self._records.get(box_id)

    def known(self, box_id: str) -> BoxRecord | None:
        """A box that was given out, or that others spoke of before it was."""
        return self._records.get(box_id) or self._elsewhere.get(box_id)

    def heard_of(self, box_id: str) -> BoxRecord | None:
        """A box that others spoke of before it was given out."""
        return self._elsewhere.get(box_id)

    def is_ours(self, box_id: str) -> bool:
        """Whether a box of this name may come from here."""
        return box_id in self._records or box_id in self._stream

    def true_box(self, record: BoxRecord) -> Box:
        """The box of a record as it really is."""
        if record.ordinal >= INSERTED_FROM:
            return self._inserted[record.ordinal]
        entry = self._stream[record.ordinal]
        assert isinstance(entry, Box)
        return self._inspection.body(entry, record.ordinal)

    def box(self, record: BoxRecord) -> Box:
        """What rides in its place: the box, with the one that nobody sees behind it."""
        box, hidden = self.true_box(record), self._unseen.get(record.box_id)
        return box if hidden is None else joint(box, self.true_box(self._records[hidden]))

    def seen(self, box_id: str) -> Box:
        """What the scanner says of the box that rides under this name."""
        record = self._records[box_id]
        return self._inspection.seen(self.box(record), record.ordinal, record.scans)

    def lie(self, box_id: str) -> Lie:
        """How the box that rides under this name lies on the belt."""
        record = self._records[box_id]
        return self._inspection.lie(record.ordinal, record.scans)

    def true_pose(self, record: BoxRecord, up: str) -> Pose:
        """Where its centre really is once it is at the pick point, axis ``up`` up; frame `cell`."""
        true = self.true_box(record)
        return self._inspection.true_pose(true, record.ordinal, record.scans, up)

    def falls(self, record: BoxRecord) -> bool:
        """Whether this box falls off the belt."""
        return self._inspection.falls(record.ordinal, record.scans)

    def scan_again(self, record: BoxRecord, reason: Reason, text: str, stamp_s: float) -> None:
        """A box that was not what it seemed goes to the induct for a second scan, the last one."""
        if record.scans >= MAX_SCANS:
            self.reject(record, reason, text, stamp_s)
            return
        self.note(f'{record.box_id}: scanned again; {text}')
        self.set(
            replace(
                record,
                place=Whereabouts.WAITING,
                slot=None,
                scans=record.scans + 1,
                stamp_ns=max(record.stamp_ns, round(1e9 * stamp_s)),
            )
        )
        self.uncover()

    def uncover(self) -> None:
        """Boxes that nobody saw are found once the one before them has gone: they are fed again."""
        for before, box_id in list(self._unseen.items()):
            first = self._records[before]
            if first.place in (Whereabouts.ON_BELT, Whereabouts.WAITING) and first.scans == 1:
                continue
            self.note(f'{box_id}: was behind {before}, read as one with it; scanned alone')
            hidden = self._records[box_id]
            self.set(replace(hidden, place=Whereabouts.WAITING, text='', scans=hidden.scans + 1))

    def waiting(self) -> BoxRecord | None:
        """The box that waits at the induct and comes next: those of the stream by their order."""
        if not self._waiting:
            return None
        return self._records[min(self._waiting, key=self._waiting.__getitem__)]

    def here(self, *, without: str) -> list[BoxRecord]:
        """Boxes on the belt and at the induct, but for the one called ``without``."""
        return [
            record
            for record in self._records.values()
            if record.place in (Whereabouts.ON_BELT, Whereabouts.WAITING)
            and record.box_id != without
        ]

    def set(self, record: BoxRecord) -> None:
        """This is now true of a box; one that was only heard of is kept until it is given out."""
        if record.ordinal < 0:
            self._elsewhere[record.box_id] = record
            return
        self._elsewhere.pop(record.box_id, None)
        self._records[record.box_id] = self._dirty[record.box_id] = record
        self._note_place(record)

    def insert(self, box: Box) -> None:
        """A box that is inserted by hand waits at the induct; ``ValueError`` if its id is known."""
        if self.is_ours(box.id) or self.known(box.id) is not None:
            msg = f'box {box.id!r}: there is, or will be, another box of this name; give a new id'
            raise ValueError(msg)
        self.note(f'{box.id}: inserted by hand')
        ordinal = self.ledger.insert(box)
        self._inserted[ordinal] = box
        self.set(BoxRecord(ordinal, box.id, Whereabouts.WAITING))

    def reject(self, record: BoxRecord, reason: Reason, text: str, stamp_s: float) -> None:
        """A box goes to the reject lane, and all are told."""
        stamp_ns = round(1e9 * stamp_s)
        rejected = replace(
            record, place=Whereabouts.REJECTED, reason=reason, text=text, stamp_ns=stamp_ns
        )
        self.set(rejected)
        self._events.append(rejection(rejected))

    def note(self, text: str) -> None:
        """Something that people want to know."""
        self._notes.append(text)

    def save(self, settings: Mapping[str, str]) -> None:
        """Write down what has changed, with ``settings``, all or nothing."""
        self.ledger.save(self._dirty.values(), settings)
        self._dirty = {}

    def news(self) -> tuple[tuple[BoxEvent, ...], tuple[str, ...]]:
        """Events and notes since the last call."""
        news = tuple(self._events), tuple(self._notes)
        self._events, self._notes = [], []
        return news

    def counts(self) -> dict[Whereabouts, int]:
        """How many boxes are where; the sum is the number that was given out."""
        numbers = Counter(record.place for record in self._records.values())
        return {place: numbers[place] for place in Whereabouts}

    def _note_place(self, record: BoxRecord) -> None:
        if record.ordinal < INSERTED_FROM:
            self.supplied = max(self.supplied, record.ordinal + 1)
        if record.place is Whereabouts.WAITING:
            self._waiting[record.box_id] = record.ordinal
        else:
            self._waiting.pop(record.box_id, None)
        if record.place is Whereabouts.UNSEEN:
            self._unseen[record.text] = record.box_id
        elif self._unseen:
            self._unseen = {a: b for a, b in self._unseen.items() if b != record.box_id}

    def _check(self, number: int, record: BoxRecord) -> None:
        entry = self._stream[number] if number < len(self._stream) else None
        known = entry.id if isinstance(entry, Box) else entry.box_id if entry else ''
        if record.ordinal != number or record.box_id != known:
            msg = (
                f'ledger {self.ledger.path} has box {record.box_id!r} at place '
                f'{record.ordinal}, the stream {known!r} at {number}: give another state_dir'
            )
            raise LedgerError(msg)


def rejection(record: BoxRecord) -> BoxEvent:
    """The event of a box that went to the reject lane."""
    stamp_s = record.stamp_ns / 1e9
    return BoxEvent(
        record.box_id, BoxEventKind.REJECTED, record.reason, record.text, stamp_s=stamp_s
    )
