"""Poses of boxes: turns, corners, and how far apart two poses are."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.geometry.pose import (
    NO_TURN,
    Pose,
    about_z,
    conjugate,
    corner_distance,
    corners,
    extent,
    folded,
    metres,
    partial_turn,
    quaternion_product,
    rotated,
    rotation_matrix,
    stands_upright,
    turn_between,
    upright_axis,
    yaw_of,
)
from pack_msgs_py.orientation import ORIENTATIONS, QUATERNIONS, oriented_size

SIZE = (0.3, 0.2, 0.1)
lengths = st.floats(-2.0, 2.0)
vectors = st.tuples(lengths, lengths, lengths)


@st.composite
def quaternions(draw):
    parts = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
    return tuple(part / math.hypot(*parts) for part in parts)


poses = st.builds(Pose, vectors, quaternions())


def close(a, b):
    return a == pytest.approx(b, abs=1e-9)


@given(quaternions(), quaternions(), vectors)
def test_a_product_turns_first_by_the_second_factor(second, first, vector):
    both = rotated(quaternion_product(second, first), vector)
    assert close(both, rotated(second, rotated(first, vector)))


@given(quaternions(), vectors)
def test_the_conjugate_turns_back(turn, vector):
    assert close(rotated(conjugate(turn), rotated(turn, vector)), vector)


@given(quaternions())
def test_rows_of_a_rotation_matrix_are_orthonormal(turn):
    rows = rotation_matrix(turn)
    for i, row in enumerate(rows):
        for j, other in enumerate(rows):
            dot = sum(a * b for a, b in zip(row, other, strict=True))
            assert dot == pytest.approx(float(i == j), abs=1e-9)


@given(st.floats(-math.pi, math.pi))
def test_a_turn_about_the_vertical_has_its_yaw_and_stands_upright(yaw):
    assert yaw_of(about_z(yaw)) == pytest.approx(yaw)
    assert stands_upright(about_z(yaw))


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_only_orientations_with_z_up_stand_upright(orientation):
    assert stands_upright(QUATERNIONS[orientation]) == (orientation[2] == 'z')


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_the_extent_of_an_oriented_box_is_its_oriented_size(orientation):
    low, high = extent(Pose((1.0, 2.0, 3.0), QUATERNIONS[orientation]), SIZE)
    edges = tuple(b - a for a, b in zip(low, high, strict=True))
    assert edges == pytest.approx(oriented_size(SIZE, orientation))
    assert [(a + b) / 2 for a, b in zip(low, high, strict=True)] == pytest.approx([1.0, 2.0, 3.0])


@given(poses)
def test_corners_lie_half_a_diagonal_from_the_centre(pose):
    points = corners(pose, SIZE)
    assert len(points) == 8
    for point in points:
        assert math.dist(point, pose.position) == pytest.approx(math.hypot(*SIZE) / 2)


@given(poses, poses)
def test_distances_are_the_same_both_ways_and_none_from_a_pose_to_itself(first, second):
    assert corner_distance(first, second, SIZE) == corner_distance(second, first, SIZE)
    assert turn_between(first, second) == turn_between(second, first)
    assert corner_distance(first, first, SIZE) == 0.0


@given(poses, vectors)
def test_a_box_that_was_only_shifted_has_all_corners_as_far_away(pose, shift):
    moved = Pose(tuple(a + b for a, b in zip(pose.position, shift, strict=True)), pose.quaternion)
    assert corner_distance(pose, moved, SIZE) == pytest.approx(math.hypot(*shift), abs=1e-9)


def test_corner_distance_grows_with_the_box_when_it_is_turned():
    turned = Pose((0.0, 0.0, 0.0), about_z(0.01))
    small, large = (corner_distance(Pose(), turned, (s, s, s)) for s in (0.1, 1.0))
    assert large == pytest.approx(10 * small)
    assert turn_between(Pose(), turned) == pytest.approx(0.01)


@given(quaternions())
def test_a_quaternion_and_its_negative_are_the_same_turn(turn):
    negative = tuple(-part for part in turn)
    assert turn_between(Pose(quaternion=turn), Pose(quaternion=negative)) < 1e-6


@given(poses, poses)
def test_folding_never_lies_farther_off_and_fills_the_same_space(pose, near):
    nearest = folded(pose, near)
    assert turn_between(nearest, near) <= turn_between(pose, near)
    assert close(extent(nearest, SIZE)[0], extent(pose, SIZE)[0])
    assert close(extent(nearest, SIZE)[1], extent(pose, SIZE)[1])


def test_half_a_turn_is_folded_away():
    half_turned = Pose((0.1, 0.2, 0.3), (0.0, 0.0, 1.0, 0.0))
    assert turn_between(folded(half_turned, Pose()), Pose()) == pytest.approx(0.0)
    assert turn_between(half_turned, Pose()) == pytest.approx(math.pi)


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_half_a_turn_about_the_axis_that_is_up_is_folded_away(orientation):
    stands = Pose((0.1, 0.2, 0.3), QUATERNIONS[orientation])
    other_way = quaternion_product((0.0, 0.0, 1.0, 0.0), stands.quaternion)
    folded_away = folded(Pose(stands.position, other_way), stands)
    assert turn_between(folded_away, stands) == pytest.approx(0.0, abs=1e-6)


@given(st.sampled_from(ORIENTATIONS), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_parts_of_a_turn_add_up_to_it(orientation, share, rest):
    turn = QUATERNIONS[orientation]
    share, rest = min(share, rest), max(share, rest) - min(share, rest)
    both = quaternion_product(partial_turn(turn, rest), partial_turn(turn, share))
    assert (
        turn_between(Pose((0.0,) * 3, both), Pose((0.0,) * 3, partial_turn(turn, share + rest)))
        < 1e-6
    )
    assert partial_turn(turn, 1.0) == turn


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_the_axis_that_is_up_is_the_last_of_the_orientation(orientation):
    assert 'xyz'[upright_axis(QUATERNIONS[orientation])] == orientation[2]


def test_metres_are_thousandths_and_no_turn_is_the_default():
    assert metres((1200.0, 800.0, 1.0)) == (1.2, 0.8, 0.001)
    assert Pose().quaternion == NO_TURN
