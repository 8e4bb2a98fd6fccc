"""The arm plans, moves, places, stops and recovers in physics."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from arm_executor.arm import MotionError, MotionHooks, PlaceRequest
from arm_executor.layout import LayoutError, pick_pose
from arm_executor.motion.timing import MotionLimits
from arm_executor.physics_arm import PhysicsArm
from arm_executor.pose_error import corner_distance, turn_between
from arm_executor.truth import TrueBox, Truth
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

LDC = parse_bin('LDC')
QUARTER = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def box(name='box', size=(300.0, 200.0, 200.0), weight=4.0, com=(0.0, 0.0, 0.0)):
    return Box(name, size, weight, com)


def request_for(arm, one, station, centre, quaternion=NO_TURN, belt=()):
    pick = pick_pose(arm.layout, one.size_mm)
    return PlaceRequest(one, pick, station, Pose(centre, quaternion), belt)


def empty(*stations):
    return [Bin(f'bin-{s}', i, LDC, station=s) for i, s in enumerate(stations, 1)]


def holding(station, boxes):
    placed = tuple(PlacedBox(one, (0, 0, 0), (1, 1, 1)) for one in boxes)
    return Bin(f'bin-{station}', 1, LDC, placed, station)


class Told:
    """Hooks that note what they were told, and can act when a phase begins."""

    def __init__(self, **when):
        self.steps, self.phases, self.fractions = [], [], []
        self._when = when
        self.hooks = MotionHooks(
            self._phase,
            *(
                lambda name=name: self.steps.append(name)
                for name in ('picked', 'releasing', 'released')
            ),
        )

    def _phase(self, phase, fraction):
        if phase not in self.phases:
            self.phases.append(phase)
        self.fractions.append(fraction)
        act = self._when.get(phase.name)
        if act is not None:
            act()


def run(arm, request, told=None, stop=None):
    told = told or Told()
    return arm.execute(arm.plan(request), told.hooks, stop or threading.Event())


@pytest.fixture
def arm():
    one = PhysicsArm()
    one.set_bins(empty('A', 'B'), {})
    yield one
    one.close()


def assert_arm_stays_still(arm):
    arm.hold_still(0.01)
    before = np.array(arm.joint_positions()[1])
    arm.hold_still(1.0)
    assert np.abs(np.array(arm.joint_positions()[1]) - before).max() < 0.01


def metres(one):
    return tuple(edge / 1000 for edge in one.size_mm)


# -- planning -------------------------------------------------------------------------------------


def test_box_too_heavy_is_refused_with_both_weights(arm):
    with pytest.raises(MotionError, match=r'weighs 23 kg; ur20 lifts 22 kg') as refused:
        arm.plan(request_for(arm, box(weight=23.0), 'A', (0.5, 0.4, 0.1)))
    assert refused.value.code is ErrorCode.LIMITS_EXCEEDED


def test_target_out_of_reach_is_refused(arm):
    with pytest.raises(MotionError, match='nowhere on its rail') as refused:
        arm.plan(request_for(arm, box(), 'A', (0.5, 2.5, 0.1)))
    assert refused.value.code is ErrorCode.NO_IK_SOLUTION


def test_tipped_target_is_refused_with_the_reason(arm):
    tipped = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    with pytest.raises(MotionError, match='takes boxes by the top or by the front') as refused:
        arm.plan(request_for(arm, box(), 'A', (0.5, 0.4, 0.1), tipped))
    assert refused.value.code is ErrorCode.NO_IK_SOLUTION


def test_target_in_a_wall_is_refused_and_names_it(arm):
    with pytest.raises(MotionError, match='bin A left wall') as refused:
        arm.plan(request_for(arm, box(), 'A', (0.14, 0.4, 0.1)))
    assert refused.value.code is ErrorCode.PATH_IN_COLLISION


def test_target_inside_another_box_is_refused_and_names_it(arm):
    one = box('first')
    arm.set_bins([holding('A', [one])], {'first': Pose((0.5, 0.4, 0.1))})
    with pytest.raises(MotionError, match='box first reaches 200 mm above') as refused:
        arm.plan(request_for(arm, box('second'), 'A', (0.6, 0.45, 0.1)))
    assert refused.value.code is ErrorCode.PATH_IN_COLLISION


def test_station_without_a_bin_is_refused(arm):
    with pytest.raises(MotionError, match="no bin stands at station 'C'"):
        arm.plan(request_for(arm, box(), 'C', (0.5, 0.4, 0.1)))


def test_tall_box_waiting_on_the_belt_makes_the_arm_swing_over_it(arm):
    plain = request_for(arm, box(), 'A', (0.6, 0.4, 0.1))
    tall = box('tall', (300.0, 300.0, 600.0))
    waiting = ((tall, Pose((0.0, 1.0, 0.75 + 0.3))),)
    low, high = arm.plan(plain), arm.plan(replace(plain, belt=waiting))
    last = arm._planner.kinematics.tool(high.detail.retreat.q[-1])[0]
    assert last[2, 3] > 0.75 + 0.6
    assert high.predicted_s > low.predicted_s


def test_planning_moves_nothing(arm):
    before = arm.joint_positions()
    arm.plan(request_for(arm, box(), 'A', (0.6, 0.4, 0.1)))
    assert arm.joint_positions() == before
    assert arm.world.boxes == {}


def test_refusal_is_cheap(arm):
    # A slot as wide as the pad's box, 70 cm deep, between stacks: nothing enters.
    stacks = [box(f's{i}', (300.0, 700.0, 750.0), 20.0) for i in range(2)]
    poses = {'s0': Pose((0.2, 0.4, 0.375)), 's1': Pose((0.648, 0.4, 0.375))}
    arm.set_bins([holding('A', stacks)], poses)
    with pytest.raises(MotionError, match=r'no free path found in 0\.[0-4]'):
        arm.plan(request_for(arm, box(size=(147.0, 200.0, 60.0)), 'A', (0.424, 0.4, 0.03)))


# -- placing --------------------------------------------------------------------------------------


def test_small_stack_is_built_in_place_at_both_stations(arm):
    side = box(size=(300.0, 200.0, 200.0))
    places = [
        ('A', (0.152, 0.102, 0.1), NO_TURN),
        ('A', (0.456, 0.102, 0.1), NO_TURN),
        ('A', (0.304, 0.102, 0.3), NO_TURN),
        ('B', (0.102, 0.152, 0.1), QUARTER),
        ('B', (0.306, 0.152, 0.1), QUARTER),
        ('B', (0.204, 0.152, 0.3), QUARTER),
    ]
    for number, (station, centre, turn) in enumerate(places):
        one, told = replace(side, id=f'box {number}'), Told()
        request = request_for(arm, one, station, centre, turn)
        plan = arm.plan(request)
        result = arm.execute(plan, told.hooks, threading.Event())
        assert result.code is ErrorCode.NONE, result.message
        assert corner_distance(result.measured, request.target, metres(one)) < 0.002
        assert turn_between(result.measured, request.target) < math.radians(0.5)
        assert result.others_moved_m < 0.002
        assert len(result.others) == number % 3
        assert result.motion_s == pytest.approx(plan.predicted_s, abs=0.1)
        assert sum(result.split_s.values()) >= result.motion_s
        assert told.steps == ['picked', 'releasing', 'released']
        assert told.phases == list(Phase)[Phase.APPROACHING :]
        assert all(0 <= fraction <= 1 for fraction in told.fractions)
        assert told.fractions == sorted(told.fractions)
    assert arm.holds() is None


def test_heavy_box_off_balance_arrives_too(arm):
    heavy = box(size=(400.0, 300.0, 250.0), weight=15.0, com=(30.0, 0.0, 0.0))
    request = request_for(arm, heavy, 'B', (0.152, 0.202, 0.125), QUARTER)
    result = run(arm, request)
    assert result.code is ErrorCode.NONE, result.message
    # Off balance a half turn is not the same box any more.
    assert turn_between(result.measured, request.target) < math.radians(0.5)


def test_box_is_reached_behind_the_rail():
    arm = PhysicsArm()
    try:
        arm.set_bins(empty('C'), {})
        request = request_for(arm, box(), 'C', (0.3, 0.3, 0.1), QUARTER)
        result = run(arm, request)
        assert result.code is ErrorCode.NONE, result.message
        assert corner_distance(result.measured, request.target, (0.3, 0.2, 0.2)) < 0.002
    finally:
        arm.close()


def test_box_on_air_ends_out_of_tolerance_and_is_measured_where_it_fell(arm):
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.18)))
    assert result.code is ErrorCode.PLACED_OUT_OF_TOLERANCE
    assert '80.' in result.message or '79.' in result.message
    assert result.measured.position[2] == pytest.approx(0.1, abs=0.002)


def test_disturbed_neighbour_is_reported(arm):
    one = box('first')
    arm.set_bins([*empty('B'), holding('A', [one])], {'first': Pose((0.7, 0.4, 0.1))})

    def shove():
        arm.world.move_box('first', Pose((-0.8, 1.1, 0.251)))

    result = run(arm, request_for(arm, box('second'), 'A', (0.2, 0.2, 0.1)), Told(RETREATING=shove))
    assert result.code is ErrorCode.OTHERS_DISTURBED
    assert result.others_moved_m > 0.1
    assert result.measured is not None


# -- faults ---------------------------------------------------------------------------------------


@pytest.fixture
def with_truth():
    """An arm, and the function that tells it what a box really is."""
    truth = Truth()
    one = PhysicsArm(truth=truth)
    one.set_bins(empty('A'), {})

    def tell(true, pose=None):
        truth.update([TrueBox(true, pose or pick_pose(one.layout, true.size_mm))])

    yield one, tell
    one.close()


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
    one, target = box(), (0.5, 0.4, 0.1)

    def break_hold():
        pose = arm.world.pose(one.id).position
        if arm.gripper._constraint is not None and pose[2] < 0.15 + target[2] + 0.01:
            arm.gripper.lost_because = 'a peeling moment'
            arm.gripper._part()

    told = Told(LOWERING=break_hold)
    result = run(arm, request_for(arm, one, 'A', target), told)
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
    from arm_executor.layout import Block

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


# -- bins -----------------------------------------------------------------------------------------


def test_stack_is_rebuilt_from_its_poses():
    boxes = [box(f'b{i}', (400.0, 300.0, 200.0), 5.0) for i in range(6)]
    poses = {
        f'b{i}': Pose((0.202 + 0.404 * (i % 2), 0.152 + 0.304 * (i // 4), 0.1 + 0.2 * (i % 4 // 2)))
        for i in range(6)
    }
    for station in 'AC':
        arm = PhysicsArm()
        try:
            settled = arm.set_bins([holding(station, boxes)], poses)
            assert set(settled) == set(poses)
            for name, pose in settled.items():
                assert corner_distance(pose, poses[name], (0.4, 0.3, 0.2)) < 0.002
        finally:
            arm.close()


def test_what_is_there_already_is_left_alone(arm):
    bins, poses = [holding('A', [box('one')])], {'one': Pose((0.5, 0.4, 0.1))}
    settled = arm.set_bins(bins, poses)
    body, elapsed = arm.world.boxes['one'].number, arm.world.elapsed_s
    assert arm.set_bins(bins, settled) == settled
    assert arm.world.boxes['one'].number == body
    assert arm.world.elapsed_s == elapsed


def test_closed_bin_goes_with_its_boxes(arm):
    arm.set_bins([holding('A', [box('one')])], {'one': Pose((0.5, 0.4, 0.1))})
    assert arm.set_bins([Bin('new', 2, LDC, station='A')], {}) == {}
    assert 'one' not in arm.world.boxes
    result = run(arm, request_for(arm, box('two'), 'A', (0.5, 0.4, 0.1)))
    assert result.code is ErrorCode.NONE
    assert result.others == {}


def test_box_without_a_pose_is_an_error_that_names_it(arm):
    with pytest.raises(ValueError, match='boxes lone have no pose'):
        arm.set_bins([holding('A', [box('lone')])], {})


def test_bins_that_do_not_fit_are_an_error_that_names_the_overlap(arm):
    wide = parse_bin('100x400x60')
    with pytest.raises(LayoutError, match='no station'):
        arm.set_bins([Bin('x', 1, wide, station='Z')], {})


def test_picture_of_the_cell_can_be_saved(arm, tmp_path):
    arm.render(tmp_path / 'deep' / 'cell.png', 96, 64)
    assert (tmp_path / 'deep' / 'cell.png').read_bytes().startswith(b'\x89PNG')
