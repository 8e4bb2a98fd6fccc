"""Orientations, their quaternions, and which of them a rule allows."""

import math

import pytest

from pack_msgs_py.orientation import (
    ORIENTATIONS,
    QUATERNIONS,
    allowed_orientations,
    oriented_size,
)
from pack_msgs_py.values import UP_NEG_Z, UP_POS_Z, Box


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
