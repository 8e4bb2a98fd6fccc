"""What the operator and upstream do: boxes by hand, drain, arrivals, jams, max_laps, restarts."""

from __future__ import annotations

import pytest
from conveyor_rig import SIZE, ConveyorRig

from conveyor_sim.ledger.ledger import Whereabouts
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Box


def pick(cell, box_id):
    cell.decide(box_id)
    cell.wait()
    return cell.event(box_id, Kind.PICKED)


def test_an_inserted_box_waits_and_comes_before_the_next_of_the_stream():
    cell = ConveyorRig()
    news = cell.conveyor.insert_box(Box('mine', SIZE, 2.5), *cell.clock())
    assert news.changed
    assert 'mine' not in cell.ids()
    pick(cell, 'b0')
    assert 'mine' in cell.ids()
    assert (cell.scan().supplied, cell.scan().remaining) == (6, 5)
    pick(cell, 'mine')
    cell.event('mine', Kind.PLACED)
    counts = cell.conveyor.counts
    assert (counts[Whereabouts.PLACED], sum(counts.values())) == (1, cell.scan().supplied)


@pytest.mark.parametrize('name', ['b0', 'b9', 'mine'])
def test_an_id_that_is_or_will_be_there_is_not_inserted(name):
    cell = ConveyorRig()
    cell.conveyor.insert_box(Box('mine', SIZE), *cell.clock())
    with pytest.raises(ValueError, match=name):
        cell.conveyor.insert_box(Box(name, SIZE), *cell.clock())


def test_a_box_that_cannot_ride_is_not_inserted():
    cell = ConveyorRig()
    with pytest.raises(ValueError, match='700 mm'):
        cell.conveyor.insert_box(Box('wide', (700.0, 680.0, 100.0)), *cell.clock())
    assert sum(cell.conveyor.counts.values()) == 5


def test_a_removed_box_is_rejected_for_the_operator_and_replaced():
    cell = ConveyorRig()
    news = cell.conveyor.remove_box('b2', *cell.clock())
    (event,) = news.events
    assert (event.box_id, event.event, event.reason) == ('b2', Kind.REJECTED, Reason.OPERATOR)
    assert sorted(cell.ids()) == ['b0', 'b1', 'b3', 'b4', 'b5']
    assert cell.conveyor.counts[Whereabouts.REJECTED] == 1


@pytest.mark.parametrize('name', ['b9', 'zz', 'b0', 'b1', 'b3'])
def test_a_box_that_is_elsewhere_or_spoken_for_is_not_removed(name):
    cell = ConveyorRig()
    pick(cell, 'b0')
    cell.decide('b1')
    cell.conveyor.on_handled('b3', *cell.clock())
    with pytest.raises(ValueError, match=name):
        cell.conveyor.remove_box(name, *cell.clock())
    cell.conveyor.on_handled('', *cell.clock())
    assert cell.conveyor.remove_box('b3', *cell.clock()).events


def test_draining_feeds_no_more_until_it_is_lifted():
    cell = ConveyorRig()
    cell.conveyor.drain(True, *cell.clock())
    for name in ('b0', 'b1', 'b2', 'b3', 'b4'):
        pick(cell, name)
    assert (cell.ids(), cell.scan().supplied, cell.conveyor.condition) == ([], 5, 'draining')
    cell.conveyor.drain(False, *cell.clock())
    assert cell.ids() == ['b5', 'b6', 'b7', 'b8', 'b9']


def test_a_pause_a_drain_and_an_inserted_box_hold_over_a_restart():
    cell = ConveyorRig()
    cell.conveyor.insert_box(Box('mine', SIZE, 2.5, max_top_load_n=0.0), *cell.clock())
    cell.conveyor.drain(True, *cell.clock())
    cell.conveyor.pause(True, *cell.clock())
    cell.restart()
    assert cell.conveyor.condition == 'paused'
    cell.conveyor.pause(False, *cell.clock())
    cell.event('b0', Kind.PICKED)
    inserted = next(item.box for item in cell.scan().boxes if item.box.id == 'mine')
    assert (inserted.weight_kg, inserted.max_top_load_n) == (2.5, 0.0)
    cell.event('b1', Kind.PICKED)
    assert len(cell.ids()) == 4


def test_a_box_that_was_passed_over_too_often_goes_to_the_reject_lane():
    cell = ConveyorRig(max_laps=3)
    events = []
    for name in ('b0', 'b1', 'b2', 'b5'):
        events += pick(cell, name).events
    assert sorted(event.box_id for event in events) == ['b3', 'b4']
    assert {event.reason for event in events} == {Reason.MAX_LAPS}
    assert 'passed over 4 times' in events[0].text
    assert cell.conveyor.counts[Whereabouts.REJECTED] == 2
    assert cell.conveyor.statistics.most_laps == 4


def test_the_box_that_is_to_be_picked_next_is_not_rejected_for_its_laps():
    cell = ConveyorRig(max_laps=1, belt_mode='continuous', pick_window=4.0)
    cell.step(3.0)
    cell.decide('b0')
    cell.step(60.0)
    assert 'b0' in cell.ids()
    assert cell.conveyor.statistics.missed_windows > 3
    assert cell.conveyor.counts[Whereabouts.REJECTED] > 3


def test_boxes_come_when_they_arrive_and_the_scan_shows_what_there_is():
    cell = ConveyorRig(arrivals='bursts:2,30')
    assert cell.ids() == ['b0', 'b1']
    assert cell.conveyor.next_change_s(cell.now) == pytest.approx(130.0)
    cell.step(29.0)
    assert len(cell.ids()) == 2
    told = cell.step(1.2)
    assert sum(news.changed for news in told) == 1
    assert cell.ids() == ['b0', 'b1', 'b2', 'b3']
    cell.step(60.0)
    assert len(cell.ids()) == 5
    pick(cell, 'b0')
    assert 'b5' in cell.ids(), 'it had arrived, and waited upstream'


def test_at_speed_0_arrivals_follow_the_time_of_the_arm_and_an_empty_belt_does_not_wait():
    cell = ConveyorRig(arrivals='bursts:1,10', speed=0.0)
    assert cell.ids() == ['b0']
    cell.step(100.0)
    assert cell.ids() == ['b0']
    cell.conveyor.on_robot_time(12.0, *cell.clock())
    assert cell.ids() == ['b0', 'b1']
    cell.event('b0', Kind.PICKED)
    cell.event('b1', Kind.PICKED)
    assert cell.ids() == ['b2']


def test_a_restart_goes_on_with_the_arrivals_where_they_were():
    whole, parted = (ConveyorRig(arrivals='poisson:600', seed=5) for _ in range(2))
    seen = []
    for cell in (whole, parted):
        supplied = []
        for number in range(12):
            cell.step(2.0, period=0.5)
            cell.conveyor.pause(True, *cell.clock())
            cell.conveyor.pause(False, *cell.clock())
            if cell is parted and number % 3 == 0:
                cell.restart()
            supplied.append(cell.scan().supplied)
        seen.append(supplied)
    assert seen[0] == seen[1]


def test_a_jam_stops_the_belt_and_the_feeding_and_passes_by_itself():
    cell = ConveyorRig(jams='at:1+10')
    cell.wait(0.9)
    cell.decide('b3')
    cell.wait(5.0)
    cell.event('b0', Kind.PICKED)
    scan = cell.scan()
    assert (cell.conveyor.condition, len(scan.boxes)) == ('jammed', 4)
    assert scan.belt_velocity == (0.0, 0.0, 0.0)
    assert all(item.pick_open_s is None for item in scan.boxes)
    cell.wait(8.0)
    cell.conveyor.tick(*cell.clock())
    assert (cell.ids()[0], len(cell.ids())) == ('b3', 5)
    assert cell.conveyor.statistics.jams == 1


def test_on_a_running_belt_a_pick_after_the_window_is_taken_as_it_is_and_counted():
    cell = ConveyorRig(belt_mode='continuous', pick_window=1.0)
    cell.step(3.0)
    cell.decide('b0')
    while cell.conveyor.statistics.missed_windows == 0:
        cell.step(0.1)
    cell.event('b0', Kind.PICKED)
    assert 'b0' not in cell.ids()
    assert cell.conveyor.statistics.late_picks == 1
    assert cell.conveyor.statistics.longest_wait_s > 3.0


def test_laps_and_order_of_a_running_belt_survive_a_kill_at_any_moment():
    cell = ConveyorRig(belt_mode='continuous')
    cell.step(7.3)
    for _ in range(20):
        cell.step(0.7)
        before = [(item.box.id, item.laps) for item in cell.scan().boxes]
        cell.restart()
        assert [(item.box.id, item.laps) for item in cell.scan().boxes] == before
    assert max(laps for _, laps in before) >= 1
