"""The belt that brings: order, the shorter way, laps, arrival."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conveyor_sim.belt.indexing_belt import IndexingBelt
from pack_msgs_py.values import Box

SIZE = (300.0, 200.0, 100.0)


def full_belt(slots=5, length=9.0, **motion):
    belt = IndexingBelt(length, slots, **motion)
    for number in range(slots):
        box = Box(f'b{number}', SIZE)
        belt.put(box, belt.room_for(box, 0.0), 0.0)
    return belt


def ids(belt, now):
    return [item.box.id for item in belt.view(now)]


def find(belt, box_id, now):
    return next(item for item in belt.view(now) if item.box.id == box_id)


def test_boxes_stand_at_equal_pitch_and_are_seen_nearest_first():
    belt = full_belt()
    assert ids(belt, 0.0) == ['b0', 'b1', 'b2', 'b3', 'b4']
    places = sorted(item.s_m for item in belt.view(0.0))
    assert places == pytest.approx([0.0, 1.8, 3.6, 5.4, 7.2])
    distances = [item.distance_m for item in belt.view(0.0)]
    assert distances == sorted(distances)


@pytest.mark.parametrize(('box_id', 'way', 'sign'), [('b1', 1.8, -1), ('b2', 1.8, 1)])
def test_a_box_comes_the_shorter_way_round(box_id, way, sign):
    belt = full_belt()
    belt.bring(find(belt, box_id, 0.0).slot, 10.0)
    assert belt.next_change_s(10.0) == pytest.approx(10.0 + way / 1.5)
    assert belt.velocity(10.1)[1] == sign * 1.5
    item = find(belt, box_id, 12.0)
    assert (item.s_m, item.opens_s) == (0.0, pytest.approx(10.0 + way / 1.5))
    assert ids(belt, 12.0)[0] == box_id
    assert belt.velocity(12.0) == (0.0, 0.0, 0.0)


def test_nothing_can_be_picked_while_the_belt_moves():
    belt = full_belt()
    assert find(belt, 'b0', 0.0).opens_s is not None
    belt.bring(find(belt, 'b3', 0.0).slot, 5.0)
    for tenth in range(1, 23):
        assert all(item.opens_s is None for item in belt.view(5.0 + tenth / 10))


def test_where_the_belt_is_depends_on_the_time_alone_not_on_how_often_one_asks():
    watched, left_alone = full_belt(), full_belt()
    for belt in (watched, left_alone):
        belt.bring(4, 0.0)
    for step in range(100):
        watched.view(step / 100)
    for seen, unseen in zip(watched.view(1.0), left_alone.view(1.0), strict=True):
        assert seen.s_m == pytest.approx(unseen.s_m, abs=2e-4)
        assert seen.laps == unseen.laps


def test_travel_time_is_robot_time_from_the_last_pick_at_any_speed_factor():
    for speed in (0.0, 1.0, 7.0):
        belt = full_belt(speed=speed)
        wanted = {'b0': 0.0, 'b1': 1.2, 'b2': 1.2, 'b3': 2.4, 'b4': 2.4}
        belt.bring(find(belt, 'b3', 0.0).slot, 0.0)
        for now in (0.0, 0.1, 50.0):
            for item in belt.view(now):
                assert item.travel_time_s == pytest.approx(wanted[item.box.id])


def test_a_pick_sets_where_travel_times_count_from():
    belt = full_belt()
    slot = find(belt, 'b3', 0.0).slot
    belt.bring(slot, 0.0)
    belt.take(slot, 10.0, picked=True)
    belt.put(Box('new', SIZE), slot, 10.0)
    assert find(belt, 'new', 10.0).travel_time_s == 0.0
    assert find(belt, 'b0', 10.0).travel_time_s == pytest.approx(2.4)
    assert find(belt, 'new', 10.0).opens_s == 10.0


def test_the_speed_factor_scales_time_and_zero_arrives_at_once():
    quick = full_belt(speed=4.0)
    quick.bring(3, 0.0)
    assert quick.next_change_s(0.0) == pytest.approx(3.6 / 1.5 / 4.0)
    assert abs(quick.velocity(0.0)[1]) == pytest.approx(6.0)
    instant = full_belt(speed=0.0)
    instant.bring(3, 7.0)
    assert instant.next_change_s(7.0) is None
    assert instant.view(7.0)[0].slot == 3
    assert instant.view(7.0)[0].opens_s == 7.0


def test_speed_can_change_on_the_way():
    belt = full_belt()
    belt.bring(1, 0.0)
    belt.set_motion(0.6, belt_speed=0.9)
    assert find(belt, 'b1', 0.6).s_m == pytest.approx(0.9)
    assert belt.next_change_s(0.6) == pytest.approx(1.6)


def test_a_pause_holds_the_belt_where_it_is():
    belt = full_belt()
    belt.bring(1, 0.0)
    belt.set_motion(0.6, paused=True)
    assert find(belt, 'b1', 100.0).s_m == pytest.approx(0.9)
    assert belt.next_change_s(100.0) is None
    assert belt.velocity(100.0) == (0.0, 0.0, 0.0)
    assert find(belt, 'b1', 100.0).opens_s is None
    belt.set_motion(100.0, paused=False)
    assert belt.next_change_s(100.0) == pytest.approx(100.6)


def test_a_box_has_a_lap_more_each_time_that_another_one_is_picked():
    belt = full_belt()
    laps = lambda now: {item.box.id: item.laps for item in belt.view(now)}  # noqa: E731
    belt.bring(1, 0.0)
    assert set(laps(5.0).values()) == {0}, 'moving alone passes nobody over'
    picked = find(belt, 'b1', 5.0).slot
    assert belt.take(picked, 5.0, picked=True) == 0
    assert laps(5.0) == {'b0': 1, 'b2': 1, 'b3': 1, 'b4': 1}
    assert belt.take(find(belt, 'b2', 5.0).slot, 5.0, picked=False) == 1
    assert laps(5.0) == {'b0': 1, 'b3': 1, 'b4': 1}


def test_a_belt_goes_on_from_its_state():
    belt = full_belt()
    belt.bring(2, 0.0)
    state = belt.state(1.0)
    other = full_belt()
    other.restore(state, 500.0)
    assert other.next_change_s(500.0) == pytest.approx(500.0 + 3.6 / 1.5 - 1.0)
    assert other.view(510.0)[0].slot == 2


def test_a_taken_slot_cannot_be_filled():
    belt = full_belt()
    with pytest.raises(ValueError, match="'x'"):
        belt.put(Box('x', SIZE), 0, 0.0)


@pytest.mark.parametrize(
    ('size', 'word'),
    [((661, 100, 100), 'size x'), ((100, 1501, 100), 'size y'), ((100, 100, 501), 'size z')],
)
def test_what_cannot_ride_is_refused_with_the_edge(size, word):
    belt = IndexingBelt(9.0, 5)
    assert word in belt.refusal(Box('x', size))
    assert belt.refusal(Box('x', (660, 1500, 500))) == ''


@settings(max_examples=60, deadline=None)
@given(
    slots=st.integers(1, 6),
    length=st.floats(6.0, 40.0),
    speed=st.sampled_from([0.0, 0.5, 1.0, 20.0]),
    moves=st.lists(st.tuples(st.integers(0, 5), st.floats(0.0, 8.0)), max_size=12),
)
def test_any_moves_keep_all_boxes_and_end_at_the_pick_point(slots, length, speed, moves):
    belt = full_belt(slots, length, speed=speed)
    everyone = sorted(ids(belt, 0.0))
    now = 0.0
    for slot, wait in moves:
        belt.bring(slot % slots, now)
        arrival = belt.next_change_s(now)
        way = next(item for item in belt.view(now) if item.slot == slot % slots).distance_m
        if arrival is not None:
            assert arrival - now == pytest.approx(way / 1.5 / speed, abs=1e-5)
            assert way <= length / 2 + 1e-6
        now += wait
        view = belt.view(now)
        assert sorted(item.box.id for item in view) == everyone
        assert [item.distance_m for item in view] == sorted(item.distance_m for item in view)
        if arrival is None or arrival <= now - 1e-5:
            assert (view[0].slot, view[0].s_m) == (slot % slots, 0.0)
            assert view[0].opens_s is not None
            assert view[0].opens_s <= now
