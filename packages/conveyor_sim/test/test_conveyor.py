"""The conveyor's behaviour: refill, decisions, events, rejects, restart; no box lost or doubled."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from conveyor_sim.belt import Belt
from conveyor_sim.conveyor import Conveyor
from conveyor_sim.ledger import Ledger, Place
from conveyor_sim.streams import RejectedRow, Stream
from pack_msgs_py.cell_values import BoxEvent, Decision
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.codes import PlacementStatus, Reason
from pack_msgs_py.values import Box

EPOCH = 1_700_000_000.0
SIZE = (300.0, 200.0, 100.0)


def bad_row(name):
    return RejectedRow(name, 'f.csv', 3, 'width_mm', 'x', Reason.INVALID_DATA, 'f.csv, line 3: x')


class Cell:
    """A conveyor with a clock and shorthands for what others tell it."""

    def __init__(self, entries=None, *, folder='', slots=5, count=0, length=9.0, speed=1.0):
        entries = entries or tuple(Box(f'b{n}', SIZE) for n in range(10))
        self.now = 100.0
        self.stream = Stream(tuple(entries), count)
        self.ledger = Ledger(folder, self.stream.fingerprint, self.stream.description)
        self.conveyor = Conveyor(self.stream, Belt(length, slots, 1.5, speed), self.ledger)
        self.sequence = 0
        self.started = self.conveyor.start(*self.clock())

    def clock(self):
        return self.now, EPOCH + self.now

    def scan(self):
        return self.conveyor.scan(*self.clock())

    def ids(self):
        return [item.box.id for item in self.scan().boxes]

    def decide(self, box_id, *, reject=False, reason=Reason.OVERSIZE, sequence=None, stamp=None):
        self.sequence += 1
        status = PlacementStatus.REJECT if reject else PlacementStatus.OPTIMAL
        decision = Decision(
            Box(box_id, SIZE),
            bin_id='' if reject else 'LDC-1',
            status=status,
            sequence=self.sequence if sequence is None else sequence,
            stamp_s=EPOCH + self.now if stamp is None else stamp,
            reason='fits no bin' if reject else '',
            reject_reason=reason if reject else Reason.NONE,
        )
        return self.conveyor.on_decision(decision, *self.clock())

    def event(self, box_id, kind, stamp=None):
        stamp_s = EPOCH + (self.now if stamp is None else stamp)
        return self.conveyor.on_event(BoxEvent(box_id, kind, stamp_s=stamp_s), *self.clock())

    def wait(self, seconds=5.0):
        self.now += seconds


def test_the_box_that_the_arm_waits_for_comes_without_its_decision():
    cell = Cell()
    assert not cell.conveyor.on_awaited('b0', *cell.clock()).changed
    assert cell.conveyor.on_awaited('b2', *cell.clock()).changed
    assert not cell.conveyor.on_awaited('b2', *cell.clock()).changed
    cell.now += 10.0
    assert cell.ids()[0] == 'b2'
    assert cell.scan().boxes[0].pick_open_s is not None
    cell.event('b2', Kind.PICKED)
    assert not cell.conveyor.on_awaited('b2', *cell.clock()).changed
    assert not cell.conveyor.on_awaited('no such box', *cell.clock()).changed


def test_the_first_scan_shows_the_look_ahead_in_the_order_of_the_stream():
    cell = Cell()
    scan = cell.scan()
    assert [item.box.id for item in scan.boxes] == ['b0', 'b1', 'b2', 'b3', 'b4']
    assert (scan.supplied, scan.remaining, scan.frame_id) == (5, 5, 'cell')
    assert scan.boxes[0].pick_open_s == pytest.approx(EPOCH + 100.0)
    assert [item.pick_open_s for item in scan.boxes[1:]] == [None] * 4


def test_a_decision_brings_its_box_and_the_scan_says_since_when_it_is_there():
    cell = Cell()
    cell.wait()
    assert cell.decide('b3').changed
    assert cell.scan().belt_velocity[1] == -1.5
    cell.wait(2.3)
    assert cell.scan().boxes[0].pick_open_s is None
    cell.wait(1.0)
    first, second = cell.scan().boxes[0], cell.scan().boxes[0]
    assert first.box.id == 'b3'
    assert first.pick_open_s == second.pick_open_s == pytest.approx(EPOCH + 105.0 + 2.4)
    assert first.travel_time_s == pytest.approx(2.4)


def test_a_pick_is_refilled_at_the_place_of_the_picked_box():
    cell = Cell()
    cell.decide('b3')
    cell.wait()
    assert cell.event('b3', Kind.PICKED).changed
    scan = cell.scan()
    assert len(scan.boxes) == 5
    assert scan.boxes[0].box.id == 'b5', 'the new box lies where the picked one lay'
    assert (scan.supplied, scan.remaining) == (6, 4)


def test_the_next_box_comes_while_the_arm_carries_the_last():
    cell = Cell()
    cell.event('b0', Kind.PICKED)
    cell.decide('b2')
    cell.wait()
    assert cell.scan().boxes[0].box.id == 'b2'
    cell.event('b0', Kind.PLACED)
    assert cell.scan().boxes[0].box.id == 'b2'


def test_a_decision_of_a_new_planner_counts_although_it_starts_at_one():
    cell = Cell()
    cell.decide('b1', sequence=70)
    cell.wait()
    cell.decide('b2', sequence=1)
    cell.wait()
    assert cell.ids()[0] == 'b2'


def test_an_old_copy_of_a_decision_moves_nothing():
    cell = Cell()
    cell.decide('b1', sequence=1)
    cell.wait()
    cell.decide('b2', sequence=2)
    cell.wait()
    assert not cell.decide('b1', sequence=1, stamp=EPOCH + 100.0).changed
    cell.wait()
    assert cell.ids()[0] == 'b2'


def test_a_rejected_box_is_diverted_with_its_reason_and_replaced():
    cell = Cell()
    outcome = cell.decide('b2', reject=True)
    (event,) = outcome.events
    assert (event.box_id, event.event, event.reason) == ('b2', Kind.REJECTED, Reason.OVERSIZE)
    assert event.text == 'fits no bin'
    assert 'b2' not in cell.ids()
    assert len(cell.ids()) == 5
    assert cell.decide('b2', reject=True).events == ()
    assert cell.event('b2', Kind.REJECTED).events == (), 'its own event comes back to it'


def test_a_returned_box_comes_back_to_the_pick_point_and_the_look_ahead_stays():
    cell = Cell()
    cell.event('b0', Kind.PICKED)
    assert cell.ids()[0] == 'b5'
    cell.decide('b2')
    cell.wait()
    assert cell.event('b0', Kind.RETURNED).changed
    cell.wait()
    first = cell.scan().boxes[0]
    assert (first.box.id, first.pick_open_s is not None) == ('b0', True)
    assert sorted(cell.ids()) == ['b0', 'b1', 'b2', 'b3', 'b4']
    cell.event('b1', Kind.PICKED)
    assert 'b5' in cell.ids(), 'the box that made room comes before any new one'
    assert cell.scan().supplied == 6


def test_laps_stay_with_a_box_that_makes_room_and_comes_again():
    cell = Cell()
    cell.event('b0', Kind.PICKED)
    for box_id in ('b2', 'b5', 'b2'):
        cell.decide(box_id)
        cell.wait()
    before = {item.box.id: item.laps for item in cell.scan().boxes}
    assert before['b5'] == 2
    cell.event('b0', Kind.RETURNED)
    cell.event('b0', Kind.PICKED, stamp=cell.now + 1.0)
    assert next(item for item in cell.scan().boxes if item.box.id == 'b5').laps == 2


def test_a_late_copy_of_picked_does_not_remove_a_returned_box():
    cell = Cell()
    picked = cell.now
    cell.event('b0', Kind.PICKED)
    cell.wait()
    cell.event('b0', Kind.RETURNED)
    cell.event('b0', Kind.PICKED, stamp=picked)
    assert 'b0' in cell.ids()
    cell.wait()
    cell.event('b0', Kind.PICKED)
    assert 'b0' not in cell.ids()


def test_returned_before_its_picked_was_heard_keeps_the_box():
    cell = Cell()
    cell.wait()
    cell.event('b0', Kind.RETURNED)
    cell.event('b0', Kind.PICKED, stamp=100.0)
    assert cell.ids()[0] == 'b0'


def test_a_box_in_a_bin_is_gone_and_one_that_is_to_come_is_not_fed():
    cell = Cell()
    outcome = cell.conveyor.on_content(['b1', 'b6'], EPOCH + 1.0, *cell.clock())
    assert outcome.changed
    assert 'b1' not in cell.ids()
    assert 'b5' in cell.ids()
    cell.event('b0', Kind.PICKED)
    assert 'b7' in cell.ids()
    assert 'b6' not in cell.ids()
    assert cell.ledger.counts()[Place.PLACED] == 2
    assert cell.scan().supplied == 8
    assert not cell.conveyor.on_content(['b1', 'b6'], EPOCH + 2.0, *cell.clock()).changed


def test_foreign_boxes_are_complained_about_and_change_nothing():
    cell = Cell()
    assert 'zz' in cell.event('zz', Kind.PICKED).complaints[0]
    assert 'zz' in cell.decide('zz').complaints[0]
    assert len(cell.ids()) == 5


def test_bad_rows_and_boxes_too_big_for_the_belt_count_as_supplied_and_rejected():
    entries = [bad_row('x'), Box('a', SIZE), Box('wide', (700, 200, 100)), Box('b', SIZE)]
    cell = Cell([*entries, bad_row('y')])
    assert [event.box_id for event in cell.started.events] == ['x', 'wide', 'y']
    reasons = [event.reason for event in cell.started.events]
    assert reasons == [Reason.INVALID_DATA, Reason.OVERSIZE, Reason.INVALID_DATA]
    assert '700 mm' in cell.started.events[1].text
    scan = cell.scan()
    assert ([item.box.id for item in scan.boxes], scan.supplied) == (['a', 'b'], 5)
    assert scan.remaining == 0


def test_the_stream_ends_when_nothing_remains_and_the_belt_is_empty():
    cell = Cell([Box('a', SIZE), Box('b', SIZE)])
    assert not cell.conveyor.ended
    cell.event('a', Kind.PICKED)
    cell.event('b', Kind.LOST)
    scan = cell.scan()
    assert (scan.boxes, scan.remaining, cell.conveyor.ended) == ((), 0, True)
    cell.wait()
    cell.event('a', Kind.RETURNED)
    assert cell.ids() == ['a']
    assert not cell.conveyor.ended


def test_a_pause_stops_feeding_and_moving_but_not_listening():
    cell = Cell()
    cell.conveyor.pause(True, *cell.clock())
    cell.event('b0', Kind.PICKED)
    cell.decide('b3')
    cell.wait(60.0)
    scan = cell.scan()
    assert len(scan.boxes) == 4
    assert scan.belt_velocity == (0.0, 0.0, 0.0)
    assert all(item.pick_open_s is None for item in scan.boxes)
    cell.conveyor.pause(False, *cell.clock())
    cell.wait()
    assert cell.ids()[0] == 'b3'
    assert len(cell.ids()) == 5


def test_a_restart_goes_on_with_the_same_boxes_in_the_same_order(tmp_path):
    cell = Cell(folder=tmp_path)
    cell.decide('b3')
    cell.wait()
    cell.event('b3', Kind.PICKED)
    cell.decide('b1', reject=True)
    cell.decide('b4')
    cell.wait()
    before = cell.scan()
    cell.ledger.close()
    again = Cell(folder=tmp_path)
    after = again.scan()
    again.wait()
    assert [item.box.id for item in again.scan().boxes] == [item.box.id for item in before.boxes]
    assert (after.supplied, after.remaining) == (before.supplied, before.remaining)
    assert after.sequence > before.sequence
    assert [item.laps for item in again.scan().boxes] == [item.laps for item in before.boxes]
    assert [event.box_id for event in again.started.repeated] == ['b1']
    assert again.started.events == ()


def test_a_late_event_after_a_restart_is_known_to_be_late(tmp_path):
    cell = Cell(folder=tmp_path)
    cell.event('b0', Kind.PICKED, stamp=100.0)
    cell.event('b0', Kind.RETURNED, stamp=101.0)
    cell.ledger.close()
    again = Cell(folder=tmp_path)
    again.event('b0', Kind.PICKED, stamp=100.0)
    assert 'b0' in again.ids()


@pytest.mark.parametrize('slots', [1, 3, 6])
def test_a_restart_with_another_look_ahead_keeps_every_box(tmp_path, slots):
    cell = Cell(folder=tmp_path)
    cell.decide('b3')
    cell.ledger.close()
    again = Cell(folder=tmp_path, slots=slots)
    assert again.ids() == [f'b{n}' for n in range(slots)]
    assert again.scan().supplied == max(5, slots)
    assert sum(again.ledger.counts().values()) == max(5, slots)


class NothingIsLost(RuleBasedStateMachine):
    """Random picks, returns, rejects, copies, pauses and crashes, with a model of where boxes are.

    The arm holds at most one box; every box of the stream is in exactly one place at any time.
    """

    @initialize(slots=st.integers(1, 6), count=st.integers(1, 25), data=st.data())
    def begin(self, slots, count, data):
        entries = [
            bad_row(f'b{n}') if n % 7 == 3 else Box(f'b{n}', SIZE) for n in range(max(1, count - 5))
        ]
        self.slots, self.count, self.entries = slots, count, tuple(entries)
        self.cell = Cell(self.entries, slots=slots, count=count, speed=0.0)
        self.held = None
        self.gone: dict[str, Place] = {}
        self.sent: list[tuple[str, Kind, float]] = []

    def tell(self, box_id, kind):
        self.cell.wait(0.5)
        self.sent.append((box_id, kind, self.cell.now))
        self.cell.event(box_id, kind)

    @precondition(lambda self: self.held is None)
    @rule(data=st.data())
    def pick(self, data):
        ids = self.cell.ids()
        if ids and self.cell.scan().boxes:
            box_id = data.draw(st.sampled_from(ids))
            self.cell.decide(box_id)
            self.held = box_id
            self.tell(box_id, Kind.PICKED)

    @precondition(lambda self: self.held)
    @rule(kind=st.sampled_from([Kind.PLACED, Kind.RETURNED, Kind.LOST]))
    def let_go(self, kind):
        box_id, self.held = self.held, None
        self.tell(box_id, kind)
        if kind is not Kind.RETURNED:
            self.gone[box_id] = Place.PLACED if kind is Kind.PLACED else Place.LOST
        elif not self.paused():
            assert self.cell.ids()[0] == box_id

    @rule(data=st.data())
    def reject(self, data):
        ids = self.cell.ids()
        if ids:
            box_id = data.draw(st.sampled_from(ids))
            self.cell.decide(box_id, reject=True)
            self.gone[box_id] = Place.REJECTED

    @precondition(lambda self: self.sent)
    @rule(data=st.data())
    def repeat_an_event(self, data):
        box_id, kind, stamp = data.draw(st.sampled_from(self.sent))
        self.cell.event(box_id, kind, stamp)

    @rule(paused=st.booleans())
    def pause(self, paused):
        self.cell.conveyor.pause(paused, *self.cell.clock())

    @rule()
    def crash(self):
        cell = self.cell
        fresh = Conveyor(cell.stream, Belt(9.0, self.slots, 1.5, 0.0), cell.ledger)
        before = sorted(cell.ids())
        fresh.start(*cell.clock())
        cell.conveyor = fresh
        assert set(before) <= set(cell.ids())

    def paused(self):
        return self.cell.conveyor._paused

    @invariant()
    def every_box_is_in_one_place(self):
        scan = self.cell.scan()
        ids = [item.box.id for item in scan.boxes]
        assert len(set(ids)) == len(ids) <= self.slots
        records = self.cell.ledger.records()
        counts = Counter(record.place for record in records)
        assert sum(counts.values()) == scan.supplied == len(records)
        assert scan.supplied + scan.remaining == self.count
        assert sorted(ids) == sorted(r.box_id for r in records if r.place is Place.ON_BELT)
        assert not set(ids) & set(self.gone)
        assert self.held not in ids
        for record in records:
            if record.box_id in self.gone:
                assert record.place is self.gone[record.box_id]
        if not self.paused():
            assert len(ids) == self.slots or (scan.remaining == 0 and not counts[Place.WAITING])


NothingIsLost.TestCase.settings = settings(max_examples=80, stateful_step_count=40, deadline=None)
TestNothingIsLost = NothingIsLost.TestCase
