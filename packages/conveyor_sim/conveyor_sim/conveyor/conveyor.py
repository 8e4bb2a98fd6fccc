"""The conveyor without ROS: feeds the belt, follows decisions and events, keeps the ledger.

Every method that changes something takes the time, writes the ledger, and says what came of it as
:class:`ConveyorNews`; the caller then tells the others. Times are seconds of a steady clock, stamps
seconds since the epoch; what depends on the belt's own time is in robot seconds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from conveyor_sim.belt.belt_time import BeltTime
from conveyor_sim.belt.loop import Belt
from conveyor_sim.conveyor.box_moves import BoxMoves
from conveyor_sim.conveyor.news import ConveyorNews, merged
from conveyor_sim.conveyor.operating_conditions import OperatingConditions
from conveyor_sim.conveyor.scan_maker import ScanMaker
from conveyor_sim.induct.alignment import aligned
from conveyor_sim.induct.box_book import BoxBook, rejection
from conveyor_sim.induct.induct import Induct, feed
from conveyor_sim.ledger.ledger import BoxRecord, Ledger, Whereabouts
from conveyor_sim.ledger.statistics import BeltStatistics
from conveyor_sim.ledger.transitions import next_place
from conveyor_sim.streams.stream import Stream
from pack_msgs_py.cell_values import BoxEvent, Decision, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, PlacementStatus, Reason
from pack_msgs_py.values import Box
from pack_msgs_py.wording import how_many

_PLACED = BoxEventKind.PLACED
_NOT_BEGUN = (Whereabouts.ON_BELT, Whereabouts.WAITING, Whereabouts.UNSEEN)
#: A grasp that failed so soon after a scan was still made for the one before, seconds.
OLD_NEWS_S = 0.5


class Conveyor:
    """Owns the belt. Make it, then call :meth:`start` once.

    Raises
    ------
    LedgerError
        From any method: the ledger cannot be read or written.
    """

    def __init__(
        self,
        stream: Stream,
        belt: Belt,
        ledger: Ledger,
        *,
        length_m: float = 9.0,
        conditions: OperatingConditions | None = None,
    ) -> None:
        conditions = conditions or OperatingConditions()
        self._belt = belt
        self._ledger = ledger
        inspection = conditions.inspection
        stream = stream.laid(partial(aligned, refusal=belt.refusal))
        self._book = BoxBook(stream, ledger, inspection)
        self._induct = Induct(stream, self._book, conditions.arrivals, inspection, belt.refusal)
        self._time = BeltTime(belt, conditions.jams, conditions.speed)
        self._clock = self._time.clock
        self._scans = ScanMaker(belt, ledger, self._book, length_m)
        self._draining = ledger.setting('draining') == 'yes'
        self._newest: tuple[float, int] | None = None
        self._stirred = False
        self._strangers: set[str] = set()
        self.statistics = BeltStatistics.from_text(ledger.setting('statistics'))
        self._moves = BoxMoves(belt, self._book, self._clock, self.statistics, conditions.max_laps)

    @property
    def supplied(self) -> int:
        """Boxes that were given out, by the stream (rejected rows included) or by hand."""
        return self._book.supplied + self._book.inserted

    @property
    def geometry(self) -> str:
        """The belt, for people."""
        return self._belt.geometry

    @property
    def ended(self) -> bool:
        """Whether the stream is at its end and the belt empty."""
        return self._induct.at_end and self._belt.empty

    @property
    def condition(self) -> str:
        """For people: ``running``, ``paused``, ``jammed``, ``draining`` and the like."""
        if self._time.paused:
            return 'paused'
        if self._time.jammed or self._time.kept:
            return 'jammed'
        if self._time.inactive:
            return 'inactive'
        if self._time.with_arm:
            return 'standing with the arm'
        return 'draining' if self._draining else 'running'

    @property
    def paused(self) -> bool:
        """Whether an operator has stopped the belt."""
        return self._time.paused

    @property
    def jammed(self) -> bool:
        """Whether the belt is jammed now."""
        return self._time.jammed

    @property
    def draining(self) -> bool:
        """Whether no more boxes of the stream are fed."""
        return self._draining

    @property
    def on_belt(self) -> int:
        """Boxes on the belt, at the induct and behind others."""
        counts = self._book.counts()
        return sum(counts[place] for place in _NOT_BEGUN)

    @property
    def handled(self) -> str:
        """The box that the arm works on; empty for none."""
        return self._moves.handled

    @property
    def counts(self) -> dict[Whereabouts, int]:
        """How many boxes are where; the sum is the number that was given out."""
        return self._book.counts()

    def start(self, now_s: float, stamp_s: float, *, active: bool = True) -> ConveyorNews:
        """Take up the ledger where it ended, repeat the rejections it holds, and feed the belt.

        A belt that is not ``active`` stands until :meth:`set_active`.
        """
        self._time.inactive = not active
        records = self._book.load()
        fits = self._ledger.setting('geometry', self._belt.geometry) == self._belt.geometry
        self._belt.restore(self._ledger.setting('belt') if fits else '', now_s)
        robot_s, paused = self._ledger.setting('robot_s', '0'), self._ledger.setting('paused')
        self._time.restore(float(robot_s), now_s, paused=paused == 'yes')
        for record in records:
            if record.place is Whereabouts.ON_BELT and fits and record.slot is not None:
                self._belt.put(self._book.box(record), record.slot, now_s, record.laps)
            elif record.place is Whereabouts.ON_BELT:
                self._book.set(replace(record, place=Whereabouts.WAITING, slot=None))
        if records:
            counts = ', '.join(f'{n} {p.value}' for p, n in self._book.counts().items() if n)
            self._book.note(f'goes on after {how_many(len(records), "box")}: {counts}')
        if self.condition != 'running':
            self._book.note(f'the belt is {self.condition}')
        news = self._finish(now_s, stamp_s, moved=True)
        self._ledger.set_setting('geometry', self._belt.geometry)
        rejected = (rejection(record) for record in records if record.place is Whereabouts.REJECTED)
        return replace(news, repeated=tuple(rejected))

    # -- what others say ------------------------------------------------------------------------

    def on_decision(self, decision: Decision, now_s: float, stamp_s: float) -> ConveyorNews:
        """Bring the box of the newest decision; divert a rejected one to the reject lane."""
        key = (decision.stamp_s, decision.sequence)
        newest = self._newest
        if newest is not None and key[0] <= newest[0] and key[1] <= newest[1]:
            return ConveyorNews()
        self._newest = key
        self._advance(now_s)
        record = self._book.record(decision.box.id)
        if record is None:
            return self._unknown(decision.box.id)
        if decision.status is PlacementStatus.REJECT:
            if record.place in (Whereabouts.ON_BELT, Whereabouts.WAITING):
                text = decision.reason or 'rejected by the planner'
                self._moves.reject(record, decision.reject_reason, text, now_s, stamp_s)
            return self._finish(now_s, stamp_s)
        if self._moves.choose(record, decision.orientation[2], now_s):
            return self._finish(now_s, stamp_s, moved=True)
        return ConveyorNews()

    def on_handled(self, box_id: str, now_s: float, stamp_s: float) -> ConveyorNews:
        """The arm works on this box: bring it, though another decision came after its own."""
        self._advance(now_s)
        if not self._moves.handle(box_id, now_s):
            return ConveyorNews()
        self._book.note(f'{box_id}: the arm waits for it')
        return self._finish(now_s, stamp_s, moved=True)

    def on_event(self, event: BoxEvent, now_s: float, stamp_s: float) -> ConveyorNews:
        """Follow what happened to a box; an event that comes twice or late changes nothing."""
        self._advance(now_s)
        record = self._book.known(event.box_id)
        if record is None:
            news = self._unknown(event.box_id)
            if news.complaints:
                return news
            record = BoxRecord(-1, event.box_id, Whereabouts.WAITING)
        stamp_ns = round(1e9 * (event.stamp_s or stamp_s))
        place = next_place(record, event.event, stamp_ns)
        if place is None:
            if event.event is BoxEventKind.RETURNED and stamp_ns > record.stamp_ns:
                # Back before its picking was heard of: the late PICKED must not take it away.
                self._book.set(replace(record, stamp_ns=stamp_ns, returned=True))
            return self._finish(now_s, stamp_s, refill=False)
        returned = record.returned or place is Whereabouts.ON_BELT
        moved = replace(record, place=place, stamp_ns=stamp_ns, returned=returned)
        moved = replace(moved, reason=event.reason, text=event.text)
        if record.ordinal < 0:
            # Not fed yet: one that came back to the belt waits at the induct.
            unfed = Whereabouts.WAITING if place is Whereabouts.ON_BELT else place
            self._book.set(replace(moved, place=unfed))
            return ConveyorNews()
        if place is Whereabouts.ON_BELT:
            self._moves.take_back(moved, now_s, stamp_s)
        else:
            picked = place in (Whereabouts.PICKED, Whereabouts.PLACED)
            laps = self._moves.leave_belt(record, now_s, picked=picked)
            self._book.set(replace(moved, laps=laps))
            self._moves.let_fall(now_s, stamp_s)
            if place is Whereabouts.LOST:
                self._book.note(f'{record.box_id} is lost {event.text}'.rstrip())
        return self._finish(now_s, stamp_s)

    def on_content(
        self, box_ids: Iterable[str], content_stamp_s: float, now_s: float, stamp_s: float
    ) -> ConveyorNews:
        """Take every box that is in a bin as placed.

        Boxes that are not of this belt, since the bins began with them, are mentioned once.
        """
        records = {box_id: self._book.known(box_id) for box_id in box_ids}
        strange = {name for name in records if not (records[name] or self._book.is_ours(name))}
        if strange - self._strangers:
            self._book.note(f'not of this belt: {how_many(len(strange), "box")} in bins')
            self._strangers |= strange
        return merged(
            [
                self.on_event(BoxEvent(box_id, _PLACED, stamp_s=content_stamp_s), now_s, stamp_s)
                for box_id, record in records.items()
                if box_id not in strange
                if record is None or record.place is not Whereabouts.PLACED
            ]
        )

    def on_empty_grasp(
        self, box_id: str, text: str, ended_s: float, now_s: float, stamp_s: float
    ) -> ConveyorNews:
        """The arm found no box here: scan it again, unless it was since ``ended_s``, the stamp."""
        record = self._book.record(box_id)
        news_ns = 1e9 * (ended_s - OLD_NEWS_S)
        if record is None or record.place is not Whereabouts.ON_BELT or news_ns <= record.stamp_ns:
            return ConveyorNews()
        self._moves.scan_again(record, Reason.FAULT, text, now_s, stamp_s)
        return self._finish(now_s, stamp_s)

    def on_robot_time(self, spent_s: float, now_s: float, stamp_s: float) -> ConveyorNews:
        """The arm has spent so much robot time on a goal; it counts at speed 0."""
        self._clock.pass_by(spent_s)
        return self.tick(now_s, stamp_s)

    # -- what the operator says -----------------------------------------------------------------

    def pause(self, paused: bool, now_s: float, stamp_s: float) -> ConveyorNews:
        """Stop or resume feeding and moving; what others do to boxes is followed all the same."""
        if paused == self._time.paused:
            return ConveyorNews()
        self._advance(now_s)
        self._ledger.set_setting('paused', 'yes' if paused else 'no')
        self._time.pause(paused, now_s)
        self._book.note('paused' if paused else 'goes on')
        return self._finish(now_s, stamp_s, moved=True)

    def drain(self, draining: bool, now_s: float, stamp_s: float) -> ConveyorNews:
        """Stop or resume feeding; what is on the belt goes on to be placed."""
        if draining == self._draining:
            return ConveyorNews()
        self._draining = draining
        self._ledger.set_setting('draining', 'yes' if draining else 'no')
        self._book.note('feeds no more' if draining else 'feeds again')
        return self._finish(now_s, stamp_s, moved=True)

    def empty(self, why: str, now_s: float, stamp_s: float) -> tuple[ConveyorNews, int]:
        """As :meth:`drain`, and all boxes but the arm's go to the reject lane; also how many."""
        self._advance(now_s)
        self._draining = True
        self._ledger.set_setting('draining', 'yes')
        gone = 0
        # A box that nobody sees is found once the one before it has gone.
        while chosen := self._book.here(without=self._moves.handled):
            for record in chosen:
                self._moves.reject(record, Reason.OPERATOR, why, now_s, stamp_s)
            gone += len(chosen)
            self._book.uncover()
        self._book.note(f'{why}: {how_many(gone, "box")}')
        return self._finish(now_s, stamp_s, moved=True), gone

    def keep_standing(self, kept: bool, now_s: float, stamp_s: float = 0.0) -> ConveyorNews:
        """Let the belt stand until a jam is acknowledged, or no longer."""
        self._advance(now_s)
        self._time.keep(now_s, kept=kept)
        return self._finish(now_s, stamp_s, moved=True) if not kept else ConveyorNews(True)

    def stand_with_arm(self, stands: bool, now_s: float, stamp_s: float) -> ConveyorNews:
        """The arm has stopped, or goes on: boxes that nobody takes need not go round."""
        if stands == self._time.with_arm:
            return ConveyorNews()
        self._advance(now_s)
        self._time.keep(now_s, with_arm=stands)
        return self._finish(now_s, stamp_s, moved=True)

    def set_active(self, active: bool, now_s: float, stamp_s: float) -> ConveyorNews:
        """Run as the others have it, or stand still."""
        if active != self._time.inactive:
            return ConveyorNews()
        self._advance(now_s)
        self._time.keep(now_s, inactive=not active)
        return self._finish(now_s, stamp_s, moved=True)

    def insert_box(self, box: Box, now_s: float, stamp_s: float) -> ConveyorNews:
        """Lay a box on by hand: it waits at the induct and comes before new ones of the stream.

        Raises
        ------
        ValueError
            It cannot ride, or the cell knows a box of this name.
        """
        box = aligned(box, self._belt.refusal)
        refusal = self._belt.refusal(box)
        if refusal:
            msg = f'box {box.id!r}: {refusal}'
            raise ValueError(msg)
        self._book.insert(box)
        return self._finish(now_s, stamp_s, moved=True)

    def remove_box(self, box_id: str, now_s: float, stamp_s: float) -> ConveyorNews:
        """Take a box away by hand, from the belt or the induct, to the reject lane.

        Raises
        ------
        ValueError
            It is not there, or it is the one that the arm is to take next.
        """
        record = self._book.record(box_id)
        if record is None or record.place not in (Whereabouts.ON_BELT, Whereabouts.WAITING):
            where = 'not known' if record is None else record.place.value
            msg = f'box {box_id!r} is not on the belt: it is {where}'
            raise ValueError(msg)
        stands = self._time.with_arm and box_id != self._moves.handled
        if self._moves.is_spoken_for(box_id) and not stands:
            msg = f'box {box_id!r} is the one that the arm is to take next; first: cell pause'
            raise ValueError(msg)
        self._moves.reject(record, Reason.OPERATOR, 'removed by hand', now_s, stamp_s)
        return self._finish(now_s, stamp_s)

    def tune(self, now_s: float, *, belt_speed: float, speed: float, max_laps: int) -> None:
        """Change the belt's speed, the speed factor, and how often a box may be passed over."""
        self._advance(now_s)
        self._moves.max_laps = max_laps
        self._time.tune(now_s, belt_speed, speed)

    # -- regularly ------------------------------------------------------------------------------

    def tick(self, now_s: float, stamp_s: float) -> ConveyorNews:
        """Let happen what is due: arrivals, jams, laps, windows that close."""
        self._advance(now_s)
        return self._finish(now_s, stamp_s)

    def moves(self, now_s: float) -> bool:
        """Whether the belt is in motion."""
        return self._belt.moves(now_s)

    def next_change_s(self, now_s: float) -> float | None:
        """When :meth:`tick` is due next; ``None`` while nothing is foreseen."""
        due = [self._belt.next_change_s(now_s), self._time.next_change_s(now_s)]
        arrival_s = self._induct.next_arrival_s(self._clock.at(now_s))
        if arrival_s is not None:
            due.append(self._clock.wall_s(arrival_s, now_s))
        return min((due_s for due_s in due if due_s is not None), default=None)

    def scan(self, now_s: float, stamp_s: float) -> Scan:
        """The look-ahead at this instant; each call has the next sequence number."""
        return self._scans.scan(now_s, stamp_s, self.supplied, self._induct.remaining)

    def true_boxes(self, now_s: float) -> tuple[ScannedBox, ...]:
        """The boxes on the belt as they really are."""
        return self._scans.true_boxes(now_s)

    def _advance(self, now_s: float) -> None:
        """Bring robot time up to now, with the jams that began or ended on the way."""
        for began in self._time.advance(now_s):
            self._stirred = True
            self.statistics.jams += began
            self._book.note('jammed' if began else 'the jam is over')

    def _finish(
        self, now_s: float, stamp_s: float, *, refill: bool = True, moved: bool = False
    ) -> ConveyorNews:
        """Fill the gaps, make it durable, and hand out what is to be told."""
        self._moves.divert_starved(now_s, stamp_s)
        self._book.uncover()
        if refill and not self._time.stands:
            feed(self._induct, self._belt, self._clock, now_s, stamp_s, draining=self._draining)
        missed = self._moves.note_missed()
        changed = self._moves.note_laps(now_s) or moved or self._stirred or missed
        self._stirred = False
        if changed:
            settings = {
                'belt': self._belt.state(now_s),
                'robot_s': repr(self._clock.at(now_s)),
                'statistics': self.statistics.text(),
            }
            self._book.save(settings)
        events, notes = self._book.news()
        return ConveyorNews(changed, events, notes=notes)

    def _unknown(self, box_id: str) -> ConveyorNews:
        ours = self._book.is_ours(box_id)
        return ConveyorNews(complaints=() if ours else (f'box {box_id!r} is not of this stream',))
