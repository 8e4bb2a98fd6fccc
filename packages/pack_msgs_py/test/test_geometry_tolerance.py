"""What counts as placed."""

from __future__ import annotations

import math

import pytest

from pack_msgs_py.geometry.pose import Pose, about_z
from pack_msgs_py.geometry.tolerance import Tolerance

SIZE = (0.3, 0.2, 0.1)
TOLERANCE = Tolerance(0.005, math.radians(2.0), 0.003)


def out_of_place(measured):
    return TOLERANCE.out_of_place('box-1', SIZE, Pose(), measured)


def test_a_box_within_both_limits_is_in_place():
    assert out_of_place(Pose((0.003, 0.002, 0.001))) == ''
    assert out_of_place(Pose(quaternion=about_z(math.radians(1.0)))) == ''


def test_a_box_too_far_off_is_named_with_the_distance_and_what_is_allowed():
    text = out_of_place(Pose((0.006, 0.0, 0.0)))
    assert "box 'box-1' rests 6.0 mm and 0.0 degrees away" in text
    assert '5 mm and 2 degrees are allowed' in text


def test_a_small_box_may_be_turned_too_far_though_no_corner_is():
    turned = Pose(quaternion=about_z(math.radians(3.0)))
    assert TOLERANCE.out_of_place('b', (0.05, 0.05, 0.05), Pose(), turned)


def test_a_long_box_may_have_a_corner_too_far_off_though_it_is_hardly_turned():
    turned = Pose(quaternion=about_z(math.radians(1.0)))
    assert TOLERANCE.out_of_place('b', (1.2, 0.2, 0.1), Pose(), turned)


@pytest.mark.parametrize(('moved', 'wrong'), [(0.0, False), (0.003, False), (0.0031, True)])
def test_another_box_may_move_by_the_tolerance_and_no_more(moved, wrong):
    text = TOLERANCE.others_disturbed('box-1', moved)
    assert bool(text) == wrong
    assert not wrong or 'moved another box of its bin by 3.1 mm, 3 mm are allowed' in text
