"""The belt that runs all the time: the blade, its window, queues, laps, the induct."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conveyor_sim.belt.running_belt import GRACE_S, RunningBelt
from pack_msgs_py.values import Box

SIZE = (300.0, 200.0, 100.0)
GAP = 0.3


def feed(belt, now, *names, depth=200.0):
    """Lay the named boxes on, one after the other as there is room; returns the time then."""
    for name in names:
        box = Box(name, (300.0, depth, 100.0))
        while (slot := belt.room_for(box, now)) is None:
            now += 0.01
        belt.put(box, slot, now)
    return now


def ids(belt, now):
    return [item.box.id for item in belt.view(now)]


def find(belt, name, now):
    return next(item for item in belt.view(now) if item.box.id == name)


def test_boxes_enter_at_the_induct_with_the_gap_between_them_and_move_at_the_belts_speed():
    belt = RunningBelt(9.0, 5)
    now = feed(belt, 0.0, 'a', 'b', 'c')
    assert now == pytest.approx(2 * 0.5 / 1.5, abs=0.03)
    a, b = find(belt, 'a', now), find(belt, 'b', now)
    assert a.s_m == pytest.approx(4.0 - 1.5 * now)
    assert b.s_m - (a.s_m + 0.2) == pytest.approx(GAP, abs=0.02)
    assert belt.velocity(now) == (0.0, -1.5, 0.0)


def test_nobody_is_held_without_a_decision_and_every_pass_is_a_lap():
    belt = RunningBelt(9.0, 5)
    now = feed(belt, 0.0, 'a', 'b')
    for step in range(1, 200):
        at = now + step / 10
        assert not any(item.held for item in belt.view(at))
        assert all(item.opens_s > at for item in belt.view(at))
    assert find(belt, 'a', 0.0).laps == 1 + int((1.5 * at - 4.0) / 9.0)


def test_the_blade_holds_the_chosen_box_alone_and_says_until_when():
    belt = RunningBelt(9.0, 5, window_s=4.0)
    now = feed(belt, 0.0, 'a', 'b', 'c')
    belt.bring(find(belt, 'b', now).slot, now)
    expected = find(belt, 'b', now).opens_s
    item = find(belt, 'b', expected + 0.01)
    assert (item.held, item.s_m, item.laps) == (True, 0.0, 0)
    assert item.opens_s == pytest.approx(expected)
    assert item.closes_s == pytest.approx(expected + 4.0)
    assert find(belt, 'a', expected + 0.01).laps == 1


def test_those_behind_the_held_box_queue_up_with_the_gap_and_ride_on_in_order():
    belt = RunningBelt(9.0, 5, window_s=10.0)
    now = feed(belt, 0.0, 'a')
    now = feed(belt, now + 1.0, 'b', 'c')
    belt.bring(find(belt, 'a', now).slot, now)
    places = [item.s_m for item in belt.view(now + 8.0)]
    assert places == pytest.approx([0.0, 0.5, 1.0], abs=1e-6)
    belt.take(find(belt, 'a', now + 8.0).slot, now + 8.0, picked=True)
    assert ids(belt, now + 8.1) == ['b', 'c']
    assert [item.s_m for item in belt.view(now + 8.1)] == pytest.approx([0.35, 0.85])


def test_a_missed_window_is_another_lap_and_the_blade_rises_for_the_box_again():
    belt = RunningBelt(9.0, 5, window_s=4.0)
    now = feed(belt, 0.0, 'a')
    slot = find(belt, 'a', now).slot
    belt.bring(slot, now)
    opens = find(belt, 'a', now).opens_s
    assert find(belt, 'a', opens + 4.0).held, 'the blade drops a little later than it says'
    gone = opens + 4.0 + GRACE_S
    item = find(belt, 'a', gone + 0.01)
    assert (item.held, item.laps, belt.missed(), belt.missed()) == (False, 1, ['a'], [])
    assert item.opens_s == pytest.approx(gone + 6.0)
    assert find(belt, 'a', gone + 6.01).held


def test_a_decision_for_another_box_lets_the_held_one_go():
    belt = RunningBelt(9.0, 5)
    now = feed(belt, 0.0, 'a', 'b')
    belt.bring(find(belt, 'a', now).slot, now)
    belt.bring(find(belt, 'b', now + 2.5).slot, now + 2.5)
    assert belt.brings(find(belt, 'b', now + 2.5).slot)
    later = find(belt, 'b', now + 2.5).opens_s + 0.01
    assert (find(belt, 'b', later).held, find(belt, 'a', later).laps) == (True, 1)
    assert belt.missed() == []


def test_travel_time_counts_belt_time_from_the_last_pick_laps_and_queues_included():
    belt = RunningBelt(9.0, 5, speed=4.0)
    now = feed(belt, 0.0, 'a', 'b')
    belt.bring(find(belt, 'a', now).slot, now)
    at = find(belt, 'a', now).opens_s + 0.5
    belt.take(find(belt, 'a', at).slot, at, picked=True)
    # b stands in the queue, 0.5 m from the pick point.
    belt.bring(find(belt, 'b', at).slot, at)
    assert find(belt, 'b', at).travel_time_s == pytest.approx(0.5 / 1.5)
    assert find(belt, 'b', at + 1.0).travel_time_s == pytest.approx(0.5 / 1.5)


def test_a_pause_holds_everything_and_the_window_with_it():
    belt = RunningBelt(9.0, 5)
    now = feed(belt, 0.0, 'a', 'b')
    belt.bring(find(belt, 'a', now).slot, now)
    at = find(belt, 'a', now).opens_s + 1.0
    belt.set_motion(at, paused=True)
    left = find(belt, 'a', at).closes_s - at
    assert find(belt, 'a', at + 100.0).closes_s - (at + 100.0) == pytest.approx(left)
    assert find(belt, 'b', at + 100.0).opens_s is None
    assert belt.velocity(at + 100.0) == (0.0, 0.0, 0.0)
    belt.set_motion(at + 100.0, paused=False)
    assert not find(belt, 'a', at + 100.0 + left + 1.0).held


def test_at_speed_0_the_chosen_box_is_there_at_once_and_held_until_it_is_picked():
    belt = RunningBelt(9.0, 5, speed=0.0)
    now = feed(belt, 0.0, 'a', 'b', 'c', 'd', 'e')
    assert now == 0.0
    order = ids(belt, 0.0)
    belt.bring(find(belt, order[2], 0.0).slot, 7.0)
    item = find(belt, order[2], 1e6)
    assert (item.held, item.opens_s, item.closes_s) == (True, 7.0, None)
    assert [find(belt, box_id, 0.0).laps for box_id in order] == [1, 1, 0, 0, 0]


def test_a_box_that_comes_back_lies_at_the_blade_and_who_is_in_its_way_makes_room():
    belt = RunningBelt(9.0, 3)
    now = feed(belt, 0.0, 'a', 'b', 'c')
    slot = find(belt, 'a', now).slot
    belt.bring(slot, now)
    at = find(belt, 'a', now).opens_s + 1.0
    belt.take(slot, at, picked=True)
    belt.bring(find(belt, 'b', at).slot, at)
    later = feed(belt, at + 2.0, 'd')
    number, pushed = belt.put_back(Box('a', SIZE), slot, later, 3)
    assert [box.id for box, _ in pushed] == ['b']
    item = find(belt, 'a', later)
    assert (item.slot, item.held, item.s_m, item.laps) == (number, True, 0.0, 3)


def test_a_belt_goes_on_from_its_state_with_the_same_order_and_laps():
    belt = RunningBelt(9.0, 5)
    now = feed(belt, 0.0, 'a', 'b', 'c')
    belt.bring(find(belt, 'c', now).slot, now)
    now += 3.0
    other = RunningBelt(9.0, 5)
    other.restore(belt.state(now), 500.0)
    for item in belt.view(now):
        other.put(item.box, item.slot, 500.0, item.laps)
    assert [(i.box.id, i.s_m, i.laps) for i in other.view(500.0)] == [
        (i.box.id, i.s_m, i.laps) for i in belt.view(now)
    ]
    assert other.brings(find(belt, 'c', now).slot)


def apart(view, length):
    """Least free way between two neighbours on the loop."""
    spans = sorted((item.s_m % length, item.box.size_mm[1] / 1000.0) for item in view)
    pairs = zip(spans, [*spans[1:], (spans[0][0] + length, 0.0)], strict=True)
    return min(after[0] - (start + length) for (start, length), after in pairs)


@settings(max_examples=60, deadline=None)
@given(
    slots=st.integers(1, 6),
    speed=st.sampled_from([0.0, 0.5, 1.0, 20.0]),
    depths=st.lists(st.floats(60.0, 1100.0), min_size=12, max_size=12),
    steps=st.lists(
        st.tuples(
            st.sampled_from(['bring', 'pick', 'feed', 'wait']), st.integers(0, 5), st.floats(0, 9)
        ),
        max_size=25,
    ),
)
def test_whatever_happens_no_two_boxes_come_nearer_than_the_gap(slots, speed, depths, steps):
    belt = RunningBelt(9.0, slots, speed=speed)
    now, fed = 0.0, 0
    for kind, number, wait in steps:
        now += wait
        view = belt.view(now)
        if kind == 'feed' or not view:
            box = Box(f'b{fed}', (300.0, depths[fed % 12], 100.0))
            slot = belt.room_for(box, now)
            if slot is not None:
                belt.put(box, slot, now)
                fed += 1
        elif kind == 'bring':
            belt.bring(view[number % len(view)].slot, now)
        elif kind == 'pick' and view[0].held:
            belt.take(view[0].slot, now, picked=True)
            if number % 2:
                belt.put_back(view[0].box, view[0].slot, now, view[0].laps)
        view = belt.view(now)
        assert len({item.box.id for item in view}) == len(view) <= slots
        assert sum(item.held for item in view) <= 1
        if view:
            assert apart(view, 9.0) >= GAP - 1e-6
