"""Boxes that are not what was scanned: how the timed arm meets them, and what it remembers."""

from __future__ import annotations

import math
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from executor_cases import CELL, LAYOUT, LDC, make_box, make_decision, make_goal, pick_of

from arm_executor.arms.timed import TimedArm
from arm_executor.arms.true_boxes import TrueBox, Truth, mismatch
from arm_executor.bins.records import placed_of
from arm_executor.goals.arm_request import aside_in_bin, far_side_m, request_of
from arm_executor.goals.judging import expected_rest, judge
from arm_executor.goals.placement_errors import commanded_pose_errors
from arm_executor.model.arm_interface import MotionHooks, MotionResult, PlaceRequest
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, about_z
from pack_msgs_py.geometry.resting import resting_pose
from pack_msgs_py.geometry.tolerance import Tolerance
from pack_msgs_py.orientation import QUATERNIONS, TIPPED, oriented_size
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin

BOX = make_box()


def true_box(size_mm=BOX.size_mm, *, weight_kg=BOX.weight_kg, aside_m=0.0, yaw=0.0):
    box = replace(BOX, size_mm=size_mm, weight_kg=weight_kg)
    x, y, z = pick_of(box).position
    return TrueBox(box, Pose((x + aside_m, y, z), (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))))


def place(true, orientation='xyz'):
    """Place BOX while it really is ``true``; the result, and whether it was picked."""
    truth, steps = Truth(), []
    truth.update([true])
    arm = TimedArm(LAYOUT, speed=0.0, truth=truth)
    arm.set_bins([Bin('LDC-1', 1, LDC)], {})
    target = make_decision(BOX, orientation=orientation).target
    request = PlaceRequest(BOX, pick_of(BOX), 'A', target)
    hooks = MotionHooks(
        phase=lambda *_: None,
        picked=lambda: steps.append('picked'),
        releasing=lambda: None,
        released=lambda: None,
    )
    return arm.execute(arm.plan(request), hooks, threading.Event()), 'picked' in steps, arm


def test_a_box_that_is_as_scanned_rests_where_it_should():
    result, picked, _ = place(true_box())
    assert (result.code, picked) == (ErrorCode.NONE, True)
    assert result.measured == make_decision(BOX).target


def test_the_base_of_a_higher_box_and_the_front_of_a_deeper_one_are_where_they_were_seen():
    target = make_decision(BOX).target
    x, y, z = BOX.size_mm
    result, _, _ = place(true_box((x, y + 4.0, z + 6.0)))
    off = [1e3 * (a - b) for a, b in zip(result.measured.position, target.position, strict=True)]
    assert off == pytest.approx([0.0, 2.0, 3.0])


def test_what_lay_askew_on_the_belt_rests_askew_and_turned_with_the_box():
    target = make_decision(BOX, orientation='yxz').target
    x, y, z = BOX.size_mm
    result, _, _ = place(true_box((x, y + 4.0, z), yaw=0.01), orientation='yxz')
    off = [1e3 * (a - b) for a, b in zip(result.measured.position, target.position, strict=True)]
    assert [abs(edge) for edge in off] == pytest.approx([2.0, 0.0, 0.0], abs=1e-9)
    dot = sum(a * b for a, b in zip(result.measured.quaternion, target.quaternion, strict=True))
    assert 2 * math.acos(min(1.0, abs(dot))) == pytest.approx(0.01)


@pytest.mark.parametrize('orientation', ['xyz', 'yxz'])
@pytest.mark.parametrize('off_mm', [(4.0, 4.0), (4.0, -4.0), (-4.0, 4.0), (0.0, 6.0)])
def test_a_box_that_is_not_as_large_as_scanned_keeps_to_its_reserved_space(orientation, off_mm):
    """It lies in the middle of the belt and against the guide: its depth grows on one side."""
    box = replace(BOX, size_mm=(292.0, 192.0, 150.0), size_stddev_mm=(2.0, 2.0, 2.0))
    x, y, z = box.size_mm
    really = true_box((x + off_mm[0], y + off_mm[1], z))
    really = replace(really, pose=pick_of(really.box))
    decision = make_decision(box, (100, 200, 0), orientation=orientation)
    request = request_of(make_goal(decision), 'A', None, CELL.size_sigmas)
    truth = Truth()
    truth.update([really])
    arm = TimedArm(LAYOUT, speed=0.0, truth=truth)
    arm.set_bins([Bin('LDC-1', 1, LDC)], {})
    hooks = MotionHooks(lambda *_: None, *(lambda: None,) * 3)
    result = arm.execute(arm.plan(request), hooks, threading.Event())
    size = oriented_size(really.box.size_mm, orientation)
    for axis in (0, 1):
        centre_mm = 1e3 * result.measured.position[axis]
        low, high = decision.corner_mm[axis], decision.corner_mm[axis] + decision.size_mm[axis]
        assert low <= centre_mm - size[axis] / 2
        assert centre_mm + size[axis] / 2 <= high
    aside = aside_in_bin(box, pick_of(box), decision.target, CELL.size_sigmas)
    for way in (1.0, -1.0):
        turned = tuple(way * part for part in aside)
        expected = expected_rest(decision.target, turned, result.measured)
        placed = placed_of(decision)
        judged = judge(
            result, placed, expected, Tolerance(), size_sigmas=CELL.size_sigmas, slack_s=1.0
        )
        assert judged == (ErrorCode.NONE, '')


@pytest.mark.parametrize(
    ('sigma_mm', 'yaw_rad', 'far_mm'),
    [(2.0, 0.0, 2.0), (0.0, 0.01, 0.0), (2.0, 0.01, 0.90), (0.0, 0.0, 0.0)],
)
def test_what_a_box_may_lie_askew_is_kept_on_either_side(sigma_mm, yaw_rad, far_mm):
    box = replace(
        BOX,
        size_mm=(300.0, 200.0, 150.0),
        size_stddev_mm=(sigma_mm,) * 3,
        yaw_stddev_rad=yaw_rad,
    )
    target = make_decision(box).target
    far_m = far_side_m(box, pick_of(box), target, 2.0)
    assert 1000 * far_m == pytest.approx(far_mm, abs=0.01)
    near_mm = math.hypot(sigma_mm, 300 * yaw_rad) - 1000 * far_m
    askew_mm = 150 * yaw_rad
    if sigma_mm and yaw_rad:
        beyond_mm = near_mm + 2000 * far_m
        assert near_mm / askew_mm == pytest.approx(beyond_mm / math.hypot(sigma_mm, askew_mm))


def test_a_box_taken_by_its_front_is_taken_where_it_was_scanned():
    box = replace(BOX, size_stddev_mm=(2.0, 2.0, 2.0))
    assert far_side_m(box, pick_of(box), Pose((0.2, 0.2, 0.1), QUATERNIONS['xzy']), 2.0) == 0.0
    assert far_side_m(box, pick_of(box), Pose((0.2, 0.2, 0.1), QUATERNIONS['yxz']), 2.0) == 0.002


def test_what_rests_farther_off_than_scanner_and_tolerance_allow_is_out_of_place():
    box = replace(BOX, size_stddev_mm=(2.0, 2.0, 2.0))
    decision = make_decision(box)
    allowed_m = 0.005 + 2.0 * math.hypot(2.0, 2.0, 2.0) / 2e3
    for off_m, code in (
        (allowed_m - 1e-4, ErrorCode.NONE),
        (allowed_m + 1e-4, ErrorCode.PLACED_OUT_OF_TOLERANCE),
    ):
        x, y, z = decision.target.position
        rests = Pose((x + off_m, y, z), decision.target.quaternion)
        result = MotionResult(ErrorCode.NONE, measured=rests)
        judged, _ = judge(
            result, placed_of(decision), decision.target, Tolerance(), size_sigmas=2.0, slack_s=1.0
        )
        assert judged is code


@pytest.mark.parametrize('yaw_stddev', [0.0, 0.005])
def test_what_rests_more_askew_than_scanner_and_tolerance_allow_is_out_of_place(yaw_stddev):
    decision = make_decision(replace(BOX, yaw_stddev_rad=yaw_stddev))
    allowed = Tolerance().angle_rad + 2.0 * yaw_stddev
    wide = Tolerance(position_m=0.1)
    for angle, code in (
        (allowed - 1e-4, ErrorCode.NONE),
        (allowed + 1e-4, ErrorCode.PLACED_OUT_OF_TOLERANCE),
    ):
        rests = replace(decision.target, quaternion=about_z(angle))
        result = MotionResult(ErrorCode.NONE, measured=rests)
        judged, _ = judge(
            result, placed_of(decision), decision.target, wide, size_sigmas=2.0, slack_s=1.0
        )
        assert judged is code


def test_a_pad_that_finds_no_box_gets_no_vacuum():
    result, picked, arm = place(true_box(aside_m=0.6))
    assert (result.code, picked, arm.holds()) == (ErrorCode.GRASP_FAILED, False, None)


def test_the_arm_meets_a_box_as_it_lies_on_the_tray_though_that_is_told_behind_the_scan():
    truth, flat = Truth(), true_box()
    tipped = Pose(flat.pose.position, QUATERNIONS[TIPPED['y']])
    truth.update([flat])
    with ThreadPoolExecutor(1) as threads:
        met = threads.submit(truth.lying, BOX.id, tipped)
        truth.update([TrueBox(flat.box, tipped)])
        assert met.result().pose == tipped
    assert truth.lying('another', tipped) is None


@pytest.mark.parametrize(
    ('true', 'words'),
    [
        (true_box(weight_kg=1.2), 'weighs 1.20 kg in the gripper, the scan says 3.00 kg'),
        (true_box((220.0, 196.0, 150.0)), 'measures 220 mm along x in the gripper'),
    ],
)
def test_a_box_that_is_not_what_was_scanned_is_kept_in_the_gripper(true, words):
    result, picked, arm = place(true)
    assert (result.code, picked, arm.holds()) == (ErrorCode.BOX_MISMATCH, True, BOX.id)
    assert words in result.message


def test_noise_of_the_scanner_is_no_mismatch():
    x, y, z = BOX.size_mm
    assert mismatch(BOX, replace(BOX, size_mm=(x + 14, y, z), weight_kg=3.3)) == ''
    noisy = replace(BOX, size_stddev_mm=(4.0, 4.0, 4.0))
    assert mismatch(noisy, replace(BOX, size_mm=(x + 30, y, z))) == ''
    assert 'along x' in mismatch(BOX, replace(BOX, size_mm=(x + 30, y, z)))


def test_a_picked_box_is_remembered_over_a_restart_until_its_bin_has_gone(tmp_path):
    true = true_box((300.0, 200.0, 151.0))
    truth = Truth(tmp_path)
    truth.update([true])
    truth.picked(BOX.id)
    truth.update([])
    again = Truth(tmp_path)
    assert again.find(BOX.id) == truth.find(BOX.id) == true
    assert again.box(BOX).size_mm == (300.0, 200.0, 151.0)
    again.keep({'another'})
    assert Truth(tmp_path).find(BOX.id) is None
    assert again.box(BOX) == BOX


def test_a_placement_may_rest_on_tops_as_they_were_measured_but_nowhere_else():
    """Scanned heights are off by millimetres; a stack stands that much higher or lower."""
    profile = PROFILES['cell']
    below = replace(placed_of(make_decision(BOX)), measured_mm=(150.0, 100.0, 78.0))
    decision = make_decision(make_box(2), (0, 0, below.top_mm))
    x, y, z = decision.target.position

    def errors(lifted_mm):
        target = replace(decision.target, position=(x, y, z + lifted_mm / 1e3))
        return commanded_pose_errors(placed_of(decision), target, profile, [below])

    assert errors(0.0) == errors(3.0) == []
    assert errors(9.0) == errors(-6.0) == []
    assert len(errors(11.0)) == len(errors(-8.0)) == 1


def test_a_placement_may_be_where_planner_and_executor_expect_it_to_rest():
    """A box that was planned too low to carry was measured above the one that was to carry."""
    profile = PROFILES['cell']
    carrying = replace(placed_of(make_decision(make_box(1))), measured_mm=(150.0, 100.0, 75.0))
    lower = make_box(2, (296.0, 196.0, 146.0))
    beside = replace(placed_of(make_decision(lower, (300, 0, 0))), measured_mm=(450.0, 100.0, 82.0))
    decision = make_decision(make_box(3), (20, 0, carrying.top_mm))
    placed = replace(placed_of(decision), size_mm=(400, 200, 150))
    placed = replace(placed, box=replace(placed.box, size_mm=(396.0, 196.0, 150.0)))
    centre = Pose((0.22, 0.1, 0.0))
    rest = resting_pose(placed, centre, [carrying, beside])
    assert rest.position[2] == pytest.approx((155.0 + 75.0) / 1e3)
    assert commanded_pose_errors(placed, rest, profile, [carrying, beside]) == []


def test_true_boxes_of_release_0_1_are_read(tmp_path):
    old = Path(__file__).parent / 'data' / 'true_boxes_of_0_1.json'
    shutil.copy(old, tmp_path / 'true_boxes.json')
    true = Truth(tmp_path).find('ö "1"')
    assert (true.box.size_mm, true.box.extra) == ((300.5, 200.25, 100.0), (('row', '7'),))
    assert true.pose == Pose((0.01, 0.65, 0.8), (0.0, 0.0, 0.6, 0.8))


def test_a_list_of_true_boxes_that_is_damaged_is_named_with_what_to_do(tmp_path):
    (tmp_path / 'true_boxes.json').write_text('[{"box": {"id": "a"}}]')
    with pytest.raises(
        ValueError, match=r'true_boxes\.json cannot be used: .* lacks size_mm.* move'
    ):
        Truth(tmp_path)
