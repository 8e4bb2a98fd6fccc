"""Boxes come down in the middle of a gap, and slide into their place."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arm_executor.model.arm_interface import MotionHooks, PlaceRequest
from arm_executor.model.layout import Layout, bin_frame, pick_pose
from arm_executor.motion.path import positions, rounded, waypoint
from arm_executor.motion.slide_in import beside, slid_in
from arm_executor.motion.task import Site, StandingBox, make_task
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, extent, metres, turn_between
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

LAYOUT = Layout()
SIZE_MM = (300.0, 200.0, 150.0)
HALF = (0.15, 0.1)


def task_in(spec, centre, blocks=(), floor_m=0.0):
    """What is asked for a box with its middle over ``centre`` (x, y), and the bin's site."""
    taken = Box('box', SIZE_MM, 4.0)
    frame = bin_frame(LAYOUT, 'A', spec)
    standing = [
        StandingBox(f'{number}', *extent(frame.to_cell(Pose(middle)), size))
        for number, (middle, size) in enumerate(blocks)
    ]
    site = Site('A', spec, frame, standing)
    target = Pose((*centre, floor_m + SIZE_MM[2] / 2000))
    request = PlaceRequest(taken, pick_pose(LAYOUT, SIZE_MM), 'A', target)
    return site, make_task(request, site, LAYOUT)


def aside_in_bin(spec, centre, blocks=(), floor_m=0.0):
    """What :func:`beside` says, along the axes of the bin, mm."""
    site, task = task_in(spec, centre, blocks, floor_m)
    turn = site.frame.yaw
    x, y = beside(site, task)
    back = (math.cos(turn) * x + math.sin(turn) * y, -math.sin(turn) * x + math.cos(turn) * y)
    return pytest.approx(tuple(1000 * way for way in back), abs=0.01)


PALLET, CRATE, CAGE = parse_bin('PAL'), parse_bin('EQ'), parse_bin('RC')


def test_beside_one_neighbour_a_box_comes_down_away_from_it():
    left = ((0.2, 0.3, 0.2), (0.2, 0.4, 0.4))
    assert aside_in_bin(PALLET, (0.304 + HALF[0], 0.3), [left]) == (8.0, 0.0)


def test_between_two_neighbours_a_box_comes_down_in_the_middle():
    left, right = ((0.2, 0.3, 0.2), (0.2, 0.4, 0.4)), ((0.715, 0.3, 0.2), (0.2, 0.4, 0.4))
    assert aside_in_bin(PALLET, (0.304 + HALF[0], 0.3), [left, right]) == (3.5, 0.0)


def test_in_a_corner_of_two_walls_a_box_comes_down_away_from_both():
    assert aside_in_bin(CRATE, (HALF[0] + 0.002, HALF[1] + 0.004)) == (9.0, 8.0)


def test_what_is_lower_than_the_base_is_nothing_to_come_down_beside():
    under = ((0.2, 0.3, 0.1), (0.8, 0.5, 0.2))
    assert aside_in_bin(PALLET, (0.3, 0.3), [under], floor_m=0.2) == (0.0, 0.0)


def test_behind_an_open_front_a_box_keeps_to_its_way_in():
    assert aside_in_bin(CAGE, (HALF[0] + 0.002, HALF[1] + 0.002)) == (0.0, 0.0)


spans = st.tuples(*(st.floats(-0.35, 0.35) for _ in range(2)), *(st.floats(0.05, 0.3),) * 2)


@given(st.lists(spans, max_size=5))
def test_beside_its_place_a_box_stands_in_nothing_that_it_does_not_stand_in_there(blocks):
    middle = (0.6, 0.5)

    def apart(aside, span):
        x, y, length, breadth = span
        gaps = (abs(x - aside[0]) - length / 2 - HALF[0], abs(y - aside[1]) - breadth / 2 - HALF[1])
        return max(gaps) >= -1e-9

    free = [span for span in blocks if apart((0.0, 0.0), span)]
    standing = [
        ((middle[0] + x, middle[1] + y, 0.2), (length, breadth, 0.4))
        for x, y, length, breadth in free
    ]
    site, task = task_in(PALLET, middle, standing)
    turn = site.frame.yaw
    x, y = beside(site, task)
    aside = (math.cos(turn) * x + math.sin(turn) * y, -math.sin(turn) * x + math.cos(turn) * y)
    assert all(apart(aside, span) for span in free)
    assert max(abs(x), abs(y)) <= 0.010 + 1e-9


def test_a_way_that_slides_in_keeps_its_ends_and_comes_down_beside_the_last_one():
    points = [(0.0, 1.0, 0.6), (0.0, 1.0, 1.2), (0.9, -0.8, 1.2), (0.9, -0.8, 0.4)]
    way = rounded([waypoint(0.3, point, 0.0, 0.5) for point in points], 0.12, 0.015)
    moved = slid_in(way, (0.008, -0.006))
    before, after = positions(way), positions(moved)
    assert np.allclose(after[[0, -1]], before[[0, -1]])
    assert np.allclose(after[:, 2], before[:, 2])
    above = after[:, 2] > after[-1, 2] + 0.06
    coming = above & (np.arange(len(after)) > 0.9 * len(after))
    assert np.allclose((after - before)[coming, :2], (0.008, -0.006), atol=1e-4)
    steps = np.linalg.norm(np.diff(after, axis=0), axis=1)
    assert steps.max() < 0.03


@pytest.mark.physics
def test_a_box_that_lies_askew_unseen_is_not_torn_off_by_a_rim():
    pytest.importorskip('pybullet')
    pytest.importorskip('toppra')
    from arm_executor.arms.physics.arm import PhysicsArm
    from arm_executor.arms.true_boxes import TrueBox, Truth

    taken, truth = Box('box', (590.0, 200.0, 150.0), 5.0), Truth()
    pick = pick_pose(LAYOUT, taken.size_mm)
    half = math.radians(0.9) / 2
    askew = Pose(pick.position, (0.0, 0.0, math.sin(half), math.cos(half)))
    truth.update([TrueBox(replace(taken, size_mm=(592.0, 204.0, 150.0)), askew)])
    wall = Box('wall', (600.0, 100.0, 300.0), 20.0)
    spec = parse_bin('LDC')
    bins = [Bin('one', 1, spec, (PlacedBox(wall, (0, 0, 0), (600, 100, 300)),), 'A')]
    arm = PhysicsArm(LAYOUT, truth=truth)
    try:
        arm.set_bins(bins, {'wall': Pose((0.302, 0.052, 0.15))})
        target = Pose((0.302, 0.102 + 0.004 + 0.1, 0.075))
        request = PlaceRequest(taken, pick, 'A', target)
        hooks = MotionHooks(lambda *_: None, *(lambda: None,) * 3)
        result = arm.execute(arm.plan(request), hooks, threading.Event())
    finally:
        arm.close()
    assert result.code is ErrorCode.NONE, result.message
    assert result.others_moved_m < 0.008
    assert turn_between(result.measured, target) < math.radians(1.5)
    assert metres(taken.size_mm)[2] / 2 == pytest.approx(result.measured.position[2], abs=0.002)
