"""Each reason to refuse a goal without motion, with its code and its numbers."""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

import pytest
from executor_cases import CELL, LDC, make_box, make_decision, make_goal, make_scan

from arm_executor.bins.book import BookState
from arm_executor.bins.records import placed_of
from arm_executor.goals.admission import AdmissionState, admit
from arm_executor.goals.placement_errors import orientation_error
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import ORIENTATIONS, QUATERNIONS
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin

NOW_S = 1000.0
BOX = make_box()
GOAL = make_goal(make_decision(BOX), deadline_s=NOW_S + 5.5)


def situation(*, placed=(), boxes=(BOX,), age_s=0.1, **changes):
    bins = BookState(1, (Bin('LDC-1', 1, LDC, tuple(placed), 'A', 1), Bin('LDC-2', 2, LDC)))
    bins = replace(bins, poses={placed_box.box.id: Pose() for placed_box in placed})
    values = {
        'bins': bins,
        'ids_in_bins': {placed_box.box.id for placed_box in placed},
        'profile': CELL,
        'scan': make_scan(*boxes, stamp_s=NOW_S - age_s, sequence=12),
        'mode': Mode.IDLE,
        'busy_with': '',
        'now_s': NOW_S,
        **changes,
    }
    return AdmissionState(**values)


def with_decision(**changes):
    return replace(GOAL, decision=replace(GOAL.decision, **changes))


def with_box(**changes):
    return with_decision(box=replace(BOX, **changes))


def at(x, y, z, quaternion=(0.0, 0.0, 0.0, 1.0)):
    return with_decision(target=Pose((x, y, z), quaternion))


def test_a_good_goal_is_admitted():
    assert admit(GOAL, situation()) is None


INVALID = {
    'nan in the target': (at(math.nan, 0.1, 0.1), 'placement.pose.position.x is nan'),
    'nan in the pick': (replace(GOAL, pick=Pose((0.0, math.inf, 0.0))), 'pick_pose.position.y'),
    'nan deadline': (replace(GOAL, deadline_s=math.nan), 'deadline is nan'),
    'empty id': (with_box(id=''), "box id ''"),
    'weight': (with_box(weight_kg=0.0), 'weight is 0 kg'),
    'unknown bin': (with_decision(bin_id='LDC-9'), "'LDC-9'; open are LDC-1, LDC-2"),
    'frame': (replace(GOAL, frame_id='bin_b'), "is 'bin_b'; it must be 'bin_a'"),
    'pick frame': (replace(GOAL, pick_frame='world'), "is 'world'; it must be 'cell'"),
    'quaternion': (at(0.15, 0.1, 0.075, (0, 0, 0, 2.0)), 'length 2.0000'),
    'outside': (at(0.05, 0.1, 0.075), 'x -98.0 to 198.0 mm, outside'),
    'size': (with_decision(size_mm=(200, 200, 150)), 'planned_size.x is 200 mm'),
    'orientation': (with_decision(orientation='zzz'), "'zzz' must be one of"),
}


@pytest.mark.parametrize('name', INVALID)
def test_values_that_cannot_be_used(name):
    goal, text = INVALID[name]
    refusal = admit(goal, situation())
    assert refusal.code is ErrorCode.INVALID_GOAL
    assert text in refusal.message


LATER = {
    'STALE_BIN_REVISION': [
        (with_decision(bin_revision=3), situation(), 'at revision 1, the goal quotes 3')
    ],
    'BUSY': [(GOAL, situation(busy_with='box-8', mode=Mode.EXECUTING), "'box-8'")],
    'NOT_ACTIVE': [
        (GOAL, situation(mode=Mode.INACTIVE), 'mode INACTIVE'),
        (GOAL, situation(mode=Mode.PROTECTIVE_STOP), 'mode PROTECTIVE_STOP'),
        (GOAL, situation(mode=Mode.FAULT), 'mode FAULT'),
    ],
    'DUPLICATE_BOX': [
        (GOAL, situation(placed=[placed_of(make_decision(BOX, (400, 0, 0)))]), "bin 'LDC-1'"),
        (GOAL, situation(ids_in_bins={BOX.id}), 'a closed bin'),
    ],
    'BOX_NOT_ON_BELT': [
        (GOAL, situation(scan=None), 'no box_scan has come'),
        (GOAL, situation(age_s=7.0), '7.0 s old, at most 5 s'),
        (GOAL, situation(boxes=[make_box(4)]), 'scan 12, which holds box-4'),
        (
            GOAL,
            situation(boxes=[make_box(1, (299.0, 196.0, 150.0))]),
            'size x is 299 mm in scan 12 and 296 mm in the goal',
        ),
    ],
    'RULE_VIOLATION': [
        (make_goal(make_decision(BOX, (0, 0, 200))), situation(), 'breaks support'),
        (at(0.18, 0.1, 0.075), situation(), 'pose.x is 180.0 mm'),
        (
            at(0.15, 0.1, 0.1, (0.0, 0.0, math.sin(0.1), math.cos(0.1))),
            situation(),
            '11.5 degrees',
        ),
        (
            GOAL,
            situation(placed=[placed_of(make_decision(make_box(2)))]),
            "shares space with box 'box-2'",
        ),
    ],
    'STALE_GOAL': [(replace(GOAL, deadline_s=NOW_S - 1.25), situation(), '1.25 s before')],
}


@pytest.mark.parametrize(
    ('code', 'goal', 'seen', 'text'),
    [(code, *case) for code, cases in LATER.items() for case in cases],
)
def test_goals_that_do_not_fit_the_situation(code, goal, seen, text):
    refusal = admit(goal, seen)
    assert refusal.code.name == code
    assert text in refusal.message


def test_the_first_reason_in_the_order_of_the_codes_wins():
    """Everything is wrong at once; mended one by one the next code comes up."""
    placed = [placed_of(make_decision(make_box(2)))]
    goal = replace(with_decision(bin_revision=9), frame_id='', deadline_s=0.0)
    wrong = {
        'placed': placed,
        'ids_in_bins': {BOX.id},
        'busy_with': 'box-7',
        'mode': Mode.FAULT,
        'boxes': [],
    }
    mend = [
        ('INVALID_GOAL', {'frame_id': 'bin_a'}, None),
        ('STALE_BIN_REVISION', {'decision': GOAL.decision}, None),
        ('BUSY', {}, 'busy_with'),
        ('NOT_ACTIVE', {}, 'mode'),
        ('DUPLICATE_BOX', {}, 'ids_in_bins'),
        ('BOX_NOT_ON_BELT', {}, 'boxes'),
        ('RULE_VIOLATION', {}, 'placed'),
        ('STALE_GOAL', {'deadline_s': NOW_S + 5}, None),
    ]
    for code, better_goal, better_situation in mend:
        assert admit(goal, situation(**wrong)).code.name == code
        goal = replace(goal, **better_goal)
        wrong.pop(better_situation, None)
    assert admit(goal, situation(**wrong)) is None


def test_a_box_planned_up_to_the_rim_may_stand_as_far_above_it_as_tops_are_off_from_their_plan():
    height_mm = LDC.size_mm[2]
    carrying = replace(
        placed_of(make_decision(make_box(2, (296.0, 196.0, height_mm - 150.0)))),
        measured_mm=(152.0, 102.0, (height_mm - 150.0) / 2),
    )
    decision = make_decision(BOX, (0, 0, int(height_mm) - 150))
    for above_mm, admitted in ((4.9, True), (5.1, False)):
        stands = replace(carrying, measured_mm=(152.0, 102.0, (height_mm - 150.0) / 2 + above_mm))
        x, y, z = decision.target.position
        raised = replace(decision, target=Pose((x, y, z + above_mm / 1e3)))
        refusal = admit(make_goal(raised), situation(placed=[stands]))
        assert (refusal is None) is admitted, refusal


def test_candidates_need_no_deadline():
    late = replace(GOAL, deadline_s=0.0)
    assert admit(late, situation(), with_deadline=False) is None


def test_a_pose_may_differ_from_the_plan_by_the_resolution():
    paper = PROFILES['paper']
    decision = make_decision(BOX, profile=paper)
    x, y, z = decision.target.position
    for shift, admitted in ((0.0099, True), (0.0111, False)):
        goal = make_goal(replace(decision, target=Pose((x + shift, y, z))))
        assert (admit(goal, situation(profile=paper)) is None) is admitted


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_an_axis_may_point_either_way(orientation):
    x, y, z, w = QUATERNIONS[orientation]
    half_turn_about_vertical = (-y, x, w, -z)
    assert orientation_error(QUATERNIONS[orientation], orientation) < 1e-6
    assert orientation_error(half_turn_about_vertical, orientation) < 1e-6
    other = 'zxy' if orientation != 'zxy' else 'xyz'
    assert orientation_error(QUATERNIONS[orientation], other) > 0.7


@pytest.mark.no_cover
def test_admission_takes_under_a_millisecond_with_fifty_boxes_in_the_bin():
    placed = [
        placed_of(
            make_decision(make_box(2 + n), (300 * (n % 4), 200 * (n // 4 % 3), n // 12 * 150))
        )
        for n in range(48)
    ]
    top = make_goal(make_decision(BOX, (0, 0, 600)), deadline_s=NOW_S + 1)
    seen = situation(placed=placed)
    assert admit(top, seen) is None
    times = []
    measuring_branches = sys.gettrace()
    sys.settrace(None)
    try:
        for _ in range(50):
            started = time.thread_time()  # of this thread alone, whatever else runs beside it
            admit(top, seen)
            times.append(time.thread_time() - started)
    finally:
        sys.settrace(measuring_branches)
    assert min(times) < 1e-3
