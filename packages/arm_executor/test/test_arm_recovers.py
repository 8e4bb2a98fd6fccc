"""The arm notices in physics what goes wrong, stops, and recovers."""

from __future__ import annotations

import threading

import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from physics_cases import (
    Told,
    assert_arm_stays_still,
    box,
    empty,
    metres,
    request_for,
    run,
)

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.arms.true_boxes import TrueBox, Truth
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.layout import pick_pose
from arm_executor.motion.timing import MotionLimits
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, corner_distance
from pack_msgs_py.values import Bin, parse_bin

pytestmark = pytest.mark.physics


@pytest.fixture
def with_truth():
    """An arm, and the function that tells it what a box really is."""
    truth = Truth()
    arm = PhysicsArm(truth=truth)
    arm.set_bins(empty('A'), {})

    def tell(true, pose=None):
        truth.update([TrueBox(true, pose or pick_pose(arm.layout, true.size_mm))])

    yield arm, tell
    arm.close()


@pytest.mark.parametrize('higher_mm', [-6.0, 6.0])
def test_a_box_not_quite_as_scanned_is_taken_and_its_base_stands_where_it_should(
    with_truth, higher_mm
):
    arm, tell = with_truth
    tell(box(size=(300.0, 206.0, 200.0 + higher_mm)))
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)))
    assert result.code is ErrorCode.NONE, result.message
    x, y, z = result.measured.position
    assert (x, y) == pytest.approx((0.5, 0.403), abs=0.001)
    assert z - (0.2 + higher_mm / 1e3) / 2 == pytest.approx(0.0, abs=0.001)


def test_a_box_far_from_what_was_scanned_is_noticed_in_the_gripper_and_goes_back(with_truth):
    arm, tell = with_truth
    tell(box(size=(300.0, 280.0, 200.0)))
    told = Told()
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)), told)
    assert (result.code, told.steps) == (ErrorCode.BOX_MISMATCH, ['picked'])
    assert 'measures 280 mm along y' in result.message
    assert arm.return_to_belt()
    assert arm.holds() is None


def test_a_box_that_lies_aside_is_not_grasped(with_truth):
    arm, tell = with_truth
    x, y, z = pick_pose(arm.layout, box().size_mm).position
    tell(box(), Pose((x + 0.6, y, z)))
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)))
    assert (result.code, arm.holds()) == (ErrorCode.GRASP_FAILED, None)


def test_box_lower_than_announced_is_not_grasped(arm):
    request = request_for(arm, box(), 'A', (0.5, 0.4, 0.1))
    plan = arm.plan(request)
    lower = box(size=(300.0, 200.0, 185.0))
    arm.present(lower, request.pick)
    told = Told()
    result = arm.execute(plan, told.hooks, threading.Event())
    assert result.code is ErrorCode.GRASP_FAILED
    assert 'mm from its top' in result.message
    assert told.steps == []
    assert arm.holds() is None
    # And the next attempt starts from where the arm is.
    arm.present(box(), request.pick)
    assert run(arm, request).code is ErrorCode.NONE


def test_box_that_comes_off_the_pad_is_lost_and_noticed_before_the_release(arm):
    dropped = []

    def drop():
        if not dropped:
            dropped.append(True)
            held = arm.gripper.box_id
            arm.gripper.release()
            arm.gripper.box_id = held
            arm.gripper._grasp = arm.gripper._relative(held)

    told = Told(LOWERING=drop)
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)), told)
    assert result.code is ErrorCode.BOX_LOST
    assert result.measured is None
    assert told.steps == ['picked']
    assert arm.holds() is None
    assert arm.return_to_belt() is False
    assert_arm_stays_still(arm)
    assert run(arm, request_for(arm, box('next'), 'A', (0.5, 0.4, 0.1))).code is ErrorCode.NONE


def test_box_that_comes_off_the_pad_as_it_lands_is_in_the_bin(arm):
    landing, target = box(), (0.5, 0.4, 0.1)

    def break_hold():
        pose = arm.world.pose(landing.id).position
        if arm.gripper._constraint is not None and pose[2] < 0.15 + target[2] + 0.01:
            arm.gripper.lost_because = 'a peeling moment'
            arm.gripper._part()

    told = Told(LOWERING=break_hold)
    result = run(arm, request_for(arm, landing, 'A', target), told)
    assert told.steps == ['picked', 'releasing', 'released']
    assert result.code is ErrorCode.NONE, result.message
    assert result.measured.position == pytest.approx(target, abs=0.002)
    assert arm.holds() is None
    beside = request_for(arm, box('next'), 'A', (0.5, 0.61, 0.1))
    assert run(arm, beside).code is ErrorCode.NONE


@pytest.mark.parametrize('phase', ['LOWERING', 'RETREATING'])
def test_an_arm_that_stopped_inside_a_cage_comes_out_again(phase):
    arm, stop = PhysicsArm(), threading.Event()
    try:
        arm.set_bins([Bin('bin-A', 1, parse_bin('RC'), station='A')], {})
        begins = arm.world.tool_pose().position

        def end_it():
            if arm.world.tool_pose().position[1] > 1.2:
                arm.gripper._part() if phase == 'LOWERING' else stop.set()

        request = request_for(arm, box(), 'A', (0.6, 0.15, 0.1))
        run(arm, request, Told(**{phase: end_it}), stop)
        assert arm.world.tool_pose().position[1] > 1.1
        assert arm.withdraw()
        assert arm.world.tool_pose().position == pytest.approx(begins, abs=0.02)
        assert_arm_stays_still(arm)
        assert run(arm, request_for(arm, box('next'), 'A', (1.0, 0.15, 0.1))).code is ErrorCode.NONE
    finally:
        arm.close()


#: Low and high corner of a wall on the way to station A: in that of the box, or of the wrist.
BEFORE_BOX = ((-0.5, 0.35, 0.6), (-0.4, 1.5, 1.05))
BEFORE_WRIST = ((-0.6, 0.75, 1.3), (-0.5, 1.5, 2.4))


def appearing_wall(arm, low, high):
    """A function that puts a wall into the way, once."""
    from arm_executor.model.layout import Block

    def appear():
        wall = (Block('ghost', low, high),)
        if not arm.world._parts.get('ghost'):
            arm.world.add_part('ghost', wall)

    return appear


def test_obstacle_that_nobody_knows_of_ends_the_motion_and_the_box_comes_back():
    arm = PhysicsArm(limits=MotionLimits(joint_acceleration=1.0, tool_acceleration=0.5))
    try:
        arm.set_bins(empty('A', 'B'), {})
        told = Told(TRANSFERRING=appearing_wall(arm, *BEFORE_WRIST))
        result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)), told)
        assert result.code is ErrorCode.COLLISION
        assert 'pressed on ghost' in result.message
        assert_arm_stays_still(arm)
        assert arm.holds() == 'box'
        arm.world.remove_part('ghost')
        assert arm.return_to_belt() is True
    finally:
        arm.close()


def test_obstacle_met_at_full_speed_is_felt_and_the_box_held_or_lost(arm):
    told = Told(TRANSFERRING=appearing_wall(arm, *BEFORE_BOX))
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.1)), told)
    assert result.code in (ErrorCode.BOX_LOST, ErrorCode.COLLISION)
    assert 'came off' in result.message or 'pressed on ghost' in result.message
    assert_arm_stays_still(arm)
    assert arm.holds() == ('box' if result.code is ErrorCode.COLLISION else None)


@pytest.mark.parametrize('phase', ['APPROACHING', 'GRASPING', 'TRANSFERRING', 'LOWERING'])
def test_stop_leaves_the_arm_still_and_the_box_accounted_for(arm, phase):
    stop = threading.Event()
    request = request_for(arm, box(), 'A', (0.5, 0.4, 0.1))
    calls = []

    def later():
        calls.append(None)
        if len(calls) == 2 or phase == 'GRASPING':
            stop.set()

    result = run(arm, request, Told(**{phase: later}), stop)
    assert result.code is ErrorCode.CANCELED
    assert result.message
    assert_arm_stays_still(arm)
    held = phase in ('TRANSFERRING', 'LOWERING')
    assert arm.holds() == ('box' if held else None)
    assert arm.return_to_belt() is held
    assert arm.holds() is None
    again = run(arm, request)
    assert again.code is ErrorCode.NONE, again.message
    assert corner_distance(again.measured, request.target, (0.3, 0.2, 0.2)) < 0.002


@pytest.mark.parametrize('looks', [1, 2, 5, 8, 11, 14])
def test_a_heavy_carton_comes_back_whenever_it_is_cancelled(arm, looks):
    carton = box('carton', (595.0, 395.0, 300.0), 14.5)
    request = request_for(arm, carton, 'A', (0.3, 0.2, 0.15))
    stop, count = threading.Event(), []

    def cancel():
        count.append(None)
        if len(count) >= looks:
            stop.set()

    result = run(arm, request, Told(TRANSFERRING=cancel, LOWERING=cancel), stop)
    assert (result.code, arm.holds()) == (ErrorCode.CANCELED, 'carton')
    assert arm.return_to_belt()
    assert corner_distance(arm.world.pose('carton'), request.pick, metres(carton)) < 0.005
    assert arm.withdraw()


def test_a_box_that_comes_off_on_the_way_back_is_lost_and_the_text_says_why(arm):
    stop = threading.Event()
    request = request_for(arm, box(), 'A', (0.5, 0.4, 0.1))
    run(arm, request, Told(LOWERING=stop.set), stop)

    def let_go():
        arm.gripper.lost_because = 'a hose burst'
        arm.gripper._part()

    arm.world.after_step = let_go
    with pytest.raises(MotionError, match=r'on the way back: .*a hose burst') as error:
        arm.return_to_belt()
    assert error.value.code is ErrorCode.BOX_LOST
    assert arm.holds() is None


def test_box_goes_back_exactly_to_the_pick_point(arm):
    stop = threading.Event()
    request = request_for(arm, box(), 'A', (0.5, 0.4, 0.1))
    run(arm, request, Told(LOWERING=stop.set), stop)
    assert arm.return_to_belt()
    assert corner_distance(arm.world.pose('box'), request.pick, (0.3, 0.2, 0.2)) < 0.003


def test_stop_after_the_release_still_measures_the_box(arm):
    stop = threading.Event()
    request = request_for(arm, box(), 'A', (0.5, 0.4, 0.1))
    result = run(arm, request, Told(RETREATING=stop.set), stop)
    assert result.measured is not None
    assert arm.holds() is None
    assert_arm_stays_still(arm)
    assert run(arm, request_for(arm, box('b'), 'A', (0.9, 0.4, 0.1))).code is ErrorCode.NONE


def test_plan_made_before_the_arm_moved_is_not_run(arm):
    old = arm.plan(request_for(arm, box('a'), 'A', (0.5, 0.4, 0.1)))
    stop = threading.Event()
    stop.set()
    arm.execute(old, Told().hooks, stop)
    assert run(arm, request_for(arm, box('b'), 'B', (0.5, 0.4, 0.1))).code is ErrorCode.NONE
    result = arm.execute(old, Told().hooks, threading.Event())
    assert result.code in (ErrorCode.START_STATE_INVALID, ErrorCode.NONE)
