"""What happens to boxes on the belt: brought, taken, laid back, passed over, diverted, fallen.

The book says where each box is, the belt carries those that ride; here the two change together.
Times are seconds of a steady clock, stamps seconds since the epoch.
"""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.belt.loop import Belt
from conveyor_sim.belt.robot_clock import RobotClock
from conveyor_sim.induct.box_book import BoxBook
from conveyor_sim.ledger.ledger import BoxRecord, Whereabouts
from conveyor_sim.ledger.statistics import BeltStatistics
from pack_msgs_py.codes import Reason
from pack_msgs_py.wording import how_many


class BoxMoves:
    """Moves the boxes of ``book`` on ``belt``, and counts in ``statistics`` what was seen.

    ``max_laps`` : a box that was passed over more often is diverted; 0 for any number.
    ``handled`` : the box that the arm works on.
    """

    def __init__(
        self,
        belt: Belt,
        book: BoxBook,
        clock: RobotClock,
        statistics: BeltStatistics,
        max_laps: int,
    ) -> None:
        self.max_laps = max_laps
        self.handled = ''
        self.statistics = statistics
        self._belt = belt
        self._book = book
        self._clock = clock
        self._chosen = ''
        #: Axes that are to be up, of boxes that were chosen.
        self._ups: dict[str, str] = {}

    def choose(self, record: BoxRecord, up: str, now_s: float) -> bool:
        """The planner chose this box: bring it, ``up`` up; ``False`` when it does not ride."""
        if record.place is not Whereabouts.ON_BELT or record.slot is None:
            return False
        self._chosen = record.box_id
        self._ups[record.box_id] = up
        self._belt.bring(record.slot, now_s, up)
        return True

    def handle(self, box_id: str, now_s: float) -> bool:
        """The arm works on this box: whether it must still be brought, as it was chosen last."""
        self.handled = box_id
        record = self._book.record(box_id)
        if record is None or record.slot is None or record.place is not Whereabouts.ON_BELT:
            return False
        up = self._ups.get(box_id)
        if up is None:
            # Whoever chose it spoke to the conveyor before this one.
            up = next((u for u in 'zyx' if self._belt.brings(record.slot, u)), 'z')
        if self._belt.brings(record.slot, up):
            return False
        self._belt.bring(record.slot, now_s, up)
        return True

    def is_spoken_for(self, box_id: str) -> bool:
        """Whether the arm has, or is about to get, a goal for this box."""
        return box_id in (self._chosen, self.handled)

    def leave_belt(self, record: BoxRecord, now_s: float, *, picked: bool) -> int:
        """Take a box off the belt if it is there; return its laps."""
        if record.place is not Whereabouts.ON_BELT or record.slot is None:
            return record.laps
        if self._chosen == record.box_id:
            self._chosen = ''
        if picked:
            held = any(item.held for item in self._belt.view(now_s) if item.slot == record.slot)
            self.statistics.picks += 1
            self.statistics.late_picks += not held and self._clock.speed > 0
        self._ups.pop(record.box_id, None)
        laps = self._belt.take(record.slot, now_s, picked=picked)
        if record.fed_s is not None:
            self.statistics.waited(record.box_id, self._clock.at(now_s) - record.fed_s, laps)
        return laps

    def reject(
        self, record: BoxRecord, reason: Reason, text: str, now_s: float, stamp_s: float
    ) -> None:
        """Divert a box to the reject lane."""
        laps = self.leave_belt(record, now_s, picked=False)
        self._book.reject(replace(record, laps=laps), reason, text, stamp_s)

    def scan_again(
        self, record: BoxRecord, reason: Reason, text: str, now_s: float, stamp_s: float
    ) -> None:
        """Send a box that is not what it seemed back to the induct."""
        laps = self.leave_belt(record, now_s, picked=False)
        self._book.scan_again(replace(record, laps=laps), reason, text, stamp_s)

    def take_back(self, record: BoxRecord, now_s: float, stamp_s: float) -> None:
        """Lay a box that the arm brought back where the arm takes it next.

        Boxes that make room for it go back to the induct; so does one that is not as scanned.
        """
        if record.reason is Reason.INVALID_DATA:
            self._book.scan_again(record, record.reason, record.text, stamp_s)
            return
        self._book.note(f'{record.box_id} is back on the belt {record.text}'.rstrip())
        box = self._book.box(record)
        slot, pushed = self._belt.put_back(box, record.slot, now_s, record.laps)
        for pushed_box, laps in pushed:
            guest = self._book.record(pushed_box.id)
            assert guest is not None
            self._book.set(replace(guest, place=Whereabouts.WAITING, slot=None, laps=laps))
        self._book.set(replace(record, slot=slot))

    def divert_starved(self, now_s: float, stamp_s: float) -> None:
        """Divert boxes that were passed over too often, but not one that is to be picked."""
        if not self.max_laps:
            return
        for item in self._belt.view(now_s):
            record = self._book.record(item.box.id)
            if item.laps > self.max_laps and record and not self.is_spoken_for(item.box.id):
                laps = how_many(item.laps, 'time')
                text = f'passed over {laps}, at most {self.max_laps} are allowed'
                self.reject(record, Reason.MAX_LAPS, text, now_s, stamp_s)

    def let_fall(self, now_s: float, stamp_s: float) -> None:
        """Boxes that fall off the belt do so while it moves, not while the arm can take them."""
        for item in self._belt.view(now_s):
            record = self._book.record(item.box.id)
            if record is not None and not item.held and self._book.falls(record):
                self.reject(record, Reason.FAULT, 'fell off the belt', now_s, stamp_s)

    def note_missed(self) -> bool:
        """Count windows that closed unused; whether there were any."""
        missed = self._belt.missed()
        for box_id in missed:
            self.statistics.missed_windows += 1
            self._book.note(f'{box_id}: not picked in its time, it goes round again')
        return bool(missed)

    def note_laps(self, now_s: float) -> bool:
        """Take the laps of the belt over into the records; whether there is anything to save."""
        for item in self._belt.view(now_s):
            record = self._book.record(item.box.id)
            if record is not None and record.laps != item.laps:
                self._book.set(replace(record, laps=item.laps))
        return self._book.changed
