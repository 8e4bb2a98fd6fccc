"""The pad holds what its area and vacuum allow, in planning and in physics, and no more."""

from __future__ import annotations

import math
import re
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

import pybullet

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.model.arm_interface import MotionError, MotionHooks, PlaceRequest
from arm_executor.model.layout import Tool, pick_pose
from arm_executor.model.suction import (
    GRAVITY,
    Pad,
    PadLoad,
    check_grip,
    holding_limits,
    overload,
    pad_on,
    tool_acceleration_limit,
)
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, parse_bin

pytestmark = pytest.mark.physics

SIZE_MM = (400.0, 300.0, 250.0)
SIZE = (0.4, 0.3, 0.25)


def test_grip_is_vacuum_times_the_area_that_lies_on_the_box():
    assert pad_on(Tool(), SIZE).grip == pytest.approx(60_000 * 0.0081)
    assert pad_on(Tool(), (0.06, 0.3, 0.25)).grip == pytest.approx(60_000 * 0.06 * 0.09)
    assert pad_on(Tool(), (0.06, 0.3, 0.25)).lever == pytest.approx(0.03)


@pytest.mark.parametrize(
    ('load', 'message'),
    [
        (PadLoad(399.0, 0.0, 0.0), None),
        (PadLoad(401.0, 0.0, 0.0), 'a pull of 401 N on a pad that holds 400 N'),
        (PadLoad(200.0, 99.0, 0.0), None),
        (PadLoad(200.0, 101.0, 0.0), 'a shear of 101 N where 100 N hold'),
        (PadLoad(200.0, 0.0, 8.0), None),
        (PadLoad(200.0, 0.0, 9.1), 'a peeling moment of 9.1 N m where 9.0 N m hold'),
        (PadLoad(-200.0, 250.0, 20.0), None),
    ],
)
def test_each_limit_shrinks_with_the_pull_and_is_named(load, message):
    assert overload(Pad(400.0, 0.5, 0.045), load) == message


@settings(max_examples=200, deadline=None)
@given(
    mass=st.floats(0.1, 30.0),
    height=st.floats(0.05, 0.6),
    aside=st.floats(0.0, 0.1),
    angle=st.floats(0.0, 6.3),
)
def test_within_the_limit_the_pad_holds_with_the_reserve_and_beyond_it_does_not(
    mass, height, aside, angle
):
    """Against the wrench of a rigid body, computed here by hand."""
    tool, size, offset = Tool(), (0.4, 0.3, height), (aside, 0.0, 0.0)
    limit = tool_acceleration_limit(tool, mass, size, offset)
    pad = pad_on(tool, size)
    reserved = Pad(pad.grip / tool.safety, pad.friction, pad.lever)

    def bears(acceleration, direction):
        pull = mass * (GRAVITY + acceleration)
        level = mass * acceleration
        peel = (
            pull * aside + level * height / 2 * math.cos(direction),
            level * height / 2 * math.sin(direction),
        )
        return PadLoad(pull, level, math.hypot(*peel))

    if limit > 0:
        assert overload(reserved, bears(0.999 * limit, angle)) is None
        assert overload(reserved, bears(1.001 * limit, 0.0)) is not None
    else:
        assert overload(reserved, bears(0.001, 0.0)) is not None


@settings(max_examples=200, deadline=None)
@given(
    mass=st.floats(0.1, 30.0),
    height=st.floats(0.05, 0.6),
    aside=st.floats(0.0, 0.1),
    slope=st.floats(-1.2, 1.2),
)
def test_level_and_upward_acceleration_share_what_the_pad_holds(mass, height, aside, slope):
    """Level in the worst direction, that in which the centre of mass lies off the pad's axis."""
    tool, size, offset = Tool(), (0.4, 0.3, height), (aside, 0.0, 0.0)
    pad = pad_on(tool, size)
    reserved = Pad(pad.grip / tool.safety, pad.friction, pad.lever)

    def bears(length):
        level, up = length * math.cos(slope), length * math.sin(slope)
        pull = mass * (GRAVITY + up)
        return PadLoad(pull, mass * level, pull * aside + mass * level * height / 2)

    rows = holding_limits(tool, mass, size, offset)
    if any(limit <= 0 for _, _, limit in rows):
        assert overload(reserved, bears(0.001)) is not None
        return
    # Upside down the pad would be pushed, not pulled: nothing falls faster than the box.
    steps = [
        limit / (level * math.cos(slope) + up * math.sin(slope))
        for level, up, limit in rows
        if level * math.cos(slope) + up * math.sin(slope) > 0
    ]
    most = min([*steps, 9.0])
    assert overload(reserved, bears(0.999 * most)) is None
    if most < 9.0:
        assert overload(reserved, bears(1.001 * most)) is not None


def test_heavier_and_taller_boxes_are_carried_more_gently():
    limits = [tool_acceleration_limit(Tool(), mass, SIZE, (0, 0, 0)) for mass in (2, 7, 14, 20)]
    assert limits == sorted(limits, reverse=True)
    assert limits[0] > 5.0 > limits[-1] > 0.5
    tall = tool_acceleration_limit(Tool(), 14, (0.4, 0.3, 0.5), (0, 0, 0))
    assert tall < limits[2]


@pytest.mark.parametrize(('weight', 'aside'), [(28.0, 0.0), (18.0, 60.0)])
def test_box_that_the_pad_cannot_carry_is_refused_before_motion_with_the_numbers(weight, aside):
    box = Box('big', SIZE_MM, weight, (aside, 0.0, 0.0))
    with pytest.raises(
        MotionError, match=rf'big: {weight:g} kg, {aside:.0f} mm off .* 486 N'
    ) as no:
        check_grip(Tool(), box)
    assert no.value.code is ErrorCode.LIMITS_EXCEEDED


# -- in physics -----------------------------------------------------------------------------------


@pytest.fixture
def arm():
    arm = PhysicsArm()
    arm.set_bins([Bin('bin-A', 1, parse_bin('LDC'), station='A')], {})
    yield arm
    arm.close()


def carry(arm, declared, real):
    """Plan for ``declared``, but have ``real`` on the belt; the result, and the steps told."""
    box = Box('box', SIZE_MM, *declared)
    request = PlaceRequest(box, pick_pose(arm.layout, SIZE_MM), 'A', Pose((0.5, 0.4, 0.125)))
    plan, told = arm.plan(request), []
    arm.present(Box('box', SIZE_MM, *real), request.pick)
    hooks = MotionHooks(
        lambda *_: None,
        *(lambda name=name: told.append(name) for name in ('picked', 'releasing', 'released')),
    )
    return arm.execute(plan, hooks, threading.Event()), told


@pytest.mark.parametrize(
    'box', [(4.0,), (12.0,), (20.0,), (15.0, (30.0, 0.0, 0.0)), (12.0, (0.0, 30.0, 20.0))]
)
def test_box_that_planning_allows_stays_on_the_pad(arm, box):
    result, told = carry(arm, box, box)
    assert result.code is ErrorCode.NONE, result.message
    assert told == ['picked', 'releasing', 'released']


@pytest.mark.parametrize(
    ('real', 'message', 'where'),
    [
        ((60.0,), r'a pull of \d+ N on a pad that holds 486 N', 'belt'),
        ((30.0,), r'a (shear|peeling moment) of [\d.]+ N.* where [\d.]+ N.* hold', 'belt'),
        (
            (10.0, (120.0, 0.0, 0.0)),
            r'a peeling moment of [\d.]+ N m where [\d.]+ N m hold',
            'away',
        ),
    ],
    ids=['too heavy to lift', 'too heavy for the speed', 'off-centre'],
)
def test_box_heavier_or_less_balanced_than_announced_comes_off_and_is_noticed(
    arm, real, message, where
):
    result, told = carry(arm, (6.0,), real)
    on_belt = where == 'belt'
    assert result.code is (ErrorCode.BOX_MISMATCH if on_belt else ErrorCode.BOX_LOST)
    assert result.on_belt is on_belt
    assert told == ['picked']
    assert re.search(message, result.message), result.message
    assert arm.holds() is None
    # The arm goes on with the next box.
    again, _ = carry(arm, (6.0,), (6.0,))
    assert again.code is ErrorCode.NONE, again.message


def test_measured_load_is_the_weight_of_the_box_while_the_arm_stands_still(arm):
    box = Box('box', SIZE_MM, 8.0, (20.0, 0.0, 0.0))
    request = PlaceRequest(box, pick_pose(arm.layout, SIZE_MM), 'A', Pose((0.5, 0.4, 0.125)))
    plan, stop = arm.plan(request), threading.Event()
    hooks = MotionHooks(
        lambda phase, _: stop.set() if phase.name == 'LOWERING' else None,
        *(lambda: None for _ in range(3)),
    )
    arm.execute(plan, hooks, stop)
    arm.hold_still(0.3)
    seen = arm.gripper.load()
    assert seen.pull == pytest.approx(8.0 * GRAVITY, rel=0.01)
    assert seen.shear < 1.0
    assert seen.peel == pytest.approx(8.0 * GRAVITY * 0.020, rel=0.05)


def test_pad_gives_way_to_one_box_and_not_to_the_next_with_its_body_number(arm):
    world, gripper = arm.world, arm.gripper
    x, y, z = world.tool_pose().position
    under = Pose((x, y, z - SIZE[2] / 2 + 0.004))

    def touched(box_id):
        """Add a box that overlaps the pad by 4 mm; its number, and whether the pad meets it."""
        world.add_box(Box(box_id, SIZE_MM, 4.0), under)
        if box_id == 'soft':
            gripper.approach(box_id)
        world.step()
        number = world.boxes[box_id].number
        contacts = pybullet.getContactPoints(world.robot, number, physicsClientId=world.client)
        world.remove_box(box_id)
        return number, bool(contacts)

    number, met = touched('soft')
    assert not met
    assert touched('next') == (number, True)
