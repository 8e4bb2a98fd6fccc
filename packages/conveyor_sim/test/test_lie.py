"""Boxes that lie off-centre and turned on the belt: the scan shows how, and so they lie."""

from __future__ import annotations

import math

import pytest
from conveyor_rig import ConveyorRig
from hypothesis import given
from hypothesis import strategies as st

from conveyor_sim.belt.loop import PICK_Y_M
from conveyor_sim.scanning.lie import BoxLies, Lie
from pack_msgs_py.geometry.pose import Pose, extent, metres, turn_between
from pack_msgs_py.picking import turn_from

SIZE_MM = (400.0, 250.0, 150.0)


@given(st.floats(-0.1, 0.1), st.floats(0.0, 0.1), st.floats(-0.7, 0.7))
def test_a_turned_box_touches_the_guide_with_its_nearest_corner(aside, short, yaw):
    straight = Pose((0.0, 0.675, 0.825))
    pose = Lie(aside, short, yaw).of(straight, SIZE_MM)
    assert turn_from(pose, straight) == pytest.approx(yaw, abs=1e-9)
    assert pose.position[0] == aside and pose.position[2] == 0.825
    front = extent(pose, metres(SIZE_MM))[0][1]
    assert front == pytest.approx(0.55 + short)


def test_lies_are_drawn_within_what_is_asked_for_and_the_same_again():
    lies = [BoxLies(30.0, 8.0, seed=3).of(number, 1) for number in range(300)]
    assert lies == [BoxLies(30.0, 8.0, seed=3).of(number, 1) for number in range(300)]
    assert 0.025 < max(abs(lie.aside_m) for lie in lies) <= 0.030
    assert 0.025 < max(lie.short_m for lie in lies) <= 0.030 and min(x.short_m for x in lies) >= 0.0
    assert math.radians(7.0) < max(abs(lie.yaw_rad) for lie in lies) <= math.radians(8.0)
    assert BoxLies().of(5, 1) == Lie() and BoxLies().key == ''


def test_the_scan_says_how_a_box_really_lies_at_the_pick_point():
    cell = ConveyorRig(pose_noise=40.0, yaw_noise=12.0, seed=4)
    cell.decide('b1')
    cell.wait()
    held = next(item for item in cell.scan().boxes if item.box.id == 'b1')
    true = next(item for item in cell.conveyor.true_boxes(cell.now) if item.box.id == 'b1')
    assert held.pick_open_s is not None
    assert held.pose.position == pytest.approx(true.pose.position)
    assert turn_between(held.pose, true.pose) == pytest.approx(0.0, abs=1e-6)
    assert turn_from(held.pose, Pose()) != 0.0 and held.pose.position[0] != 0.0
    assert extent(held.pose, metres(held.box.size_mm))[0][1] > PICK_Y_M
