"""The induct: which box is laid on the belt next, and which never is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from conveyor_sim.arrivals import Arrivals
from conveyor_sim.book import Book
from conveyor_sim.ledger import BoxRecord, Place
from conveyor_sim.streams.rows import RejectedRow
from conveyor_sim.streams.stream import Stream
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Box


class Induct:
    """Takes boxes from the stream as they arrive; ``refuse`` says why one cannot ride."""

    def __init__(
        self, stream: Stream, book: Book, arrivals: Arrivals, refuse: Callable[[Box], str]
    ) -> None:
        self._stream = stream
        self._book = book
        self._arrivals = arrivals
        self._refuse = refuse

    @property
    def remaining(self) -> int:
        """Boxes of the stream that are still to come."""
        return len(self._stream) - self._book.supplied

    @property
    def at_end(self) -> bool:
        """Whether nothing will come any more."""
        return self.remaining == 0 and self._book.waiting() is None

    def next_arrival_s(self, robot_s: float) -> float | None:
        """When the next box comes; ``None`` when one is there, or none will come."""
        if self.remaining == 0 or self._book.waiting() is not None:
            return None
        return self._arrivals.next_s(self._book.supplied, robot_s)

    def first(self, robot_s: float, stamp_s: float) -> BoxRecord | None:
        """The next box that can ride: who waits comes before who is new.

        Those before it that cannot are rejected, or passed over when they are elsewhere already.
        It is given out, and counts as supplied, only once its record is set.
        """
        waiting = self._book.waiting()
        if waiting is not None:
            return waiting
        while self.remaining and self._arrivals.arrived(robot_s) > self._book.supplied:
            record = self._look_at(self._book.supplied, stamp_s)
            if record is not None:
                return record
        return None

    def _look_at(self, ordinal: int, stamp_s: float) -> BoxRecord | None:
        entry = self._stream[ordinal]
        if isinstance(entry, RejectedRow):
            bad = BoxRecord(ordinal, entry.box_id, Place.WAITING)
            self._book.reject(bad, entry.reason, entry.text, stamp_s)
            return None
        heard = self._book.heard_of(entry.id)
        record = replace(heard or BoxRecord(ordinal, entry.id, Place.WAITING), ordinal=ordinal)
        if record.place is not Place.WAITING:
            self._book.note(f'{entry.id}: not fed, it is {record.place.value} already')
            self._book.set(record)
            return None
        refusal = self._refuse(entry)
        if not refusal:
            return record
        self._book.reject(record, Reason.OVERSIZE, f'{entry.id}: {refusal}', stamp_s)
        return None
