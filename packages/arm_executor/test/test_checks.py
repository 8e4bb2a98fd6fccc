"""check_placements while the arm moves, and what becomes of the plans; with the timed arm."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
from executor_cases import CELL, LDC, make_box, make_decision, make_goal, make_scan

from arm_executor.arms.timed import TimedArm
from arm_executor.bins.book import BookState
from arm_executor.bins.records import placed_of
from arm_executor.goals.admission import AdmissionState, admit
from arm_executor.goals.candidates import MAX_PLANNED, CandidateView, foresee
from arm_executor.goals.outputs import Finished, Progress, Replied
from arm_executor.model.arm_interface import MotionError
from pack_msgs_py.codes import ErrorCode, Mode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import resting_pose, with_measured
from pack_msgs_py.values import Bin

FIRST, SECOND, THIRD = make_box(1), make_box(2), make_box(3)
NEVER = make_box('never')


class Counting(TimedArm):
    """Notes what it was asked to plan; ``lies`` makes boxes rest elsewhere than they should."""

    def __init__(self, speed=1.0, lies_mm=0.0):
        super().__init__(speed=speed)
        self.asked = []
        self.unreachable = self.slow = ''
        self.lies_mm = lies_mm

    def plan(self, request, after=None):
        self.asked.append((request.box.id, after is not None))
        if request.box.id == NEVER.id:
            raise MotionError(ErrorCode.PATH_IN_COLLISION, 'a hole too narrow')
        return super().plan(request, after)

    def predict(self, request, after=None):
        if request.box.id == self.unreachable:
            raise MotionError(ErrorCode.NO_IK_SOLUTION, 'too far')
        if request.box.id == self.slow:
            return 99.0
        return super().predict(request, after)

    def _measured(self, request, fault, spent):
        result = super()._measured(request, fault, spent)
        x, y, z = request.target.position
        return replace(result, measured=Pose((x + self.lies_mm / 1e3, y, z)))


def check(bench, *decisions, enough_s=0.0):
    count = len(bench.of(Replied))
    bench.core.check(count, [make_goal(decision) for decision in decisions], enough_s)
    bench.wait(lambda: len(bench.of(Replied)) > count)
    return bench.of(Replied)[-1].answer


def carrying(bench, phase=Phase.TRANSFERRING):
    """FIRST is on its way into bin LDC-1, SECOND and THIRD lie on the belt."""
    bench.core.on_scan(make_scan(FIRST, stamp_s=time.time(), presented=FIRST.id))
    bench.core.submit(make_goal(make_decision(FIRST), deadline_s=time.time() + 60))
    bench.wait(lambda: any(progress.phase is phase for progress in bench.of(Progress)))
    bench.core.on_scan(make_scan(SECOND, THIRD, NEVER, stamp_s=time.time()))
    return bench


def finish(bench):
    bench.arm._speed = 0
    bench.wait(lambda: bench.of(Finished))
    assert bench.of(Finished)[0].report.code is ErrorCode.NONE


def beside(box, revision=2, corner=(300, 0, 0)):
    return make_decision(box, corner, revision=revision)


def place_second(bench):
    bench.core.on_scan(make_scan(SECOND, stamp_s=time.time(), presented=SECOND.id))
    bench.core.submit(make_goal(beside(SECOND), deadline_s=time.time() + 60, number=2))
    bench.wait(lambda: len(bench.of(Finished)) == 2)
    return bench.of(Finished)[1].report


def test_while_a_box_is_carried_candidates_are_judged_by_the_bins_to_come(make_core_bench):
    bench = carrying(make_core_bench(arm=Counting()))
    begun = time.monotonic()
    answers = check(
        bench,
        beside(SECOND),
        beside(SECOND, revision=1),
        make_decision(SECOND, (0, 0, 0), revision=2),
        beside(FIRST),
        make_decision(SECOND, (0, 0, 0), revision=1, bin_id='LDC-2', serial=2),
    )
    assert time.monotonic() - begun < 2.0, 'the arm still moves'
    assert bench.of(Finished) == []
    codes = [answer.code for answer in answers]
    assert codes[:2] == [ErrorCode.NONE, ErrorCode.STALE_BIN_REVISION]
    assert codes[2] is ErrorCode.RULE_VIOLATION and FIRST.id in answers[2].message
    assert codes[3] is ErrorCode.DUPLICATE_BOX
    assert codes[4] in (ErrorCode.NONE, ErrorCode.INVALID_GOAL)
    assert 2.0 < answers[0].motion_s < 10.0


def test_before_the_motion_has_begun_nobody_knows_what_will_be(make_core_bench):
    bench = make_core_bench(arm=Counting())
    bench.core.on_scan(make_scan(FIRST, SECOND, stamp_s=time.time()))
    bench.core.submit(make_goal(make_decision(FIRST), deadline_s=time.time() + 60))
    bench.wait(lambda: any(progress.phase is Phase.WAITING for progress in bench.of(Progress)))
    (answer,) = check(bench, beside(SECOND, revision=1))
    assert answer.code is ErrorCode.BUSY


def test_the_plan_made_ahead_serves_the_goal(make_core_bench):
    bench = carrying(make_core_bench(arm=Counting()))
    check(bench, beside(SECOND))
    finish(bench)
    report = place_second(bench)
    assert report.code is ErrorCode.NONE
    assert bench.arm.asked == [(FIRST.id, False), (SECOND.id, True)]
    assert report.planning_s < 0.5


@pytest.mark.parametrize(('lies_mm', 'anew'), [(1.9, False), (2.1, True)])
def test_a_plan_made_for_boxes_that_stand_elsewhere_is_made_anew(make_core_bench, lies_mm, anew):
    bench = carrying(make_core_bench(arm=Counting(lies_mm=lies_mm)))
    check(bench, beside(SECOND))
    finish(bench)
    place_second(bench)
    assert bench.arm.asked[2:] == [(SECOND.id, False)] * anew


def test_a_plan_that_starts_where_a_stopped_motion_would_have_ended_is_made_anew(make_core_bench):
    bench = carrying(make_core_bench(arm=Counting()))
    check(bench, beside(SECOND))
    bench.core.cancel(bytes([1] * 16))
    bench.wait(lambda: bench.of(Finished))
    bench.arm._speed = 0
    bench.core.on_scan(make_scan(SECOND, stamp_s=time.time(), presented=SECOND.id))
    decision = beside(SECOND, revision=1)
    bench.core.submit(make_goal(decision, deadline_s=time.time() + 60, number=2))
    bench.wait(lambda: len(bench.of(Finished)) == 2)
    assert bench.of(Finished)[1].report.code is ErrorCode.NONE
    assert bench.arm.asked[2:] == [(SECOND.id, False)]


def test_the_first_that_will_do_is_the_last_that_is_looked_at(make_core_bench):
    bench = make_core_bench(arm=Counting())
    bench.core.on_scan(make_scan(SECOND, THIRD, NEVER, stamp_s=time.time()))
    candidates = [beside(box, revision=1) for box in (NEVER, SECOND, THIRD)]
    codes = [answer.code for answer in check(bench, *candidates, enough_s=10.0)]
    assert codes == [ErrorCode.PATH_IN_COLLISION, ErrorCode.NONE, ErrorCode.BUSY]
    assert [box_id for box_id, _ in bench.arm.asked] == [NEVER.id, SECOND.id]
    codes = [answer.code for answer in check(bench, *candidates)]
    assert codes == [ErrorCode.PATH_IN_COLLISION, ErrorCode.NONE, ErrorCode.NONE]
    assert [box_id for box_id, _ in bench.arm.asked] == [NEVER.id, SECOND.id, THIRD.id], (
        'asked once each'
    )


def test_what_is_predicted_to_be_impossible_or_slow_is_not_planned(make_core_bench):
    bench = make_core_bench(arm=Counting())
    bench.core.on_scan(make_scan(FIRST, SECOND, THIRD, stamp_s=time.time()))
    bench.arm.unreachable = FIRST.id
    slow, quick = (beside(box, revision=1) for box in (SECOND, THIRD))
    bench.arm.slow = SECOND.id
    nowhere, late, answer = check(bench, make_decision(FIRST), slow, quick, enough_s=10.0)
    assert (nowhere.code, nowhere.motion_s) == (ErrorCode.NO_IK_SOLUTION, 0.0)
    assert (late.code, late.motion_s) == (ErrorCode.DEADLINE_UNREACHABLE, 99.0)
    assert nowhere.predicted and late.predicted and not answer.predicted
    assert answer.code is ErrorCode.NONE and 2.0 < answer.motion_s < 10.0
    assert [box_id for box_id, _ in bench.arm.asked] == [THIRD.id]


def test_only_so_many_motions_are_planned_in_one_request(make_core_bench):
    bench = make_core_bench(arm=Counting())
    boxes = [make_box(number) for number in range(1, MAX_PLANNED + 3)]
    bench.core.on_scan(make_scan(*boxes, stamp_s=time.time()))
    codes = [answer.code for answer in check(bench, *(beside(box, revision=1) for box in boxes))]
    assert codes == [ErrorCode.NONE] * MAX_PLANNED + [ErrorCode.BUSY] * 2


def test_candidates_for_a_bin_that_was_just_swapped_find_it_empty(make_core_bench):
    bench = make_core_bench(arm=Counting())
    bench.place(FIRST)
    bench.core.on_scan(make_scan(SECOND, stamp_s=time.time()))
    new = bench.core.swap('LDC-1', 2)
    fresh = make_decision(SECOND, revision=new.revision, bin_id=new.id, serial=new.serial)

    def answered():
        (answer,) = check(bench, fresh)
        assert answer.code in (ErrorCode.NONE, ErrorCode.BUSY)
        return answer.code is ErrorCode.NONE

    until = time.monotonic() + 5.0
    while not answered():
        assert time.monotonic() < until


def test_a_place_on_the_box_under_way_is_judged_by_where_that_will_rest():
    """Planner and executor expect it at the same height, though it was planned higher."""
    below = with_measured(placed_of(make_decision(THIRD)), Pose((0.15, 0.1, 0.072)))
    state = BookState(7, (Bin('LDC-1', 1, LDC, (below,), 'A', 3),), {THIRD.id: Pose()})
    state = replace(state, poses={THIRD.id: Pose((0.15, 0.1, 0.072))})

    def on_top_of(standing, box):
        """As the planner decides it: planned on planned tops, let go on expected ones."""
        decision = make_decision(box, (0, 0, standing[-1].top_mm), revision=2 + len(standing))
        rest = resting_pose(placed_of(decision), decision.target, standing)
        return replace(decision, target=rest)

    first = on_top_of([below], FIRST)
    expected = with_measured(placed_of(first), first.target)
    second = on_top_of([below, expected], SECOND)
    scan = make_scan(SECOND, stamp_s=100.0)
    view = CandidateView(
        AdmissionState(state, {THIRD.id}, CELL, scan, Mode.EXECUTING, FIRST.id, 100.0), tools=None
    )
    under_way = SimpleNamespace(goal=make_goal(first), plan='a motion')
    later = foresee(view, under_way, under_way=True)
    assert admit(make_goal(second), later.state) is None
    lifted = replace(second, target=make_decision(SECOND, second.corner_mm).target)
    assert admit(make_goal(lifted), later.state) is None
    x, y, z = second.target.position
    # the planner asked before that box was measured, 4 mm higher than it was scanned
    lower = replace(second, target=replace(second.target, position=(x, y, z - 0.004)))
    assert admit(make_goal(lower), later.state) is None
    sunk = replace(second, target=replace(second.target, position=(x, y, z - 0.010)))
    assert admit(make_goal(sunk), later.state).code is ErrorCode.RULE_VIOLATION
