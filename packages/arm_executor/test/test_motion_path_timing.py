"""Paths keep to their corners, and timing keeps to every limit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip('toppra')
pytest.importorskip('pinocchio')

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import find_robot
from arm_executor.model.suction import holding_limits, tool_acceleration_limit
from arm_executor.motion.path import joint_path, positions, rounded, starting_at, waypoint
from arm_executor.motion.timing import Load, MotionLimits, Timing, joined
from arm_executor.motion.way_back import reversed_path

ARM, LAYOUT = find_robot('ur20'), Layout()
CELL = CellKinematics(ARM, LAYOUT)
FRONT = math.pi / 2


def swing(x=-1.0, z=0.4, rail=-0.5, corner=0.15):
    grip = waypoint(0.0, (0.0, 0.7, 1.0), 0.0, FRONT)
    place = waypoint(rail, (x, 0.9, z), FRONT, FRONT)
    high = [(*point[:3], 1.4, point[4]) for point in (grip, place)]
    return rounded([grip, *high, place], corner, 0.015)


@pytest.fixture(scope='module')
def timing():
    return Timing(ARM, LAYOUT, MotionLimits())


def test_path_starts_and_ends_where_it_should_in_small_steps():
    samples = swing()
    pads = positions(samples)
    assert pads[0] == pytest.approx((0.0, 0.7, 1.0))
    assert pads[-1] == pytest.approx((-1.0, 0.9, 0.4))
    assert np.linalg.norm(np.diff(pads, axis=0), axis=1).max() < 0.025


@given(down=st.floats(0.001, 0.6), aside=st.floats(-0.1, 0.1), corner=st.floats(0.05, 0.3))
def test_a_leg_shorter_than_its_round_ends_where_it_should(down, aside, corner):
    hover = waypoint(0.0, (0.0, 0.75, 1.3), 0.0, FRONT)
    grip = waypoint(0.0, (0.0, 0.75 + aside, 1.3 - down), 0.0, FRONT)
    above = (*grip[:3], hover[3], grip[4])
    pads = positions(rounded([hover, above, grip], corner, 0.015))
    assert pads[0] == pytest.approx((0.0, 0.75, 1.3))
    assert pads[-1] == pytest.approx((0.0, 0.75 + aside, 1.3 - down))


def test_way_into_the_bin_is_straight_down():
    pads = positions(swing(z=0.3))
    deep = pads[pads[:, 2] < 1.2]
    deep = deep[deep[:, 0] < -0.5]
    assert np.hypot(deep[:, 0] + 1.0, deep[:, 1] - 0.9).max() < 1e-6


def test_short_piece_does_not_sharpen_the_other_corners():
    bend = np.diff(swing(), n=2, axis=0)
    grip = waypoint(0.0, (0.0, 0.7, 1.0), 0.0, FRONT)
    stub = (*grip[:3], 1.005, grip[4])
    place = waypoint(-0.5, (-1.0, 0.9, 0.4), FRONT, FRONT)
    high = [(*point[:3], 1.4, point[4]) for point in (grip, place)]
    with_stub = np.diff(rounded([grip, stub, *high, place], 0.15, 0.015), n=2, axis=0)
    assert np.abs(with_stub).max() < 2 * np.abs(bend).max()


def test_joint_path_continues_from_a_wound_up_joint():
    path = joint_path(CELL, swing(), 0)
    wound = path.q[0] + np.array([0, 0, 0, 0, 0, 0, -2 * math.pi])
    shifted = starting_at(path, wound)
    assert shifted is not None
    assert shifted.q[0] == pytest.approx(wound)


def test_path_beyond_a_joint_limit_is_refused():
    path = joint_path(CELL, swing(), 0)
    assert starting_at(path, path.q[0] + np.array([0, 0, 0, 0, 0, 0, 4 * math.pi])) is None


def test_path_that_starts_elsewhere_is_refused():
    path = joint_path(CELL, swing(), 0)
    assert starting_at(path, path.q[0] + 0.5) is None


def test_out_of_reach_has_no_joint_path():
    assert joint_path(CELL, swing(x=-4.0), 0) is None


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(-1.4, -0.6),
    z=st.floats(0.25, 0.9),
    rail=st.floats(-0.9, 0.0),
    mass=st.floats(0.2, 20.0),
    corner=st.sampled_from([0.06, 0.15]),
)
def test_no_sample_passes_a_limit(timing, x, z, rail, mass, corner):
    path = joint_path(CELL, swing(x, z, rail, corner), 0)
    if path is None:
        return
    load = Load(mass, (0.4, 0.3, 0.25))
    timed = timing.trajectory(path.q, load, 1 / 240)
    if timed is None:
        assert mass > 12, 'the arm can hold a light box anywhere on this path'
        return
    assert (np.abs(timed.qd) <= timing.max_speed * 1.01).all()
    assert (np.abs(timed.qdd) <= timing.max_acceleration * 1.03).all()
    assert (np.abs(timing.torque(timed, load)) <= timing.max_torque * 1.03).all()
    assert np.abs(timed.qd[[0, -1]]).max() < 0.05
    assert timed.q[0] == pytest.approx(path.q[0], abs=1e-6)
    assert timed.q[-1] == pytest.approx(path.q[-1], abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(x=st.floats(-1.4, -0.6), mass=st.floats(0.2, 12.0), jerk=st.sampled_from([150.0, 500.0]))
def test_jerk_keeps_to_its_limit_and_the_motion_to_its_path(timing, x, mass, jerk):
    path = joint_path(CELL, swing(x), 0)
    load = Load(mass, (0.4, 0.3, 0.25))
    smooth = Timing(ARM, LAYOUT, MotionLimits(joint_jerk=jerk))
    gentle, fast = (one.trajectory(path.q, load, 1 / 240) for one in (smooth, timing))
    most = smooth.max_acceleration * jerk / 5.0
    assert most[1:] == pytest.approx(jerk * np.array([1, 1, 1, 2, 2, 2]))
    whole = np.vstack([np.zeros((1, 7)), gentle.qdd, np.zeros((1, 7))])
    assert (np.abs(np.diff(whole, axis=0)) * 240 <= most * 1.15).all()
    assert (np.abs(gentle.qdd) <= smooth.max_acceleration * 1.03).all()
    # Both are found on grids of their own: 0.1 % may lie between equal ones.
    assert 0.99 * fast.duration < gentle.duration < 1.5 * fast.duration
    assert gentle.q[[0, -1]] == pytest.approx(path.q[[0, -1]], abs=1e-6)
    nearest = np.abs(gentle.q[:, None] - fast.q[None]).max(axis=2).min(axis=1)
    assert nearest.max() < 0.02


def test_carried_box_is_accelerated_gently(timing):
    path = joint_path(CELL, swing(), 0)
    timed = timing.trajectory(path.q, Load(2.0, (0.3, 0.3, 0.3)), 1 / 240)
    pads = CELL.tool(timed.q)[:, :3, 3]
    acceleration = np.diff(pads, n=2, axis=0) * 240**2
    # The polygon of directions lets 8 % through between two of them.
    assert np.linalg.norm(acceleration, axis=1)[2:-2].max() < 5.0 * math.sqrt(2) * 1.1
    assert np.percentile(np.linalg.norm(acceleration, axis=1), 90) < 5.0 * 1.08 * 1.03


def test_heavy_box_is_carried_within_what_the_pad_holds_with_its_reserve(timing):
    load = Load(18.0, (0.5, 0.4, 0.35))
    path = joint_path(CELL, swing(), 0)
    timed = timing.trajectory(path.q, load, 1 / 240)
    pads = CELL.tool(timed.q)[:, :3, 3]
    acceleration = np.diff(pads, n=2, axis=0)[2:-2] * 240**2
    level, up = np.hypot(*acceleration.T[:2]), acceleration[:, 2]
    bare = replace(LAYOUT.tool, safety=1.0)
    for tool, part, most in ((LAYOUT.tool, 95, 1.1), (bare, 100, 1.0)):
        for share, rise, limit in holding_limits(tool, load.mass, load.size, (0.0, 0.0, 0.0)):
            used = (share * level + rise * up) / limit
            # Round a corner a little more gets through, between two points of the timing.
            assert np.percentile(used, part) < most
    # One limit for both at once would be less than what it is lifted with.
    assert up.max() > 1.2 * tool_acceleration_limit(LAYOUT.tool, 18.0, load.size, (0, 0, 0))


def test_heavy_box_takes_longer_than_a_light_one(timing):
    path = joint_path(CELL, swing(x=-0.9, z=0.6, rail=0.0), 0)
    light, heavy = (timing.trajectory(path.q, Load(m, (0.3,) * 3), 0.01) for m in (0.5, 20.0))
    assert heavy.duration > light.duration


def test_samples_are_positions_speeds_and_accelerations_of_one_motion(timing):
    path = joint_path(CELL, swing(), 0)
    timed = timing.trajectory(path.q, None, 1 / 240)
    middle = (timed.q[2:-1] - timed.q[:-3]) * 120
    assert np.abs(middle - timed.qd[1:-2]).max() < 0.03


def test_joined_trajectories_follow_each_other_in_time(timing):
    path = joint_path(CELL, swing(), 0)
    there = timing.trajectory(path.q, None, 0.01)
    both = joined([there, timing.trajectory(path.q[::-1], None, 0.01)])
    assert (np.diff(both.times) > 0).all()
    assert both.duration == pytest.approx(2 * there.duration, rel=0.1)
    assert both.q[-1] == pytest.approx(there.q[0], abs=1e-6)


def test_way_back_leads_from_here_to_just_above_the_start():
    path = joint_path(CELL, swing(), 0)
    here = (path.q[40] + path.q[41]) / 2
    back = reversed_path(path, here)
    assert back[0] == pytest.approx(here)
    end, start = CELL.tool(np.vstack([back[-1], path.q[0]]))[:, :3, 3]
    assert end - start == pytest.approx([0.0, 0.0, 0.001], abs=1e-4)
    assert len(back) <= 43
