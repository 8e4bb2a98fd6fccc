"""The loop: where its places are in the cell, and what fits on it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conveyor_sim.belt.loop import longest_along_m, loop_pose

SIZE = (300.0, 200.0, 100.0)


@pytest.mark.parametrize(
    ('s', 'front', 'base'),
    [
        (0.0, 0.55, 0.75),
        (2.0, 2.55, 0.75),
        (4.0, 4.55, 0.75),
        (4.25, 4.55, 0.5),
        (4.5, 4.55, 0.25),
        (6.5, 2.55, 0.25),
        (8.5, 0.55, 0.25),
        (8.75, 0.55, 0.5),
    ],
)
def test_poses_follow_the_loop(s, front, base):
    pose = loop_pose(s, 9.0, SIZE)
    assert pose.position == pytest.approx((0.0, front + 0.1, base + 0.05))
    assert pose.quaternion == (0.0, 0.0, 0.0, 1.0)


@given(s=st.floats(0.0, 8.999), length=st.floats(9.0, 30.0), step=st.floats(0.0, 0.001))
def test_poses_are_continuous_around_the_loop(s, length, step):
    here = loop_pose(s, length, SIZE).position
    there = loop_pose((s + step) % length, length, SIZE).position
    assert math.dist(here, there) <= step + 1e-9


def test_the_look_ahead_must_fit_on_the_belt():
    assert longest_along_m(9.0, 6, 0.3) == pytest.approx(1.2), 'the belt of the paper'
    with pytest.raises(ValueError, match='longer belt_length'):
        longest_along_m(6.0, 6, 0.9)
