"""Random picks, returns, rejects, copies, pauses and crashes on either belt."""

from __future__ import annotations

from collections import Counter

import pytest
from conveyor_rig import SIZE, ConveyorRig, bad_row
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from conveyor_sim.ledger.ledger import Whereabouts
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.geometry.pose import extent, metres, stands_upright
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box


class NothingIsLost(RuleBasedStateMachine):
    """Random picks, returns, rejects, copies, pauses and crashes, with a model of where boxes are.

    The arm holds at most one box; every box of the stream is in exactly one place at any time.
    """

    @initialize(
        slots=st.integers(1, 6),
        count=st.integers(1, 25),
        mode=st.sampled_from(['stop_at_pick', 'continuous']),
        speed=st.sampled_from([0.0, 1.0, 5.0]),
    )
    def begin(self, slots, count, mode, speed):
        entries = [
            bad_row(f'b{n}') if n % 7 == 3 else Box(f'b{n}', SIZE) for n in range(max(1, count - 5))
        ]
        self.slots, self.count, self.entries = slots, count, tuple(entries)
        self.cell = ConveyorRig(
            self.entries,
            slots=slots,
            count=count,
            speed=speed,
            belt_mode=mode,
            max_laps=0,
        )
        self.one_way = mode == 'continuous'
        self.at_once = mode == 'stop_at_pick' or speed == 0.0
        self.held = None
        self.gone: dict[str, Whereabouts] = {}
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
            self.cell.decide(box_id, orientation=data.draw(st.sampled_from(ORIENTATIONS)))
            self.held = box_id
            self.tell(box_id, Kind.PICKED)

    @precondition(lambda self: self.held)
    @rule(kind=st.sampled_from([Kind.PLACED, Kind.RETURNED, Kind.LOST]))
    def let_go(self, kind):
        box_id, self.held = self.held, None
        self.tell(box_id, kind)
        if kind is not Kind.RETURNED:
            self.gone[box_id] = Whereabouts.PLACED if kind is Kind.PLACED else Whereabouts.LOST
        else:
            assert box_id in self.cell.ids()

    @rule(data=st.data())
    def choose_and_wait(self, data):
        ids = self.cell.ids()
        if ids:
            box_id = data.draw(st.sampled_from(ids))
            self.cell.decide(box_id, orientation=data.draw(st.sampled_from(ORIENTATIONS)))
            self.cell.step(data.draw(st.floats(0.0, 9.0)), period=0.5)

    @rule(data=st.data())
    def reject(self, data):
        ids = self.cell.ids()
        if ids:
            box_id = data.draw(st.sampled_from(ids))
            self.cell.decide(box_id, reject=True)
            self.gone[box_id] = Whereabouts.REJECTED

    @precondition(lambda self: self.sent)
    @rule(data=st.data())
    def repeat_an_event(self, data):
        box_id, kind, stamp = data.draw(st.sampled_from(self.sent))
        self.cell.event(box_id, kind, stamp)

    @rule(paused=st.booleans())
    def pause(self, paused):
        self.cell.conveyor.pause(paused, *self.cell.clock())

    @rule(seconds=st.floats(0.0, 20.0))
    def wait(self, seconds):
        self.cell.step(seconds, period=0.5)

    @rule()
    def crash(self):
        before = self.cell.ids()
        laps = {item.box.id: item.laps for item in self.cell.scan().boxes}
        self.cell.restart()
        after = self.cell.scan()
        ids = [item.box.id for item in after.boxes]
        if self.at_once and not self.one_way:
            # In the middle of a move another one is the nearest: it starts again from its start.
            ids, before = sorted(ids), sorted(before)
        assert ids[: len(before)] == before
        assert all(item.laps == laps[item.box.id] for item in after.boxes if item.box.id in laps)

    @invariant()
    def a_tipped_box_stands_still_at_the_pick_point(self):
        scan = self.cell.scan()
        tipped = [item for item in scan.boxes if not stands_upright(item.pose.quaternion)]
        assert len(tipped) <= 1
        for item in tipped:
            assert not self.one_way
            assert extent(item.pose, metres(item.box.size_mm))[0][1] == pytest.approx(0.55)
            assert scan.belt_velocity == (0.0, 0.0, 0.0)

    def paused(self):
        return self.cell.conveyor.condition == 'paused'

    @invariant()
    def every_box_is_in_one_place(self):
        scan = self.cell.scan()
        ids = [item.box.id for item in scan.boxes]
        assert len(set(ids)) == len(ids) <= self.slots
        records = self.cell.ledger.records()
        counts = Counter(record.place for record in records)
        assert sum(counts.values()) == scan.supplied == len(records)
        assert scan.supplied + scan.remaining == self.count
        assert sorted(ids) == sorted(r.box_id for r in records if r.place is Whereabouts.ON_BELT)
        assert not set(ids) & set(self.gone)
        assert self.held not in ids
        for record in records:
            if record.box_id in self.gone:
                assert record.place is self.gone[record.box_id]
        if not self.paused() and self.at_once:
            none_to_come = scan.remaining == 0 and not counts[Whereabouts.WAITING]
            assert len(ids) == self.slots or none_to_come


NothingIsLost.TestCase.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
TestNothingIsLost = NothingIsLost.TestCase
