"""A box is taken by its front and placed with that face up."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.model.arm_interface import MotionError, MotionHooks, PlaceRequest
from arm_executor.model.layout import Layout, Tool, pick_pose
from arm_executor.model.suction import Pad, PadLoad, overload, pad_on, tool_acceleration_limit
from arm_executor.motion.grasp import front_point, turned_down
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import (
    Pose,
    corner_distance,
    corners,
    metres,
    rotated,
    stands_upright,
    turn_between,
)
from pack_msgs_py.orientation import ORIENTATIONS, QUATERNIONS, oriented_size
from pack_msgs_py.values import UP_NEG_Y, UP_POS_Z, Bin, Box, parse_bin

pytestmark = pytest.mark.physics

LDC = parse_bin('LDC')
SIZE = (300.0, 200.0, 220.0)


def request(orientation, box=None, centre=(0.4, 0.3), yaw=0.0, station='A'):
    box = box or Box('box', SIZE, 3.0)
    pick = pick_pose(Layout(), box.size_mm)
    pick = Pose(pick.position, (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))
    z = oriented_size(box.size_mm, orientation)[2] / 2000
    return PlaceRequest(box, pick, station, Pose((*centre, z), QUATERNIONS[orientation]))


@pytest.fixture(scope='module')
def arm():
    arm = PhysicsArm()
    arm.set_bins([Bin(f'bin-{s}', i, LDC, station=s) for i, s in enumerate('AB', 1)], {})
    yield arm
    arm.close()


@pytest.mark.parametrize('orientation', [name for name in ORIENTATIONS if name[2] == 'y'])
def test_a_box_turned_down_fills_the_same_space_as_the_target(orientation):
    asked = request(orientation)
    taken = turned_down(asked)
    assert stands_upright(taken.target.quaternion)
    want = np.array(corners(asked.target, metres(asked.box.size_mm)))
    have = np.array(corners(taken.target, metres(taken.box.size_mm)))
    assert {tuple(row) for row in want.round(6)} == {tuple(row) for row in have.round(6)}


@pytest.mark.parametrize('orientation', [name for name in ORIENTATIONS if name[2] == 'y'])
def test_the_centre_of_mass_goes_along(orientation):
    asked = request(orientation, Box('box', SIZE, 3.0, com_offset_mm=(10.0, 20.0, 30.0)))
    taken = turned_down(asked)
    want = rotated(asked.target.quaternion, asked.box.com_offset_mm)
    assert rotated(taken.target.quaternion, taken.box.com_offset_mm) == pytest.approx(want)


@pytest.mark.parametrize('orientation', [name for name in ORIENTATIONS if name[2] == 'x'])
def test_an_end_face_cannot_come_up(orientation):
    with pytest.raises(MotionError) as error:
        turned_down(request(orientation))
    assert error.value.code is ErrorCode.NO_IK_SOLUTION


@pytest.mark.parametrize(
    'box',
    [Box('low', (300.0, 200.0, 80.0), 3.0), Box('up', SIZE, 3.0, allowed_up=UP_POS_Z)],
    ids=['front too low for the pad', 'must stay upright'],
)
def test_a_front_that_cannot_be_taken_is_refused(box):
    with pytest.raises(MotionError) as error:
        turned_down(request('xzy', box))
    assert error.value.code is ErrorCode.NO_IK_SOLUTION


def test_a_box_whose_front_may_come_up_is_taken():
    turned_down(request('xzy', Box('box', SIZE, 3.0, allowed_up=UP_POS_Z | UP_NEG_Y)))


def test_the_front_of_a_box_that_lies_askew_is_found():
    asked = request('xzy', yaw=0.015)
    points = np.array(corners(asked.pick, np.array(asked.box.size_mm) / 1000))
    front = points[np.argsort(points[:, 1])[:4]].mean(axis=0)
    assert front_point(asked) == pytest.approx(front, abs=1e-9)


@pytest.mark.parametrize('mass', [1.0, 4.0, 8.0])
def test_what_a_tilting_pad_may_do_is_held_at_every_tilt(mass):
    tool, size = Tool(), (0.3, 0.22, 0.2)
    most = tool_acceleration_limit(tool, mass, size, (0.0, 0.0, 0.0), tilts=True)
    pad = pad_on(tool, size)
    pad = Pad(pad.grip / tool.safety, pad.friction, pad.lever)
    for tilt in np.linspace(0.0, math.pi / 2, 31):
        pull = mass * (9.81 * math.cos(tilt) + most)
        across = mass * (9.81 * math.sin(tilt) + most)
        assert overload(pad, PadLoad(pull, across, across * size[2] / 2)) is None or most < 0
    assert most < tool_acceleration_limit(tool, mass, size, (0.0, 0.0, 0.0))


@pytest.mark.parametrize('orientation', ['xzy', 'zxy'])
@pytest.mark.parametrize('station', ['A', 'B'])
def test_the_tool_is_level_at_the_pick_and_down_at_the_place(arm, orientation, station):
    motion = arm.plan(request(orientation, station=station)).detail
    tool = arm.planning.motions.kinematics.tool(np.array([motion.carry.q[0], motion.carry.q[-1]]))
    assert tool[0, :3, 2] == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert tool[1, :3, 2] == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)
    for leg, following in ((motion.approach, motion.carry), (motion.carry, motion.retreat)):
        assert leg.q[-1] == pytest.approx(following.q[0], abs=1e-6)


@pytest.mark.parametrize('orientation', ['xzy', 'zxy'])
def test_the_box_rests_with_its_front_up(arm, orientation):
    box = Box(f'box-{orientation}', SIZE, 3.0)
    asked = request(orientation, box, centre=(0.3 if orientation == 'xzy' else 0.75, 0.3))
    steps = []
    hooks = MotionHooks(
        lambda phase, share: None,
        lambda: steps.append('picked'),
        lambda: steps.append('releasing'),
        lambda: steps.append('released'),
    )
    result = arm.execute(arm.plan(asked), hooks, threading.Event())
    assert (result.code, result.message) == (ErrorCode.NONE, '')
    assert steps == ['picked', 'releasing', 'released']
    size = tuple(edge / 1000 for edge in box.size_mm)
    assert corner_distance(result.measured, asked.target, size) < 0.001
    assert turn_between(result.measured, asked.target) < math.radians(0.5)
    front = rotated(result.measured.quaternion, (0.0, -1.0, 0.0))
    assert front == pytest.approx((0.0, 0.0, 1.0), abs=0.01)
