"""The arm that only spends time."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import pytest
from executor_cases import LAYOUT, LDC, make_box, make_decision, pick_of

from arm_executor.arms.timed import FAULT_SHIFT_M, TimedArm
from arm_executor.model.arm_interface import (
    MotionError,
    MotionHooks,
    MotionUnderWay,
    PlaceRequest,
)
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, parse_bin

#: Where a box stands clear of the one that :func:`make_request` places by default.
BESIDE = Pose((0.6, 0.15, 0.075))


def make_request(number=1, station='A', target=None):
    box = make_box(number)
    return PlaceRequest(box, pick_of(box), station, target or make_decision(box).target)


def make_timed(*, speed=0.0, faults=None, spec=LDC):
    arm = TimedArm(LAYOUT, speed=speed, faults=faults)
    arm.set_bins([Bin(f'{s}-bin', 1, spec, station=s) for s in 'ABC'], {})
    return arm


class Calls:
    """Notes what the arm calls; ``at`` runs something at a call."""

    def __init__(self, at=None):
        self.names = []
        self.phases = []
        self._at = at or {}

    def hooks(self):
        return MotionHooks(
            phase=self._phase,
            picked=lambda: self._note('picked'),
            releasing=lambda: self._note('releasing'),
            released=lambda: self._note('released'),
        )

    def _phase(self, phase, fraction):
        if phase not in self.names:
            self.names.append(phase)
        self.phases.append((phase, fraction))
        self._at.get(phase, lambda: None)()

    def _note(self, name):
        self.names.append(name)
        self._at.get(name, lambda: None)()


def execute(arm, request, *, at=None, stop=None):
    calls = Calls(at)
    result = arm.execute(arm.plan(request), calls.hooks(), stop or threading.Event())
    return result, calls


def test_what_was_planned_is_what_is_spent_and_measured():
    arm = make_timed()
    request = make_request()
    planned = arm.plan(request)
    result, _ = execute(arm, request)
    assert result.code is ErrorCode.NONE
    assert result.motion_s == pytest.approx(planned.predicted_s)
    assert result.motion_s == pytest.approx(sum(result.split_s.values()))
    assert (result.measured, result.others, result.others_moved_m) == (request.target, {}, 0.0)


def test_a_place_that_is_taken_is_refused():
    arm = make_timed()
    execute(arm, make_request(1))
    with pytest.raises(MotionError, match='box-1') as caught:
        arm.plan(make_request(2))
    assert caught.value.code is ErrorCode.PATH_IN_COLLISION


def test_a_place_that_the_box_under_way_takes_is_refused():
    arm = make_timed()
    first = make_request(1)
    under_way = MotionUnderWay(arm.plan(first), first.target)
    with pytest.raises(MotionError, match='box-1'):
        arm.plan(make_request(2), under_way)
    assert arm.plan(make_request(2, target=BESIDE), under_way).predicted_s > 3.0


def test_a_place_that_the_arm_does_not_reach_is_refused():
    tall = parse_bin('LDC')
    arm = make_timed(spec=replace(tall, size_mm=(*tall.size_mm[:2], 2500.0)))
    with pytest.raises(MotionError) as caught:
        arm.plan(make_request(target=Pose((0.2, 0.2, 2.4))))
    assert caught.value.code is ErrorCode.NO_IK_SOLUTION


def test_hooks_come_in_order_and_progress_never_goes_back():
    _, calls = execute(make_timed(), make_request())
    assert calls.names == [
        Phase.APPROACHING,
        Phase.GRASPING,
        'picked',
        Phase.TRANSFERRING,
        Phase.LOWERING,
        'releasing',
        Phase.RELEASING,
        'released',
        Phase.RETREATING,
    ]
    fractions = [fraction for _, fraction in calls.phases]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)


def test_speed_divides_the_wall_clock_time():
    arm = make_timed(speed=20.0)
    started = time.monotonic()
    result, _ = execute(arm, make_request())
    taken_s = time.monotonic() - started
    assert 0.9 * result.motion_s / 20.0 < taken_s < result.motion_s / 4.0


@pytest.mark.parametrize('phase', [Phase.APPROACHING, Phase.TRANSFERRING, Phase.LOWERING])
def test_a_stop_ends_the_motion_at_once(phase):
    arm, stop = make_timed(speed=1.0), threading.Event()
    result, calls = execute(arm, make_request(), at={phase: stop.set}, stop=stop)
    assert result.code is ErrorCode.CANCELED
    assert calls.names[-1] is phase
    assert arm.holds() == (None if phase is Phase.APPROACHING else 'box-1')
    assert arm.return_to_belt() == (phase is not Phase.APPROACHING)
    assert arm.holds() is None


def test_a_stop_after_the_release_comes_too_late():
    arm, stop = make_timed(), threading.Event()
    result, _ = execute(arm, make_request(), at={'releasing': stop.set}, stop=stop)
    assert (result.code, arm.holds()) == (ErrorCode.NONE, None)


def test_the_other_boxes_of_the_bin_are_measured():
    arm = make_timed()
    execute(arm, make_request(1))
    result, _ = execute(arm, make_request(2, target=BESIDE))
    assert result.others == {'box-1': make_request(1).target}


@pytest.mark.parametrize(
    ('code', 'held'),
    [
        (ErrorCode.GRASP_FAILED, None),
        (ErrorCode.BOX_LOST, None),
        (ErrorCode.PATH_TOLERANCE_VIOLATED, 'box-1'),
        (ErrorCode.PROTECTIVE_STOP, 'box-1'),
    ],
)
def test_a_fault_ends_the_motion(code, held):
    arm = make_timed(faults={'box-1': code})
    result, calls = execute(arm, make_request())
    assert (result.code, arm.holds()) == (code, held)
    assert result.message
    assert ('picked' in calls.names) == (code is not ErrorCode.GRASP_FAILED)
    assert 'releasing' not in calls.names


def test_a_fault_shifts_a_box():
    arm = make_timed(faults={'box-2': ErrorCode.OTHERS_DISTURBED})
    execute(arm, make_request(1))
    result, _ = execute(arm, make_request(2, target=BESIDE))
    assert result.others_moved_m == FAULT_SHIFT_M
    assert result.others['box-1'].position[0] == pytest.approx(0.15 + FAULT_SHIFT_M)


def test_a_fault_of_planning_is_raised_with_its_code():
    arm = make_timed(faults={'box-1': ErrorCode.NO_IK_SOLUTION})
    with pytest.raises(MotionError) as caught:
        arm.plan(make_request())
    assert caught.value.code is ErrorCode.NO_IK_SOLUTION


def test_a_station_without_bin_is_named():
    with pytest.raises(MotionError, match="'D'"):
        make_timed().plan(make_request(station='D'))
