"""A stop is as fast as the load bears, and leaves the path no more than the motion would."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('toppra')

from hypothesis import example, given, settings
from hypothesis import strategies as st

from arm_executor.model.kinematics import BRANCHES, HOME_POSTURE, CellKinematics
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import find_robot
from arm_executor.motion.stopping import stopped
from arm_executor.motion.timing import Load, MotionLimits, Timing

LAYOUT, ROBOT = Layout(), find_robot('ur20')
PERIOD = 1 / 240
HEAVY = Load(14.5, (0.595, 0.395, 0.3))
LIGHT = Load(1.0, (0.2, 0.2, 0.2))


@pytest.fixture(scope='module')
def timing():
    return Timing(ROBOT, LAYOUT, MotionLimits())


@pytest.fixture(scope='module')
def swing():
    """A path from the belt to the left, joint angles (n, 7)."""
    kinematics = CellKinematics(ROBOT, LAYOUT)
    points = [(0.0, 0.75, 1.05), (-0.9, 0.95, 1.2)]
    ends = kinematics.tool_down([0.0, -0.5], points, [0.0, 0.0])
    begin, end = ends[:, BRANCHES.index(HOME_POSTURE)]
    return begin + (end - begin) * np.linspace(0.0, 1.0, 60)[:, None]


def pad_acceleration(trajectory):
    kinematics = CellKinematics(ROBOT, LAYOUT)
    pad = kinematics.tool(trajectory.q)[:, :3, 3]
    return np.diff(pad, 2, axis=0) / PERIOD**2


@pytest.mark.parametrize('load', [HEAVY, LIGHT, None])
@settings(max_examples=15, deadline=None)
@given(share=st.floats(0.0, 0.98))
@example(share=0.47)  # the plan turns from gaining speed to losing it
def test_a_stop_keeps_to_the_limits_of_the_load_and_to_the_path(timing, swing, load, share):
    timed = timing.trajectory(swing, load, PERIOD)
    at_s = share * timed.duration
    stop = stopped(timing, timed, at_s, load)
    directions, bounds = timing.tool_limits(load)
    # From the second sample on: before it the motion still runs as planned.
    pad = pad_acceleration(stop)[1:-1] @ directions.T
    assert (pad <= bounds * 1.1 + 0.2).all()
    nearest = np.abs(stop.q[:, None] - timed.q[None]).max(axis=2).min(axis=1)
    assert nearest.max() < 0.02
    assert np.abs(stop.qd[-1]).max() == 0.0
    assert stop.duration < 1.0


def test_a_heavy_box_is_stopped_more_gently_than_a_light_one(timing, swing):
    timed = timing.trajectory(swing, HEAVY, PERIOD)
    middle = timed.duration / 2
    gentle, hard = (stopped(timing, timed, middle, load) for load in (HEAVY, LIGHT))
    assert hard.duration < gentle.duration < 1.0


def test_a_robot_that_runs_slowly_stops_within_less_time(timing, swing):
    timed = timing.trajectory(swing, HEAVY, PERIOD)
    middle = timed.duration / 2
    full, half = (stopped(timing, timed, middle, HEAVY, pace=pace) for pace in (1.0, 0.5))
    assert half.duration / 0.5 < full.duration
    directions, bounds = timing.tool_limits(HEAVY)
    assert (pad_acceleration(half)[1:-1] * 0.5**2 @ directions.T <= bounds * 1.1 + 0.2).all()
