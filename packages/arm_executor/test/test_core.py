"""How a placement ends when something goes wrong; the core with the timed arm, without ROS."""

from __future__ import annotations

import math
import time

import pytest
from core_bench import CoreBench
from executor_cases import make_box, make_decision, make_goal, make_scan, pick_of

from arm_executor.arms.timed import FAULT_SHIFT_M, TimedArm
from arm_executor.bins.book import BookError
from arm_executor.goals.outputs import BinsChanged, Failed, Finished, Happened, Replied
from pack_msgs_py.cell_values import MOTION_PLAN_S, Scan, ScannedBox
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.geometry.pose import Pose, about_z, quaternion_product, turn_between

BOX = make_box()


def test_a_failed_grasp_leaves_the_box_on_the_belt(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.GRASP_FAILED})
    report = bench.place(BOX)
    assert (report.code, bench.events(BOX), bench.boxes()) == (ErrorCode.GRASP_FAILED, [], [])
    assert bench.core.status().mode is Mode.IDLE
    assert report.motion_s > 0


def test_a_violated_path_brings_the_box_back_to_the_belt(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.PATH_TOLERANCE_VIOLATED})
    report = bench.place(BOX)
    assert report.code is ErrorCode.PATH_TOLERANCE_VIOLATED
    assert bench.events(BOX) == ['PICKED', 'RETURNED']
    assert bench.boxes() == []


def test_a_lost_box_is_told_and_its_bin_is_measured_again(make_core_bench):
    other = make_box(2)
    bench = make_core_bench(faults={BOX.id: ErrorCode.BOX_LOST})
    bench.place(other)
    before = bench.book.state
    report = bench.place(BOX, (300, 0, 0), revision=2)
    assert report.code is ErrorCode.BOX_LOST
    assert bench.events(BOX) == ['PICKED', 'LOST']
    assert bench.boxes() == [other.id]
    assert bench.book.state.bins[0].revision == before.bins[0].revision + 1
    assert bench.of(BinsChanged)[-1].state == bench.book.state


def test_a_box_out_of_place_is_in_the_bin_where_it_was_measured(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.PLACED_OUT_OF_TOLERANCE})
    report = bench.place(BOX)
    assert report.code is ErrorCode.PLACED_OUT_OF_TOLERANCE
    assert '20.0 mm' in report.message
    assert report.position_error_m == pytest.approx(FAULT_SHIFT_M)
    assert bench.events(BOX) == ['PICKED', 'PLACED']
    assert bench.book.state.bins[0].boxes[0].measured_mm[0] == pytest.approx(170.0)


def test_a_disturbed_neighbour_is_written_down_where_it_is(make_core_bench):
    other = make_box(2)
    bench = make_core_bench(faults={BOX.id: ErrorCode.OTHERS_DISTURBED})
    bench.place(other)
    report = bench.place(BOX, (300, 0, 0), revision=2)
    assert (report.code, report.others_moved_m) == (ErrorCode.OTHERS_DISTURBED, FAULT_SHIFT_M)
    assert '20.0 mm' in report.message
    assert bench.book.state.bins[0].boxes[0].measured_mm[0] == pytest.approx(170.0)


def test_a_late_box_is_in_the_bin_and_reported_late(make_core_bench):
    bench = make_core_bench(faults={BOX.id: ErrorCode.DEADLINE_MISSED})
    report = bench.place(BOX, in_s=5.5)
    assert (report.code, bench.boxes()) == (ErrorCode.DEADLINE_MISSED, [BOX.id])
    assert report.slack_s < -50
    assert report.slack_s == pytest.approx(5.5 - report.cycle_s, abs=1.0)


def test_a_deadline_that_is_not_enforced_is_reported_only(make_core_bench):
    bench = make_core_bench(enforce_deadline=False)
    report = bench.place(BOX, in_s=1.0)
    assert (report.code, bench.boxes()) == (ErrorCode.DEADLINE_MISSED, [BOX.id])


def test_as_fast_as_possible_a_goal_is_not_late_for_what_the_machine_took(make_core_bench):
    bench = make_core_bench(speed=0.0)
    now_s = time.time()
    bench.core.on_scan(make_scan(BOX, stamp_s=now_s, presented=BOX.id))
    goal = make_goal(make_decision(BOX), deadline_s=now_s - 60.0 + 5.5, sent_s=now_s - 60.0)
    bench.core.submit(goal)
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert (report.code, report.planning_s) == (ErrorCode.NONE, MOTION_PLAN_S)
    assert report.slack_s == pytest.approx(5.5 - report.cycle_s)


def test_at_any_other_speed_the_clock_makes_a_goal_late(make_core_bench):
    bench = make_core_bench(speed=1.0)
    now_s = time.time()
    bench.core.on_scan(make_scan(BOX, stamp_s=now_s, presented=BOX.id))
    goal = make_goal(make_decision(BOX), deadline_s=now_s - 54.5, sent_s=now_s - 60.0)
    bench.core.submit(goal)
    bench.wait(lambda: bench.of(Finished))
    assert bench.of(Finished)[0].report.code is ErrorCode.STALE_GOAL


def presented_at(pose):
    """A scan with the box at ``pose``, frame `cell`."""
    now_s = time.time()
    return Scan(1, now_s, (ScannedBox(BOX, pose, pick_open_s=now_s),))


class Asked(TimedArm):
    """Remembers the request that it carried out."""

    def execute(self, plan, hooks, stop):
        self.done = plan.request
        return super().execute(plan, hooks, stop)


@pytest.mark.parametrize('yaw_deg', [0.0, 30.0, -12.0, 90.0, 170.0])
@pytest.mark.parametrize('offset_m', [(0.0, 0.0), (0.05, 0.0), (-0.04, 0.06)])
def test_a_box_is_taken_where_and_as_the_scan_shows_it(make_core_bench, offset_m, yaw_deg):
    bench = make_core_bench(arm=Asked(speed=0.0))
    x, y, z = pick_of(BOX).position
    lean = quaternion_product((math.sin(0.01), 0.0, 0.0, math.cos(0.01)), about_z(0.0))
    yaw = about_z(math.radians(yaw_deg))
    centre = (x + offset_m[0], y + 0.1 + offset_m[1], z + 0.003)
    bench.core.on_scan(presented_at(Pose(centre, quaternion_product(yaw, lean))))
    bench.core.submit(make_goal(make_decision(BOX), deadline_s=time.time() + 60.0))
    bench.wait(lambda: bench.of(Finished))
    assert bench.of(Finished)[0].report.code is ErrorCode.NONE
    pick = bench.arm.done.pick
    assert pick.position == pytest.approx(centre)
    assert turn_between(pick, Pose(centre, yaw)) == pytest.approx(0.0, abs=1e-6), 'flat on the belt'


@pytest.mark.parametrize(
    ('pose', 'why'),
    [
        (Pose((0.30, 0.70, 0.825)), 'bins stand from 0.45 m'),
        (Pose((0.0, 1.60, 0.825)), 'its front is at y = 1.502 m'),
        (Pose((0.0, 0.55, 0.825)), 'its front is at y = 0.452 m'),
        (Pose((0.0, 0.70, 0.875)), 'its base is at z = 0.800 m'),
        (
            Pose((0.35, 0.70, 0.825), about_z(math.radians(25.0))),
            'turned by 25.0 and tilted by 0.0',
        ),
    ],
    ids=['beside the belt', 'far behind', 'over the head', 'above the belt', 'turned'],
)
def test_a_box_out_of_the_grippers_reach_is_not_grasped(make_core_bench, pose, why):
    bench = make_core_bench()
    bench.core.on_scan(presented_at(pose))
    bench.core.submit(make_goal(make_decision(BOX)))
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert report.code is ErrorCode.BOX_NOT_PRESENTED
    assert 'cannot be taken where the belt holds it' in report.message and why in report.message
    assert bench.events(BOX) == []


def test_a_box_that_leans_is_waited_for_and_the_angle_told(make_core_bench):
    bench = make_core_bench(present_timeout_s=0.2)
    lean = (math.sin(math.radians(10.0)), 0.0, 0.0, math.cos(math.radians(10.0)))
    bench.core.on_scan(presented_at(Pose(pick_of(BOX).position, lean)))
    bench.core.submit(make_goal(make_decision(BOX)))
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert report.code is ErrorCode.BOX_NOT_PRESENTED
    assert 'tilted by 20.0 degrees' in report.message


def test_wait_time_is_what_the_belt_still_needed_after_the_last_pick(make_core_bench):
    bench = make_core_bench()
    first = bench.place(make_box(2))
    assert first.wait_s == 0.0
    scan = make_scan(BOX, stamp_s=time.time(), presented=BOX.id)
    slow = type(scan.boxes[0])(BOX, scan.boxes[0].pose, pick_open_s=time.time(), travel_time_s=30.0)
    bench.core.on_scan(type(scan)(2, time.time(), (slow,)))
    bench.core.submit(make_goal(make_decision(BOX, (300, 0, 0), revision=2)))
    bench.wait(lambda: len(bench.of(Finished)) == 2)
    report = bench.of(Finished)[1].report
    after_pick_s = first.motion_s - 0.25
    assert 30.0 - after_pick_s - 1.0 < report.wait_s < 30.0
    assert report.cycle_s == pytest.approx(report.planning_s + report.motion_s)


def test_an_arm_that_fails_leaves_the_box_in_doubt_until_the_restart(tmp_path, make_core_bench):
    class Failing(TimedArm):
        def return_to_belt(self):
            raise RuntimeError('no power')

    arm = Failing(speed=0.0, faults={BOX.id: ErrorCode.PATH_TOLERANCE_VIOLATED})
    bench = CoreBench(arm=arm, folder=tmp_path)
    report = bench.place(BOX)
    assert report.code is ErrorCode.UNKNOWN
    assert 'no power' in report.message
    assert bench.events(BOX) == ['PICKED', 'UNKNOWN']
    status = bench.core.status()
    assert (status.mode, 'restart' in status.message) == (Mode.FAULT, True)
    assert bench.place(make_box(2)).code is ErrorCode.NOT_ACTIVE
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert again.events(BOX) == ['PICKED', 'UNKNOWN', 'RETURNED']
    assert again.place(BOX).code is ErrorCode.NONE


def test_a_journal_that_cannot_be_written_stops_the_arm(make_core_bench):
    class Breaking(TimedArm):
        def plan(self, request, after=None):
            bench.journal._db.execute('PRAGMA query_only = ON')
            return super().plan(request)

    bench = make_core_bench(arm=Breaking(speed=0.0))
    report = bench.place(BOX)
    assert report.code is ErrorCode.UNKNOWN
    assert 'cannot write journal' in report.message
    assert (bench.events(BOX), bench.arm.holds()) == ([], None)
    assert bench.core.status().mode is Mode.FAULT


def test_a_swap_that_cannot_be_written_is_refused(make_core_bench):
    bench = make_core_bench()
    bench.journal._db.execute('PRAGMA query_only = ON')
    with pytest.raises(BookError, match='cannot write journal'):
        bench.core.swap('LDC-1', 0)
    assert bench.core.status().mode is Mode.FAULT
    assert [bin_.id for bin_ in bench.book.state.bins] == ['LDC-1', 'LDC-2']


def test_a_box_that_cannot_be_returned_needs_a_person(make_core_bench):
    class KeepingArm(TimedArm):
        stuck = True

        def return_to_belt(self):
            return not self.stuck and super().return_to_belt()

    arm = KeepingArm(speed=0.0, faults={BOX.id: ErrorCode.PATH_TOLERANCE_VIOLATED})
    bench = make_core_bench(arm=arm)
    assert bench.place(BOX).code is ErrorCode.PROTECTIVE_STOP
    status = bench.core.status()
    assert (status.mode, status.active_box) == (Mode.PROTECTIVE_STOP, BOX.id)
    bench.core.reset('first')
    bench.wait(lambda: len(bench.of(Replied)) == 1)
    assert not bench.of(Replied)[0].answer[0]
    arm.stuck = False
    bench.core.reset('second')
    bench.wait(lambda: len(bench.of(Replied)) == 2)
    assert bench.of(Replied)[1].answer[0]
    assert bench.events(BOX) == ['PICKED', 'RETURNED']
    assert bench.core.status().mode is Mode.IDLE


def test_an_arm_that_cannot_be_built_is_told():
    def no_arm():
        raise ImportError('no PyBullet here')

    bench = CoreBench(start=False)
    bench.core._make_arm = no_arm
    bench.core.start()
    bench.wait(lambda: bench.of(Failed))
    assert 'no PyBullet here' in bench.of(Failed)[0].text
    bench.end()


def test_a_measured_pose_may_be_lower_than_planned_by_what_was_rounded_up(make_core_bench):
    """Planned heights are rounded up; a stack of many such boxes is lower than planned."""

    class Sinking(TimedArm):
        def _measured(self, request, fault, spent):
            result = super()._measured(request, fault, spent)
            x, y, z = request.target.position
            layer = round((z - 0.0753) / 0.151)
            sunk = type(request.target)((x, y, 0.0752 + 0.1504 * layer))
            self._bins.poses[request.station][request.box.id] = sunk
            return type(result)(
                result.code,
                '',
                result.motion_s,
                sunk,
                self._bins.poses[request.station],
                0.0,
                result.split_s,
            )

    bench = make_core_bench(arm=Sinking(speed=0.0))
    for layer in range(5):
        box = make_box(layer, (296.0, 196.0, 150.4))
        report = bench.place(box, (0, 0, 151 * layer), revision=layer + 1)
        assert (report.code, report.message) == (ErrorCode.NONE, '')


def test_events_and_bins_are_repeated_after_a_restart(tmp_path, make_core_bench):
    bench = CoreBench(folder=tmp_path)
    bench.place(BOX)
    told = [output.event for output in bench.of(Happened)]
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert [output.event for output in again.of(Happened)] == told
    assert again.boxes() == [BOX.id]
    assert again.book.state.revision > bench.book.state.revision


def test_ending_in_motion_leaves_the_arm_still_and_the_box_to_the_next_start(
    tmp_path, make_core_bench
):
    bench = CoreBench(arm=TimedArm(speed=1.0), folder=tmp_path)
    bench.core.on_scan(make_scan(BOX, stamp_s=time.time(), presented=BOX.id))
    bench.core.submit(make_goal(make_decision(BOX)))
    bench.wait(lambda: bench.events(BOX) == ['PICKED'])
    bench.end()
    assert bench.of(Finished) == []
    again = make_core_bench(folder=tmp_path)
    assert again.events(BOX) == ['PICKED', 'RETURNED']
