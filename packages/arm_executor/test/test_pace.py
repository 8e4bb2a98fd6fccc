"""How fast a path can be travelled: against closed forms, and against TOPP-RA itself."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('toppra')
pytest.importorskip('pinocchio')

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import find_robot
from arm_executor.motion.pace import derivatives, times_along
from arm_executor.motion.quick_timing import QuickTiming
from arm_executor.motion.timing import Load, MotionLimits, Timing

pytestmark = pytest.mark.physics

ARM, LAYOUT = find_robot('ur20'), Layout()
NO_DIRECTIONS, NO_BOUNDS = np.zeros((0, 3)), np.zeros(0)


def one_joint(way, speed, acceleration, hold=0.0, most=1e9):
    """Seconds for one joint that goes ``way`` straight on; its torque is its acceleration."""
    q = np.linspace(0.0, way, 201)[:, None]
    slope, bend = derivatives(q)
    still = np.zeros((len(q), 3))
    times = times_along(
        slope, bend, np.array([speed]), np.array([acceleration]), still, still, NO_DIRECTIONS,
        NO_BOUNDS, slope, bend, np.full_like(slope, hold), np.array([most]),
    )  # fmt: skip
    return times[-1]


@pytest.mark.parametrize('way', [0.1, 0.5, 3.0])
def test_one_joint_speeds_up_cruises_and_brakes(way):
    speed, acceleration = 1.5, 3.0
    ramp = speed * speed / acceleration
    cruising = way / speed + speed / acceleration
    expected = cruising if way > ramp else 2 * (way / acceleration) ** 0.5
    assert one_joint(way, speed, acceleration) == pytest.approx(expected, rel=0.02)


def test_torque_limits_what_acceleration_would_allow():
    # one way the weight helps: with 1 of the 3 to hold, 2 up and 4 down, as far as 3 allow
    assert one_joint(0.5, 9.0, 9.0, most=3.0) == pytest.approx(one_joint(0.5, 9.0, 3.0), rel=0.01)
    assert one_joint(0.5, 9.0, 9.0, hold=1.0, most=3.0) > one_joint(0.5, 9.0, 3.0)


def test_a_joint_that_cannot_even_be_held_is_no_motion():
    q = np.linspace(0.0, 1.0, 50)[:, None]
    slope, bend = derivatives(q)
    still = np.zeros((50, 3))
    times = times_along(
        slope, bend, np.ones(1), np.ones(1), still, still, NO_DIRECTIONS, NO_BOUNDS, slope, bend,
        np.full_like(slope, 5.0), np.array([3.0]),
    )  # fmt: skip
    assert len(times) == 0


@pytest.mark.parametrize('kg', [None, 2.0, 8.0])
def test_seconds_are_those_of_topp_ra_to_some_percent(kg):
    exact, quick = (kind(ARM, LAYOUT, MotionLimits()) for kind in (Timing, QuickTiming))
    load = None if kg is None else Load(kg, (0.4, 0.3, 0.25))
    rng = np.random.default_rng(5)
    errors = []
    for _ in range(12):
        share = (1 - np.cos(np.linspace(0.0, np.pi, 90)))[:, None] / 2
        start = np.array([0.0, 0.3, -1.6, 1.8, -1.7, -1.57, 0.0])
        end = start + rng.uniform(-0.8, 0.8, 7)
        bump = np.sin(share * np.pi) * rng.uniform(-0.2, 0.2, 7)
        path = start + (end - start) * share + bump
        known = exact.trajectory(path, load, 0.01)
        predicted = quick.trajectory(path, load, 0.01)
        if known is not None and predicted is not None:
            errors.append(predicted.duration / known.duration - 1)
    assert len(errors) > 5
    assert np.median(np.abs(errors)) < 0.03 and np.quantile(np.abs(errors), 0.75) < 0.08
