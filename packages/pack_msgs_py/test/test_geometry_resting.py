"""Where a box comes to rest, and what it covers there."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.geometry.footprint import measured_footprint, planned_footprint, true_size
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import (
    measured_top_mm,
    rest_height_mm,
    resting_pose,
    with_measured,
    with_poses,
)
from pack_msgs_py.values import Box, PlacedBox


def placed(name, size, corner, reserved=None, measured=None, orientation='xyz'):
    reserved = reserved or tuple(int(edge) for edge in size)
    return PlacedBox(Box(name, size), corner, reserved, orientation, measured)


#: Reserved 300 x 200 x 100, in truth a little smaller, and measured where it stands.
LOW = placed('low', (296.0, 196.0, 97.0), (0, 0, 0), (300, 200, 100), (150.0, 100.0, 48.5))
TOP = placed('top', (196.0, 196.0, 100.0), (0, 0, 100), (200, 200, 100))


def test_a_footprint_is_what_was_reserved_or_what_the_box_covers():
    assert planned_footprint(LOW) == (0, 0, 300, 200)
    assert measured_footprint(LOW) == (2.0, 2.0, 298.0, 198.0)
    assert measured_footprint(replace(LOW, measured_mm=None)) == measured_footprint(LOW)
    turned = placed('t', (300.0, 200.0, 100.0), (0, 0, 0), (200, 300, 100), orientation='yxz')
    assert true_size(turned) == (200.0, 300.0, 100.0)
    assert measured_footprint(turned) == (0.0, 0.0, 200.0, 300.0)


def test_the_top_is_where_it_was_measured_else_where_it_was_planned():
    assert measured_top_mm(LOW) == 97.0
    assert measured_top_mm(replace(LOW, measured_mm=None)) == 100.0


def test_on_the_floor_nothing_else_counts():
    assert rest_height_mm(replace(TOP, corner_mm=(0, 0, 0)), [LOW]) == 0.0


def test_a_box_rests_on_the_measured_top_below_not_on_the_planned_one():
    assert rest_height_mm(TOP, [LOW]) == 97.0
    assert rest_height_mm(TOP, [replace(LOW, measured_mm=None)]) == 100.0


def test_a_strip_that_only_reservations_share_carries_nothing():
    """The beside box is higher, and reserved 10 mm under the placed one, but ends before it."""
    beside = placed(
        'beside', (180.0, 196.0, 99.0), (190, 0, 0), (190, 200, 100), (300.0, 100.0, 49.5)
    )
    under = placed('under', (186.0, 196.0, 97.0), (0, 0, 0), (190, 200, 100), (95.0, 100.0, 48.5))
    assert rest_height_mm(TOP, [under, beside]) == 97.0


def test_a_box_pushed_from_under_its_reservation_carries_nothing_either():
    away = replace(LOW, measured_mm=(600.0, 100.0, 48.5))
    assert rest_height_mm(TOP, [away]) == 100.0


def test_what_was_planned_above_the_base_is_no_support():
    tall = replace(LOW, size_mm=(300, 200, 150))
    assert rest_height_mm(TOP, [tall]) == 100.0


def test_a_box_that_is_let_go_elsewhere_rests_on_what_is_there():
    step = placed('step', (100.0, 196.0, 98.0), (300, 0, 0), (100, 200, 100), (350.0, 100.0, 49.0))
    wide = replace(TOP, size_mm=(310, 200, 100))
    assert rest_height_mm(wide, [LOW, step]) == 97.0
    shifted = resting_pose(wide, Pose((0.21, 0.1, 0.0)), [LOW, step])
    assert shifted.position == pytest.approx((0.21, 0.1, 0.148))


def test_the_resting_pose_keeps_the_target_but_for_its_height():
    target = Pose((0.1, 0.1, 0.155), (0.0, 0.0, 0.6, 0.8))
    rest = resting_pose(TOP, target, [LOW])
    assert rest.position == pytest.approx((0.1, 0.1, 0.147))
    assert rest.quaternion == target.quaternion


def test_poses_of_the_book_become_measured_centres():
    poses = {'low': Pose((0.15, 0.1, 0.0485))}
    [measured] = with_poses([replace(LOW, measured_mm=None)], poses)
    assert measured == LOW == with_measured(LOW, poses['low'])


heights = st.lists(st.floats(50.0, 140.0), min_size=1, max_size=6)


@given(heights, st.randoms(use_true_random=False))
def test_it_rests_on_the_highest_of_all_that_is_under_it_in_whatever_order(tops, order):
    boxes = [
        placed(
            f'b{i}',
            (100.0, 100.0, top),
            (100 * i, 0, 0),
            (100, 100, 100),
            (50.0 + 100 * i, 50.0, top / 2),
        )
        for i, top in enumerate(tops)
    ]
    long = placed('long', (100.0 * len(tops), 100.0, 50.0), (0, 0, 100))
    order.shuffle(boxes)
    assert rest_height_mm(long, boxes) == pytest.approx(max(tops))
