"""The tilt tray: a chosen box is tipped at the pick point, and back before the belt moves."""

from __future__ import annotations

import json

import pytest
from conveyor_rig import SIZE, ConveyorRig
from hypothesis import given
from hypothesis import strategies as st

from conveyor_sim.belt.indexing_belt import IndexingBelt
from conveyor_sim.belt.tilt_tray import pose_on_tray
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.geometry.pose import extent, metres, turn_between
from pack_msgs_py.orientation import QUATERNIONS, TIPPED
from pack_msgs_py.values import Box

#: Robot seconds of one tip, and from one slot to the next (1.8 m at 1.5 m/s).
TILT_S, NEXT_S = 3.0, 1.2
#: An empty tray goes back so fast.
BACK_S = TILT_S / 2


def tray_belt(**motion):
    belt = IndexingBelt(9.0, 5, tilt_time_s=TILT_S, **motion)
    for number in range(5):
        box = Box(f'b{number}', SIZE)
        belt.put(box, belt.room_for(box, 0.0), 0.0)
    return belt


def find(belt, box_id, now):
    return next(item for item in belt.view(now) if item.box.id == box_id)


def lies(item):
    return (item.up, pytest.approx(item.tipped))


@pytest.mark.parametrize('speed', [1.0, 4.0])
def test_a_box_is_held_once_it_has_come_and_is_tipped(speed):
    belt = tray_belt(speed=speed)
    there_s = 10.0 + (NEXT_S + TILT_S) / speed
    belt.bring(find(belt, 'b1', 0.0).slot, 10.0, 'y')
    assert belt.next_change_s(10.0) == pytest.approx(there_s)
    half = find(belt, 'b1', 10.0 + (NEXT_S + TILT_S / 2) / speed)
    assert (half.s_m, half.held) == (0.0, False)
    assert lies(half) == ('y', 0.5)
    item = find(belt, 'b1', there_s + 0.1)
    assert (item.held, item.opens_s) == (True, pytest.approx(there_s))
    assert lies(item) == ('y', 1.0)
    assert not belt.moves(there_s + 0.1)


def test_the_belt_stands_while_a_box_is_tipped():
    belt = tray_belt()
    belt.bring(find(belt, 'b1', 0.0).slot, 0.0, 'x')
    assert belt.velocity(NEXT_S / 2)[1] == -1.5
    assert belt.velocity(NEXT_S + 0.1) == (0.0, 0.0, 0.0)
    assert belt.moves(NEXT_S + 0.1)


def test_a_box_that_is_not_picked_is_tipped_back_before_the_belt_moves():
    belt = tray_belt()
    belt.bring(find(belt, 'b0', 0.0).slot, 0.0, 'y')
    assert find(belt, 'b0', 5.0).held
    belt.bring(find(belt, 'b1', 5.0).slot, 5.0)
    for share in (0.1, 0.5, 0.9):
        item = find(belt, 'b0', 5.0 + share * TILT_S)
        assert (item.s_m, item.held) == (0.0, False)
        assert lies(item) == ('y', 1.0 - share)
    there_s = 5.0 + TILT_S + NEXT_S
    assert find(belt, 'b1', there_s + 0.01).held
    assert lies(find(belt, 'b0', there_s + 0.1)) == ('z', 0.0)


def test_a_box_that_another_placement_turns_otherwise_is_tipped_over_flat():
    belt = tray_belt()
    slot = find(belt, 'b0', 0.0).slot
    belt.bring(slot, 0.0, 'y')
    belt.bring(slot, 5.0, 'x')
    assert lies(find(belt, 'b0', 5.0 + TILT_S / 2)) == ('y', 0.5)
    assert lies(find(belt, 'b0', 5.0 + 1.5 * TILT_S)) == ('x', 0.5)
    assert find(belt, 'b0', 5.0 + 2 * TILT_S + 0.01).held


def test_an_empty_tray_goes_back_while_the_belt_brings_the_next_box():
    belt = tray_belt()
    first, second = (find(belt, name, 0.0).slot for name in ('b0', 'b1'))
    belt.bring(first, 0.0, 'y')
    belt.take(first, 5.0, picked=True)
    assert find(belt, 'b1', 5.0).travel_time_s == pytest.approx(BACK_S)
    belt.bring(second, 5.0)
    assert not find(belt, 'b1', 5.0 + BACK_S - 0.01).held
    item = find(belt, 'b1', 5.0 + BACK_S + 0.01)
    assert item.held
    assert lies(item) == ('z', 0.0)


def test_a_tray_that_has_gone_back_costs_the_next_box_nothing():
    belt = tray_belt()
    first = find(belt, 'b0', 0.0).slot
    belt.bring(first, 0.0, 'y')
    belt.take(first, 5.0, picked=True)
    belt.bring(find(belt, 'b1', 9.0).slot, 9.0)
    assert find(belt, 'b1', 9.0 + NEXT_S + 0.01).held


def test_a_box_laid_into_the_gap_at_the_pick_point_waits_for_the_tray():
    belt = tray_belt()
    first = find(belt, 'b0', 0.0).slot
    belt.bring(first, 0.0, 'y')
    belt.take(first, 5.0, picked=True)
    new = Box('new', SIZE)
    assert belt.room_for(new, 5.0) == first
    belt.put(new, first, 5.0)
    belt.bring(first, 5.0, 'y')
    assert lies(find(belt, 'new', 5.0 + BACK_S / 2)) == ('z', 0.0)
    assert not find(belt, 'new', 5.0 + BACK_S + TILT_S - 0.01).held
    assert find(belt, 'new', 5.0 + BACK_S + TILT_S + 0.01).held


def test_at_speed_0_all_that_takes_no_time_but_is_counted():
    belt = tray_belt(speed=0.0)
    first, second = (find(belt, name, 0.0).slot for name in ('b0', 'b1'))
    belt.bring(first, 0.0, 'y')
    assert find(belt, 'b0', 0.0).held
    belt.take(first, 0.0, picked=True)
    belt.bring(second, 0.0, 'x')
    item = find(belt, 'b1', 0.0)
    assert item.held
    assert lies(item) == ('x', 1.0)
    assert item.travel_time_s == BACK_S


def test_a_paused_tray_stands_where_it_is():
    belt = tray_belt()
    belt.bring(find(belt, 'b0', 0.0).slot, 0.0, 'y')
    belt.set_motion(TILT_S / 2, paused=True)
    assert lies(find(belt, 'b0', 50.0)) == ('y', 0.5)
    assert belt.next_change_s(50.0) is None
    belt.set_motion(50.0, paused=False)
    assert find(belt, 'b0', 50.01 + TILT_S / 2).held


@pytest.mark.parametrize('speed', [0.0, 1.0])
def test_a_box_that_is_taken_away_before_it_has_come_is_not_waited_for(speed):
    belt = tray_belt(speed=speed)
    belt.set_motion(0.0, paused=True)
    slot = find(belt, 'b1', 0.0).slot
    belt.bring(slot, 0.0, 'y')
    belt.take(slot, 0.0, picked=True)
    belt.set_motion(0.0, paused=False)
    assert not belt.moves(NEXT_S + 0.1)


def test_a_belt_without_a_tray_keeps_every_box_upright():
    belt = IndexingBelt(9.0, 5)
    box = Box('b0', SIZE)
    belt.put(box, belt.room_for(box, 0.0), 0.0)
    belt.bring(0, 0.0, 'y')
    assert belt.brings(0, 'y')
    item = find(belt, 'b0', 10.0)
    assert item.held
    assert lies(item) == ('z', 0.0)


def test_a_state_of_a_belt_without_a_tray_can_still_be_read():
    belt = tray_belt()
    belt.restore(json.dumps({'offset_um': 0, 'travel_um': 0, 'pick_offset_um': 0}), 3.0)
    assert find(belt, 'b0', 3.0).held


@given(
    size=st.tuples(*[st.floats(50.0, 450.0)] * 3),
    axis=st.sampled_from('xyz'),
    share=st.floats(0.0, 1.0),
)
def test_a_box_on_the_tray_touches_guide_and_belt_however_far_it_is_tipped(size, axis, share):
    pose = pose_on_tray(size, axis, share)
    (x0, y, z), (x1, _, _) = extent(pose, metres(size))
    assert (x0 + x1, y, z) == pytest.approx((0.0, 0.55, 0.75), abs=1e-9)
    if share == 1.0:
        assert pose.quaternion == QUATERNIONS[TIPPED[axis]]


def test_the_scan_and_the_truth_say_how_a_tipped_box_lies():
    cell = ConveyorRig(tilt_time=TILT_S, size_sigma=2.0, yaw_sigma=0.3)
    cell.decide('b1', orientation='zyx')
    cell.wait(30.0)
    item = cell.scan().boxes[0]
    assert (item.box.id, item.pose.quaternion) == ('b1', QUATERNIONS['zyx'])
    assert item.pick_open_s is not None
    true = next(b for b in cell.conveyor.true_boxes(cell.now) if b.box.id == 'b1')
    assert turn_between(true.pose, item.pose) < 0.03
    assert true.box.size_mm == SIZE, 'the pose carries the turn, not the sizes'


def test_the_world_is_told_how_a_box_will_lie_before_it_is_held():
    cell = ConveyorRig(tilt_time=TILT_S)
    cell.decide('b1', orientation='xzy')
    assert cell.scan().boxes[0].box.id == 'b0'
    true = next(b for b in cell.conveyor.true_boxes(cell.now) if b.box.id == 'b1')
    assert true.pose.quaternion == QUATERNIONS['xzy']


def test_a_box_that_the_arm_waits_for_is_tipped_again_after_another_decision():
    cell = ConveyorRig(tilt_time=TILT_S)
    cell.decide('b1', orientation='xzy')
    cell.decide('b2')
    cell.wait(30.0)
    cell.conveyor.on_handled('b1', *cell.clock())
    cell.wait(30.0)
    item = cell.scan().boxes[0]
    assert (item.box.id, item.pose.quaternion) == ('b1', QUATERNIONS['xzy'])


def test_a_restart_goes_on_with_the_tip_and_loses_nothing():
    cell = ConveyorRig(tilt_time=TILT_S)
    cell.decide('b1', orientation='xzy')
    cell.wait(NEXT_S + TILT_S / 2)
    before = set(cell.ids())
    cell.restart()
    assert set(cell.ids()) == before
    assert not cell.conveyor.on_handled('b1', *cell.clock()).changed
    cell.wait(30.0)
    item = cell.scan().boxes[0]
    assert (item.box.id, item.pose.quaternion) == ('b1', QUATERNIONS['xzy'])


def test_a_tipped_box_that_comes_back_lies_upright_until_it_is_chosen_again():
    cell = ConveyorRig(tilt_time=TILT_S)
    cell.decide('b1', orientation='xzy')
    cell.wait(30.0)
    cell.event('b1', Kind.PICKED)
    cell.wait(3.0)
    cell.event('b1', Kind.RETURNED)
    cell.wait(30.0)
    item = cell.scan().boxes[0]
    assert (item.box.id, item.pose.quaternion) == ('b1', QUATERNIONS['xyz'])
    cell.decide('b1', orientation='zyx')
    cell.wait(30.0)
    assert cell.scan().boxes[0].pose.quaternion == QUATERNIONS['zyx']


def test_an_operator_may_remove_a_box_while_it_is_tipped_back():
    cell = ConveyorRig(tilt_time=TILT_S)
    cell.decide('b1', orientation='xzy')
    cell.wait(30.0)
    cell.decide('b2')
    cell.wait(TILT_S / 2)
    cell.conveyor.remove_box('b1', *cell.clock())
    assert 'b1' not in cell.ids()
    cell.wait(30.0)
    item = cell.scan().boxes[0]
    assert (item.box.id, item.pose.quaternion) == ('b2', QUATERNIONS['xyz'])
