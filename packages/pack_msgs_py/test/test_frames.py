"""Frames: the way from one to another, by static and moving transforms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.geometry.frames import (
    HISTORY_S,
    FrameTree,
    UnknownTransform,
    between,
    composed,
    inverse,
)
from pack_msgs_py.geometry.pose import Pose, about_z, turn_between

EDGE = st.floats(-5.0, 5.0)


@st.composite
def poses(draw):
    parts = [draw(st.floats(-1.0, 1.0)) for _ in range(4)]
    length = math.hypot(*parts)
    turn = tuple(part / length for part in parts) if length > 0.1 else (0.0, 0.0, 0.0, 1.0)
    return Pose((draw(EDGE), draw(EDGE), draw(EDGE)), turn)


def same(one, other):
    return one.position == pytest.approx(other.position, abs=1e-9) and (
        turn_between(one, other) == pytest.approx(0.0, abs=1e-6)
    )


@given(poses(), poses(), poses())
def test_the_way_through_a_common_ancestor_is_the_way_there_and_back(camera, cell, box):
    tree = FrameTree()
    tree.add('camera', 'hall', camera, 0.0, is_static=True)
    tree.add('cell', 'hall', cell, 0.0, is_static=True)
    there = tree.pose_of('camera', 'cell', 12.0)
    assert same(composed(cell, composed(there, box)), composed(camera, box))
    assert same(composed(there, tree.pose_of('cell', 'camera', 12.0)), Pose())
    assert same(composed(inverse(box), box), Pose())


def test_a_moving_frame_is_where_it_was_at_the_time_of_the_scan():
    tree = FrameTree()
    for step in range(30):
        pose = Pose((0.1 * step, 0.0, 0.0), about_z(0.1 * step))
        tree.add('wrist', 'cell', pose, 100.0 + 0.1 * step, is_static=False)
    pose = tree.pose_of('wrist', 'cell', 101.25)
    assert pose.position[0] == pytest.approx(1.25)
    assert turn_between(pose, Pose((0, 0, 0), about_z(1.25))) == pytest.approx(0.0, abs=1e-6)
    assert tree.pose_of('wrist', 'cell', 103.5).position[0] == pytest.approx(2.9), 'a little late'
    with pytest.raises(UnknownTransform, match=r'asked for at 105\.000 s'):
        tree.pose_of('wrist', 'cell', 105.0)
    tree.add('wrist', 'cell', Pose(), 102.9 + HISTORY_S, is_static=False)
    with pytest.raises(UnknownTransform, match=r'asked for at 101\.250 s'):
        tree.pose_of('wrist', 'cell', 101.25)


def test_the_shorter_way_round_is_taken_between_two_turns():
    half = between(Pose((0, 0, 0), about_z(3.0)), Pose((0, 0, 0), about_z(-3.0)), 0.5)
    assert turn_between(half, Pose((0, 0, 0), about_z(math.pi))) == pytest.approx(0.0, abs=1e-6)


def test_what_is_not_connected_is_named_with_what_to_do():
    tree = FrameTree()
    tree.add('bin_a', 'cell', Pose(), 0.0, is_static=True)
    with pytest.raises(UnknownTransform, match=r'known are bin_a, cell: .*static_transform_publ'):
        tree.pose_of('camera', 'cell', 1.0)
    with pytest.raises(UnknownTransform, match='no frames at all'):
        FrameTree().pose_of('camera', 'cell', 1.0)


def test_a_circle_of_frames_ends():
    tree = FrameTree()
    tree.add('a', 'b', Pose(), 0.0, is_static=True)
    tree.add('b', 'a', Pose(), 0.0, is_static=True)
    with pytest.raises(UnknownTransform, match='circle'):
        tree.pose_of('a', 'cell', 1.0)
