"""A box that a tilt tray has tipped is taken from above, and placed as it was meant to."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from core_bench import CoreBench
from executor_cases import CELL, LAYOUT, make_box, make_decision, make_goal, make_scan
from hypothesis import given
from hypothesis import strategies as st
from physics_cases import Told, empty

from arm_executor.arms.timed import TimedArm
from arm_executor.arms.true_boxes import TrueBox, Truth, missed_by_pad
from arm_executor.goals.outputs import Finished
from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.layout import Layout, pick_pose
from arm_executor.motion.grasp import as_lying, as_taken
from arm_executor.motion.swing import CLEAR
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
from pack_msgs_py.orientation import (
    ORIENTATIONS,
    QUATERNIONS,
    TIPPED,
    TRAY_HEIGHT_MM,
    TRAY_SWING_MM,
    UPRIGHT_OR_TIPPED,
    at_pick,
    oriented_size,
)
from pack_msgs_py.values import Box

SIZE = (300.0, 200.0, 220.0)
TURNED_OVER = [name for name in ORIENTATIONS if name[2] != 'z']
TRAY = replace(CELL, orientations=UPRIGHT_OR_TIPPED)


def request(orientation, box=None, centre=(0.4, 0.3)):
    box = box or Box('box', SIZE, 3.0)
    pick = pick_pose(LAYOUT, box.size_mm, TIPPED[orientation[2]])
    z = oriented_size(box.size_mm, orientation)[2] / 2000
    return PlaceRequest(box, pick, 'A', Pose((*centre, z), QUATERNIONS[orientation]))


def space(box, pose):
    return {tuple(row) for row in np.array(corners(pose, metres(box.size_mm))).round(6)}


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_a_box_as_it_lies_fills_the_same_space_at_pick_and_target(orientation):
    asked = request(orientation, Box('box', SIZE, 3.0, com_offset_mm=(10.0, 20.0, 30.0)))
    lying = as_lying(asked)
    for was, now in ((asked.pick, lying.pick), (asked.target, lying.target)):
        assert stands_upright(now.quaternion)
        assert space(asked.box, was) == space(lying.box, now)
        heavy = rotated(was.quaternion, asked.box.com_offset_mm)
        assert rotated(now.quaternion, lying.box.com_offset_mm) == pytest.approx(heavy, abs=1e-6)
    assert as_taken(asked) == lying


def test_the_arm_waits_above_all_that_the_tray_may_lift():
    room_mm = 1000 * Layout().conveyor.tallest_box
    assert room_mm == TRAY_HEIGHT_MM
    assert room_mm + 1000 * CLEAR >= TRAY_SWING_MM


def test_a_tipped_box_cannot_be_placed_with_yet_another_face_up():
    asked = replace(request('xzy'), target=request('zyx').target)
    with pytest.raises(MotionError) as error:
        as_lying(asked)
    assert error.value.code is ErrorCode.NO_IK_SOLUTION


@given(
    up=st.sampled_from('xyz'),
    along=st.floats(-0.3, 0.3),
    across=st.floats(-0.3, 0.3),
)
def test_the_pad_misses_a_box_by_the_face_that_is_up(up, along, across):
    box = Box('box', SIZE, 3.0)
    lies = pick_pose(LAYOUT, box.size_mm, TIPPED[up])
    x, y, z = lies.position
    length, depth, _ = oriented_size(SIZE, TIPPED[up])
    beside = abs(along) > length / 2000 or abs(across) > depth / 2000
    pick = Pose((x + along, y + across, z), lies.quaternion)
    assert missed_by_pad(pick, TrueBox(box, lies)) == beside


@pytest.mark.parametrize('orientation', TURNED_OVER)
def test_a_box_that_is_higher_than_scanned_rests_that_much_higher(orientation):
    asked = request(orientation)
    up = 'xyz'.index(orientation[2])
    size = tuple(edge + (6.0 if axis == up else 0.0) for axis, edge in enumerate(SIZE))
    truth = Truth()
    true = Box('box', size, 3.0)
    truth.update([TrueBox(true, pick_pose(LAYOUT, size, TIPPED[orientation[2]]))])
    arm = TimedArm(LAYOUT, speed=0.0, truth=truth)
    arm.set_bins(empty('A'), {})
    result = arm.execute(arm.plan(asked), Told().hooks, threading.Event())
    x, y, z = asked.target.position
    assert result.measured.position == pytest.approx((x, y, z + 0.003))


def test_the_timed_arm_takes_a_tipped_box_like_an_upright_one_of_that_size():
    arm = TimedArm(LAYOUT, speed=0.0)
    arm.set_bins(empty('A'), {})
    asked = request('zyx')
    upright = request('xyz', Box('box', oriented_size(SIZE, 'zyx'), 3.0))
    plan = arm.plan(asked)
    assert plan.predicted_s == pytest.approx(arm.plan(upright).predicted_s)
    assert 0 < plan.after_pick_s < plan.predicted_s


@pytest.fixture
def bench():
    bench = CoreBench(profile=TRAY, tilt_time_s=2.0)
    yield bench
    bench.end()


def tipped_goal(box, lies, **more):
    decision = make_decision(box, orientation='xzy', profile=TRAY)
    pick = pick_pose(LAYOUT, box.size_mm, lies)
    return make_goal(decision, pick=pick, **more)


def held(box, lies, *, sequence):
    """A scan of ``box``, held at the pick point with these axes along those of the cell."""
    scan = make_scan(box, stamp_s=1e9, presented=box.id, sequence=sequence)
    item = replace(scan.boxes[0], pose=pick_pose(LAYOUT, box.size_mm, lies))
    return replace(scan, boxes=(item,))


def fresh(scan):
    now_s = time.time()
    boxes = tuple(replace(item, pick_open_s=now_s) for item in scan.boxes)
    return replace(scan, stamp_s=now_s, boxes=boxes)


def test_the_arm_waits_until_the_box_is_tipped_and_the_tray_counts_in_its_cycle(bench):
    box = make_box()
    lies = at_pick('xzy', UPRIGHT_OR_TIPPED)
    bench.core.on_scan(fresh(held(box, 'xyz', sequence=1)))
    bench.core.submit(tipped_goal(box, lies, deadline_s=time.time() + 60))
    bench.wait(lambda: bench.core.status().mode.name == 'EXECUTING')
    assert not bench.of(Finished)
    bench.core.on_scan(fresh(held(box, lies, sequence=2)))
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert (report.code, report.message) == (ErrorCode.NONE, '')
    assert report.cycle_s == pytest.approx(report.planning_s + 2.0 + report.motion_s)
    assert report.wait_s == 0.0


def test_a_deadline_that_the_tray_leaves_no_time_for_is_refused(bench):
    box = make_box()
    lies = at_pick('xzy', UPRIGHT_OR_TIPPED)
    bench.core.on_scan(fresh(held(box, lies, sequence=1)))
    motion_s = bench.arm.plan(
        PlaceRequest(
            box, pick_pose(LAYOUT, box.size_mm, lies), 'A', tipped_goal(box, lies).decision.target
        )
    ).predicted_s
    bench.core.submit(tipped_goal(box, lies, deadline_s=time.time() + motion_s + 1.0))
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert report.code is ErrorCode.DEADLINE_UNREACHABLE
    assert 'the tray keeps it waiting for 2.00 s' in report.message


@pytest.mark.physics
@pytest.mark.parametrize('orientation', TURNED_OVER)
def test_physics_takes_a_tipped_box_by_the_face_that_is_up(tipping_arm, orientation):
    box = Box(f'box-{orientation}', SIZE, 3.0)
    place = TURNED_OVER.index(orientation)
    asked = request(orientation, box, centre=(0.2 + 0.25 * place, 0.25 if place % 2 else 0.55))
    told = Told()
    result = tipping_arm.execute(tipping_arm.plan(asked), told.hooks, threading.Event())
    assert (result.code, result.message) == (ErrorCode.NONE, '')
    assert told.steps == ['picked', 'releasing', 'released']
    assert corner_distance(result.measured, asked.target, metres(SIZE)) < 0.002
    assert turn_between(result.measured, asked.target) < math.radians(0.5)


@pytest.fixture(scope='module')
def tipping_arm():
    pytest.importorskip('pybullet')
    from arm_executor.arms.physics.arm import PhysicsArm

    arm = PhysicsArm()
    arm.set_bins(empty('A'), {})
    yield arm
    arm.close()
