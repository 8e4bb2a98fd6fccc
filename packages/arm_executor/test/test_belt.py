"""Waiting for a box at the pick point: windows ahead, open, half over, and closed."""

from __future__ import annotations

import threading
import time

import pytest

from arm_executor.goals.belt_view import BeltClock, BeltView
from arm_executor.goals.waiting import waiting_for
from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.codes import Phase
from pack_msgs_py.geometry.pose import Pose, partial_turn
from pack_msgs_py.orientation import QUATERNIONS, TIPPED
from pack_msgs_py.values import Box

BOX = Box('a', (300.0, 200.0, 100.0))


def scan(stamp_s, opens_s, closes_s):
    item = ScannedBox(BOX, Pose(), pick_open_s=opens_s, pick_close_s=closes_s)
    return Scan(sequence=1, stamp_s=stamp_s, boxes=(item,))


@pytest.mark.parametrize(
    ('now_s', 'opens_s', 'closes_s', 'taken'),
    [
        (100.0, None, None, False),
        (100.0, 90.0, None, True),
        (100.0, 103.0, 107.0, False),
        (100.0, 99.0, 103.0, True),
        (101.5, 99.0, 103.0, False),
        (104.0, 99.0, 103.0, False),
    ],
    ids=['unknown', 'held until picked', 'to come', 'open', 'half over', 'closed'],
)
def test_a_box_is_taken_in_the_first_half_of_its_window(now_s, opens_s, closes_s, taken):
    belt = BeltView(wall=lambda: now_s)
    belt.update(scan(100.0, opens_s, closes_s))
    scanned = belt.wait_presented('a', Pose(), 0.01, lambda: False)
    assert (scanned is not None) == taken
    assert belt.wait_presented('a', Pose(), 0.01, lambda: True) is None


def test_a_missed_window_is_waited_out_until_the_next():
    now_s = [105.0]
    belt = BeltView(wall=lambda: now_s[0])
    belt.update(scan(100.0, 99.0, 103.0))
    presented = []
    waiting = threading.Thread(
        target=lambda: presented.append(belt.wait_presented('a', Pose(), 20.0, lambda: False))
    )
    waiting.start()
    now_s[0] = 109.5
    belt.update(scan(109.2, 109.0, 113.0))
    waiting.join(20.0)
    assert presented[0].pick_open_s == 109.0


@pytest.mark.parametrize(
    ('turn', 'taken'),
    [(0.0, False), (0.5, False), (1.0, True)],
    ids=['not tipped yet', 'half way', 'tipped'],
)
def test_a_box_is_not_there_before_it_lies_as_the_goal_says(turn, taken):
    tipped = QUATERNIONS[TIPPED['y']]
    belt = BeltView(wall=lambda: 100.0)
    lies = Pose((0.0, 0.0, 0.0), partial_turn(tipped, turn))
    belt.update(Scan(1, 100.0, (ScannedBox(BOX, lies, pick_open_s=90.0),)))
    pick = Pose((0.0, 0.0, 0.0), tipped)
    assert (belt.wait_presented('a', pick, 0.01, lambda: False) is not None) == taken


@pytest.mark.parametrize(
    ('up', 'hidden_s', 'belt_s', 'tray_s'),
    [('z', 1.0, 1.4, 0.0), ('y', 1.0, 1.4, 1.5), ('x', 3.0, 0.0, 0.9), ('y', 9.0, 0.0, 0.0)],
)
def test_what_belt_and_tray_take_is_hidden_by_the_motion_before(up, hidden_s, belt_s, tray_s):
    pick = Pose((0.0, 0.0, 0.0), QUATERNIONS[TIPPED[up]])
    seen = Scan(1, 100.0, (ScannedBox(BOX, Pose(), travel_time_s=2.4),))
    waiting = waiting_for('a', pick, seen, hidden_s, 1.5)
    assert (waiting.belt_s, waiting.tray_s) == pytest.approx((belt_s, tray_s))


def test_nothing_hides_the_tray_before_the_first_pick():
    pick = Pose((0.0, 0.0, 0.0), QUATERNIONS[TIPPED['y']])
    assert waiting_for('a', pick, None, None, 1.5).tray_s == 1.5


def test_a_box_that_has_left_the_belt_is_not_waited_for():
    belt = BeltView()
    belt.update(Scan(1, time.time(), (ScannedBox(BOX, Pose()),)))
    presented = []
    waiting = threading.Thread(
        target=lambda: presented.append(belt.wait_presented('a', Pose(), 20.0, lambda: False))
    )
    waiting.start()
    belt.update(Scan(2, time.time(), ()))
    waiting.join(5.0)
    assert presented == [None]


@pytest.mark.parametrize(('speed', 'expected_s'), [(1.0, 3.5), (8.0, 7.0), (0.5, 3.25), (0.0, 3.2)])
def test_the_belt_has_robot_time_alone_whatever_the_speed(speed, expected_s):
    now = [100.0]
    clock = BeltClock(speed, lambda: now[0])
    assert clock.elapsed_s() is None
    split = {Phase.APPROACHING: 1.0, Phase.TRANSFERRING: 2.0, Phase.LOWERING: 1.0}
    clock.motion_ended(split)
    now[0] += 0.5
    assert clock.elapsed_s(planning_s=0.2) == pytest.approx(expected_s)
