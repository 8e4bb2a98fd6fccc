"""The arm plans and places in physics, and keeps the bins of its world."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from physics_cases import (
    LDC,
    NO_TURN,
    QUARTER,
    Told,
    box,
    empty,
    holding,
    metres,
    request_for,
    run,
)

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.layout import LayoutError, pick_pose
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import (
    Pose,
    about_z,
    corner_distance,
    quaternion_product,
    turn_between,
)
from pack_msgs_py.orientation import TIPPED, oriented_size
from pack_msgs_py.values import Bin, parse_bin

pytestmark = pytest.mark.physics

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
    first = box('first')
    arm.set_bins([holding('A', [first])], {'first': Pose((0.5, 0.4, 0.1))})
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
    last = arm.planning.motions.kinematics.tool(high.detail.retreat.q[-1])[0]
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
        tipped, told = replace(side, id=f'box {number}'), Told()
        request = request_for(arm, tipped, station, centre, turn)
        plan = arm.plan(request)
        result = arm.execute(plan, told.hooks, threading.Event())
        assert result.code is ErrorCode.NONE, result.message
        assert corner_distance(result.measured, request.target, metres(tipped)) < 0.002
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


@pytest.mark.parametrize(
    ('aside_m', 'back_m', 'yaw_deg', 'lies'),
    [(0.05, 0.0, 30.0, 'xyz'), (-0.05, 0.08, -40.0, 'xyz'), (0.03, 0.02, 12.0, TIPPED['y'])],
    ids=['aside and turned', 'back and turned the other way', 'tipped by a tray'],
)
def test_box_that_lies_aside_and_turned_rests_straight(arm, aside_m, back_m, yaw_deg, lies):
    askew = box(size=(300.0, 200.0, 220.0))
    straight = pick_pose(arm.layout, askew.size_mm, lies)
    x, y, z = straight.position
    turn = quaternion_product(about_z(math.radians(yaw_deg)), straight.quaternion)
    pick = Pose((x + aside_m, y + back_m + 0.05, z), turn)
    upright = oriented_size(askew.size_mm, lies)
    target = Pose((0.4, 0.3, upright[2] / 2000), straight.quaternion)
    result = run(arm, PlaceRequest(askew, pick, 'A', target))
    assert result.code is ErrorCode.NONE, result.message
    assert corner_distance(result.measured, target, metres(askew)) < 0.003
    assert turn_between(result.measured, target) < math.radians(0.5)


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


def test_box_on_air_is_measured_where_it_fell(arm):
    result = run(arm, request_for(arm, box(), 'A', (0.5, 0.4, 0.18)))
    assert result.measured.position[2] == pytest.approx(0.1, abs=0.002)


def test_a_disturbed_neighbour_is_measured(arm):
    first = box('first')
    arm.set_bins([*empty('B'), holding('A', [first])], {'first': Pose((0.7, 0.4, 0.1))})

    def shove():
        arm.world.move_box('first', Pose((-0.8, 1.1, 0.251)))

    result = run(arm, request_for(arm, box('second'), 'A', (0.2, 0.2, 0.1)), Told(RETREATING=shove))
    assert result.others_moved_m > 0.1
    assert result.measured is not None


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
