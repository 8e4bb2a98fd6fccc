"""Orientations, their quaternions, and which of them a rule allows."""

import math

import pytest

from pack_msgs_py.geometry.pose import conjugate, quaternion_product, stands_upright
from pack_msgs_py.orientation import (
    ORIENTATIONS,
    QUATERNIONS,
    TIPPED,
    UPRIGHT_OR_TIPPED,
    allowed_orientations,
    at_pick,
    oriented_size,
    tray_refusal,
)
from pack_msgs_py.values import (
    UP_NEG_X,
    UP_NEG_Y,
    UP_NEG_Z,
    UP_POS_X,
    UP_POS_Y,
    UP_POS_Z,
    Box,
)


def rotate(quaternion, vector):
    """``vector`` turned by the unit ``quaternion`` (x, y, z, w)."""
    x, y, z, w = quaternion
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return tuple(sum(row[k] * vector[k] for k in range(3)) for row in rows)


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_each_quaternion_turns_the_box_axes_onto_the_named_bin_axes(orientation):
    quaternion = QUATERNIONS[orientation]
    assert math.hypot(*quaternion) == pytest.approx(1.0)
    for bin_axis, box_axis in enumerate(orientation):
        unit = [0.0, 0.0, 0.0]
        unit['xyz'.index(box_axis)] = 1.0
        assert abs(rotate(quaternion, unit)[bin_axis]) == pytest.approx(1.0)


def test_any_rule_allows_six_orientations_of_a_box_with_three_edges():
    assert len(allowed_orientations(Box('b', (300, 200, 100)), 'any')) == 6


def test_a_cube_has_one_orientation():
    assert len(allowed_orientations(Box('b', (100, 100, 100)), 'any')) == 1


def test_the_lab_rule_never_stands_a_box_on_end():
    box = Box('b', (300, 200, 100))
    heights = {
        oriented_size(box.size_mm, o)[2] for o in allowed_orientations(box, 'largest_not_vertical')
    }
    assert heights == {100, 200}


def test_the_lab_rule_lets_a_box_with_two_largest_edges_stand_on_one():
    box = Box('b', (300, 300, 100))
    heights = {
        oriented_size(box.size_mm, o)[2] for o in allowed_orientations(box, 'largest_not_vertical')
    }
    assert heights == {100, 300}


def test_upright_turns_about_the_vertical_only():
    assert set(allowed_orientations(Box('b', (300, 200, 100)), 'upright')) == {'xyz', 'yxz'}


def test_a_box_that_must_stay_up_overrides_the_rule():
    box = Box('b', (300, 200, 100), allowed_up=UP_POS_Z | UP_NEG_Z)
    assert set(allowed_orientations(box, 'any')) == {'xyz', 'yxz'}


@pytest.mark.parametrize('orientation', ['xzy', 'zxy'])
def test_of_the_faces_along_y_the_front_comes_up(orientation):
    assert rotate(QUATERNIONS[orientation], (0.0, -1.0, 0.0)) == pytest.approx((0.0, 0.0, 1.0))


def test_an_arm_brings_up_top_and_front_but_no_end():
    allowed = allowed_orientations(Box('b', (300, 200, 150)), 'upright_or_front_up')
    assert set(allowed) == {'xyz', 'yxz', 'xzy', 'zxy'}


@pytest.mark.parametrize(
    'box',
    [
        Box('b', (300, 200, 90)),
        Box('b', (90, 200, 150)),
        Box('b', (300, 200, 150), 9.5),
        Box('b', (300, 200, 150), allowed_up=UP_POS_Z | UP_POS_Y),
    ],
    ids=['front too low', 'front too narrow', 'too heavy to hold by its front', 'back up only'],
)
def test_a_front_that_the_pad_cannot_hold_or_may_not_come_up_is_no_option(box):
    assert set(allowed_orientations(box, 'upright_or_front_up')) == {'xyz', 'yxz'}


def test_a_front_that_may_come_up_is_an_option():
    box = Box('b', (300, 200, 150), 8.5, allowed_up=UP_POS_Z | UP_NEG_Y)
    assert 'xzy' in allowed_orientations(box, 'upright_or_front_up')


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_a_tipped_box_needs_no_turn_but_about_the_vertical(orientation):
    tip = QUATERNIONS[at_pick(orientation, UPRIGHT_OR_TIPPED)]
    assert stands_upright(quaternion_product(QUATERNIONS[orientation], conjugate(tip)))


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_without_a_tray_a_box_lies_at_the_pick_point_as_on_the_belt(orientation):
    assert at_pick(orientation, 'upright_or_front_up') == 'xyz'


def test_a_tray_brings_up_front_and_left_end():
    assert len(allowed_orientations(Box('b', (300, 200, 150)), UPRIGHT_OR_TIPPED)) == 6
    assert rotate(QUATERNIONS[TIPPED['x']], (-1.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ('size_mm', 'allowed_up', 'refused'),
    [
        ((300, 200, 150), UP_POS_Z | UP_POS_X | UP_POS_Y, 'xy'),
        ((300, 200, 150), UP_POS_Z | UP_NEG_X, 'y'),
        ((300, 200, 150), UP_POS_Z | UP_NEG_Y, 'x'),
        ((620, 200, 100), UP_POS_Z | UP_NEG_X | UP_NEG_Y, 'x'),
        ((300, 700, 150), UP_POS_Z | UP_NEG_X | UP_NEG_Y, 'xy'),
        ((450, 200, 400), UP_POS_Z | UP_NEG_X | UP_NEG_Y, 'x'),
        ((300, 200, 49), UP_POS_Z | UP_NEG_X | UP_NEG_Y, 'xy'),
    ],
    ids=[
        'other faces up only',
        'left end',
        'front',
        'too high',
        'too long',
        'swings too high',
        'thin',
    ],
)
def test_what_the_tray_cannot_bring_up_is_no_option(size_mm, allowed_up, refused):
    box = Box('b', size_mm, allowed_up=allowed_up)
    assert ''.join(axis for axis in 'xy' if tray_refusal(box, axis)) == refused
    up = {name[2] for name in allowed_orientations(box, UPRIGHT_OR_TIPPED)}
    assert up == {'z', *'xy'} - set(refused)
