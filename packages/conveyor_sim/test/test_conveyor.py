"""The conveyor: decisions, events, feeding, restarts."""

from __future__ import annotations

import pytest
from conveyor_rig import EPOCH, SIZE, ConveyorRig, bad_row

from conveyor_sim.induct.alignment import quarter_turned
from conveyor_sim.ledger.ledger import Whereabouts
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import UP_NEG_Y, UP_POS_X, UP_POS_Y, Box


def test_the_box_that_the_arm_waits_for_comes_without_its_decision():
    cell = ConveyorRig()
    assert not cell.conveyor.on_handled('b0', *cell.clock()).changed
    assert cell.conveyor.on_handled('b2', *cell.clock()).changed
    assert not cell.conveyor.on_handled('b2', *cell.clock()).changed
    cell.now += 10.0
    assert cell.ids()[0] == 'b2'
    assert cell.scan().boxes[0].pick_open_s is not None
    cell.event('b2', Kind.PICKED)
    assert not cell.conveyor.on_handled('b2', *cell.clock()).changed
    assert not cell.conveyor.on_handled('no such box', *cell.clock()).changed


def test_the_first_scan_shows_the_look_ahead_in_the_order_of_the_stream():
    cell = ConveyorRig()
    scan = cell.scan()
    assert [item.box.id for item in scan.boxes] == ['b0', 'b1', 'b2', 'b3', 'b4']
    assert (scan.supplied, scan.remaining, scan.frame_id) == (5, 5, 'cell')
    assert scan.boxes[0].pick_open_s == pytest.approx(EPOCH + 100.0)
    assert [item.pick_open_s for item in scan.boxes[1:]] == [None] * 4


def test_a_decision_brings_its_box_and_the_scan_says_since_when_it_is_there():
    cell = ConveyorRig()
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
    cell = ConveyorRig()
    cell.decide('b3')
    cell.wait()
    assert cell.event('b3', Kind.PICKED).changed
    scan = cell.scan()
    assert len(scan.boxes) == 5
    assert scan.boxes[0].box.id == 'b5', 'the new box lies where the picked one lay'
    assert (scan.supplied, scan.remaining) == (6, 4)


def test_the_next_box_comes_while_the_arm_carries_the_last():
    cell = ConveyorRig()
    cell.event('b0', Kind.PICKED)
    cell.decide('b2')
    cell.wait()
    assert cell.scan().boxes[0].box.id == 'b2'
    cell.event('b0', Kind.PLACED)
    assert cell.scan().boxes[0].box.id == 'b2'


def test_a_decision_of_a_new_planner_counts_although_it_starts_at_one():
    cell = ConveyorRig()
    cell.decide('b1', sequence=70)
    cell.wait()
    cell.decide('b2', sequence=1)
    cell.wait()
    assert cell.ids()[0] == 'b2'


def test_an_old_copy_of_a_decision_moves_nothing():
    cell = ConveyorRig()
    cell.decide('b1', sequence=1)
    cell.wait()
    cell.decide('b2', sequence=2)
    cell.wait()
    assert not cell.decide('b1', sequence=1, stamp=EPOCH + 100.0).changed
    cell.wait()
    assert cell.ids()[0] == 'b2'


def test_a_rejected_box_is_diverted_with_its_reason_and_replaced():
    cell = ConveyorRig()
    news = cell.decide('b2', reject=True)
    (event,) = news.events
    assert (event.box_id, event.event, event.reason) == ('b2', Kind.REJECTED, Reason.OVERSIZE)
    assert event.text == 'fits no bin'
    assert 'b2' not in cell.ids()
    assert len(cell.ids()) == 5
    assert cell.decide('b2', reject=True).events == ()
    assert cell.event('b2', Kind.REJECTED).events == (), 'its own event comes back to it'


def test_a_returned_box_comes_back_to_the_pick_point_and_the_look_ahead_stays():
    cell = ConveyorRig()
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
    cell = ConveyorRig()
    for box_id in ('b0', 'b1', 'b2'):
        cell.decide(box_id)
        cell.wait()
        cell.event(box_id, Kind.PICKED)
        cell.wait()
    laps = lambda: {item.box.id: item.laps for item in cell.scan().boxes}  # noqa: E731
    assert laps() == {'b3': 3, 'b4': 3, 'b5': 2, 'b6': 1, 'b7': 0}
    cell.event('b0', Kind.RETURNED)
    assert 'b5' not in laps(), 'it lay in the gap that b0 had left'
    cell.event('b0', Kind.PICKED, stamp=cell.now + 1.0)
    assert laps()['b5'] == 2


def test_a_late_copy_of_picked_does_not_remove_a_returned_box():
    cell = ConveyorRig()
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
    cell = ConveyorRig()
    cell.wait()
    cell.event('b0', Kind.RETURNED)
    cell.event('b0', Kind.PICKED, stamp=100.0)
    assert cell.ids()[0] == 'b0'


def test_a_box_in_a_bin_is_gone_and_one_that_is_to_come_is_not_fed():
    cell = ConveyorRig()
    news = cell.conveyor.on_content(['b1', 'b6'], EPOCH + 1.0, *cell.clock())
    assert news.changed
    assert 'b1' not in cell.ids()
    assert 'b5' in cell.ids()
    cell.event('b0', Kind.PICKED)
    assert 'b7' in cell.ids()
    assert 'b6' not in cell.ids()
    assert cell.ledger.counts()[Whereabouts.PLACED] == 2
    assert cell.scan().supplied == 8
    assert not cell.conveyor.on_content(['b1', 'b6'], EPOCH + 2.0, *cell.clock()).changed


def test_foreign_boxes_are_complained_about_and_change_nothing():
    cell = ConveyorRig()
    assert 'zz' in cell.event('zz', Kind.PICKED).complaints[0]
    assert 'zz' in cell.decide('zz').complaints[0]
    assert len(cell.ids()) == 5


def test_bad_rows_and_boxes_too_big_for_the_belt_count_as_supplied_and_rejected():
    entries = [bad_row('x'), Box('a', SIZE), Box('wide', (700, 680, 100)), Box('b', SIZE)]
    cell = ConveyorRig([*entries, bad_row('y')])
    assert [event.box_id for event in cell.started.events] == ['x', 'wide', 'y']
    reasons = [event.reason for event in cell.started.events]
    assert reasons == [Reason.INVALID_DATA, Reason.OVERSIZE, Reason.INVALID_DATA]
    assert '700 mm' in cell.started.events[1].text
    scan = cell.scan()
    assert ([item.box.id for item in scan.boxes], scan.supplied) == (['a', 'b'], 5)
    assert scan.remaining == 0


def test_the_stream_ends_when_nothing_remains_and_the_belt_is_empty():
    cell = ConveyorRig([Box('a', SIZE), Box('b', SIZE)])
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
    cell = ConveyorRig()
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
    cell = ConveyorRig(folder=tmp_path)
    cell.decide('b3')
    cell.wait()
    cell.event('b3', Kind.PICKED)
    cell.decide('b1', reject=True)
    cell.decide('b4')
    cell.wait()
    before = cell.scan()
    cell.ledger.close()
    again = ConveyorRig(folder=tmp_path)
    after = again.scan()
    again.wait()
    assert [item.box.id for item in again.scan().boxes] == [item.box.id for item in before.boxes]
    assert (after.supplied, after.remaining) == (before.supplied, before.remaining)
    assert after.sequence > before.sequence
    assert [item.laps for item in again.scan().boxes] == [item.laps for item in before.boxes]
    assert [event.box_id for event in again.started.repeated] == ['b1']
    assert again.started.events == ()


def test_a_late_event_after_a_restart_is_known_to_be_late(tmp_path):
    cell = ConveyorRig(folder=tmp_path)
    cell.event('b0', Kind.PICKED, stamp=100.0)
    cell.event('b0', Kind.RETURNED, stamp=101.0)
    cell.ledger.close()
    again = ConveyorRig(folder=tmp_path)
    again.event('b0', Kind.PICKED, stamp=100.0)
    assert 'b0' in again.ids()


@pytest.mark.parametrize('slots', [1, 3, 6])
def test_a_restart_with_another_look_ahead_keeps_every_box(tmp_path, slots):
    cell = ConveyorRig(folder=tmp_path)
    cell.decide('b3')
    cell.ledger.close()
    again = ConveyorRig(folder=tmp_path, slots=slots)
    assert again.ids() == [f'b{n}' for n in range(slots)]
    assert again.scan().supplied == max(5, slots)
    assert sum(again.ledger.counts().values()) == max(5, slots)


def test_the_induct_turns_a_box_that_lies_with_its_long_edge_across_the_belt():
    cell = ConveyorRig([Box('long', (800, 400, 300)), Box('board', (1100, 160, 18))])
    cell.conveyor.insert_box(Box('by hand', (900.0, 300.0, 100.0)), *cell.clock())
    scan = cell.scan()
    sizes = {item.box.id: item.box.size_mm for item in scan.boxes}
    assert cell.started.events == ()
    assert sizes == {
        'long': (400, 800, 300), 'board': (160, 1100, 18), 'by hand': (300, 900, 100)
    }  # fmt: skip
    cell.restart()
    assert cell.scan().boxes[0].box.size_mm == scan.boxes[0].box.size_mm


def test_a_quarter_turn_carries_faces_and_centre_of_mass_along():
    box = Box('a', (30, 20, 10), com_offset_mm=(3.0, 1.0, 2.0), allowed_up=UP_POS_X | UP_NEG_Y)
    turned = quarter_turned(box)
    assert (turned.size_mm, turned.com_offset_mm) == ((20, 30, 10), (-1.0, 3.0, 2.0))
    assert turned.allowed_up == UP_POS_Y | UP_POS_X
    again = quarter_turned(quarter_turned(quarter_turned(turned)))
    assert again == box
