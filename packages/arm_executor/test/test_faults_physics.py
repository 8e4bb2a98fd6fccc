"""Every fault of a placement, provoked in physics: its code, where the box is, and an arm at rest.

docs/operations.md says what is done about each.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from core_bench import CoreBench
from executor_cases import CELL, LAYOUT, LDC, make_box, make_decision, make_goal, make_scan, pick_of

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.goals.outputs import Finished, Progress, Replied
from arm_executor.model.layout import bin_frame
from arm_executor.motion.task import hover_point
from pack_msgs_py.codes import ErrorCode, Mode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box

pytestmark = pytest.mark.physics

BOX = make_box()
FRAME = bin_frame(LAYOUT, 'A', LDC)
#: Slower joints count as still, m/s and rad/s.
STILL = 0.01


class PhysicsBench(CoreBench):
    """A core with the arm that really moves; ``when`` is done, once, as a phase begins.

    Nobody stands by: alarms acknowledge themselves.
    """

    def __init__(self, arm=None, **options):
        self.when = {}
        super().__init__(arm=arm or PhysicsArm(LAYOUT), acknowledges_itself=True, **options)

    def _hear(self, output):
        # On the arm's thread, so that what is done to the world is done between two steps.
        act = self.when.pop(output.phase, None) if isinstance(output, Progress) else None
        if act is not None:
            act()
        super()._hear(output)

    def in_cell(self, decision):
        return FRAME.to_cell(decision.target)

    def assert_arm_is_still(self):
        world = self.arm.world
        before, speed = world.joint_state()
        assert np.abs(speed).max() < STILL
        world.step(60)
        after, speed = world.joint_state()
        assert np.abs(speed).max() < STILL
        assert np.abs(after - before).max() < STILL

    def reset(self):
        self.core.reset('reset')
        self.wait(lambda: self.of(Replied))
        return self.of(Replied)[-1].answer


@pytest.fixture
def make_bench():
    made = []

    def make(**options):
        made.append(PhysicsBench(**options))
        return made[-1]

    yield make
    for bench in made:
        bench.end()


@pytest.fixture
def bench(make_bench):
    return make_bench()


# -- refused before anything moves ----------------------------------------------------------------


def assert_nothing_moved(bench):
    assert bench.events(BOX) == []
    assert bench.arm.world.boxes == {}
    assert np.abs(bench.arm.world.joint_state()[1]).max() < STILL


def test_a_pose_out_of_reach_is_refused(make_bench):
    short = replace(LAYOUT, rail=replace(LAYOUT.rail, x_min=0.4, x_max=0.6))
    bench = make_bench(arm=PhysicsArm(short))
    report = bench.place(BOX)
    assert report.code is ErrorCode.NO_IK_SOLUTION, report.message
    assert 'nowhere on its rail' in report.message
    assert_nothing_moved(bench)


def test_a_box_that_is_too_heavy_is_refused(bench):
    heavy = replace(BOX, weight_kg=23.0)
    report = bench.place(heavy)
    assert report.code in (ErrorCode.LIMITS_EXCEEDED, ErrorCode.RULE_VIOLATION), report.message
    assert '23' in report.message
    assert_nothing_moved(bench)


def test_joints_that_are_not_where_the_motion_starts_are_noticed_and_believed(bench):
    arm = bench.arm
    q, _ = arm.world.joint_state()
    pushed = q.copy()
    pushed[1] += 0.06
    arm.world.put_arm(pushed)
    report = bench.place(BOX)
    assert report.code is ErrorCode.START_STATE_INVALID
    assert 'shoulder_pan_joint is 0.06' in report.message
    assert bench.events(BOX) == []
    assert bench.place(BOX).code is ErrorCode.NONE


def test_a_late_scan_is_no_reason_to_move(bench):
    bench.core.on_scan(make_scan(BOX, stamp_s=time.time() - 6.0, presented=BOX.id))
    bench.core.submit(make_goal(make_decision(BOX)))
    bench.wait(lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert report.code is ErrorCode.BOX_NOT_ON_BELT
    assert '6.0 s old' in report.message
    assert_nothing_moved(bench)


def test_a_box_that_never_comes_is_given_up(make_bench):
    bench = make_bench(present_timeout_s=0.2)
    bench.core.on_scan(make_scan(BOX, stamp_s=time.time()))
    bench.core.submit(make_goal(make_decision(BOX)))
    bench.wait(lambda: bench.of(Finished))
    assert bench.of(Finished)[0].report.code is ErrorCode.BOX_NOT_PRESENTED
    assert_nothing_moved(bench)


# -- noticed in motion ----------------------------------------------------------------------------


def assert_arm_waits(bench):
    """The pad is over the pick point, above every box that may come there."""
    place, waits = bench.arm.world.tool_pose().position, hover_point(LAYOUT)
    assert place == pytest.approx(waits, abs=0.02)


def test_a_box_that_slips_off_is_lost_and_the_next_one_is_placed(bench):
    bench.when[Phase.LOWERING] = bench.arm.gripper._part
    report = bench.place(BOX)
    assert report.code is ErrorCode.BOX_LOST
    assert 'mm' in report.message and 'it now touches' in report.message
    assert bench.events(BOX) == ['PICKED', 'LOST']
    assert_arm_waits(bench)
    bench.assert_arm_is_still()
    assert bench.core.status().mode is Mode.IDLE
    assert bench.place(make_box(2), revision=2).code is ErrorCode.NONE


def test_a_box_that_is_too_heavy_to_lift_stays_on_the_belt_and_is_scanned_again(bench):
    bench.when[Phase.APPROACHING] = lambda: bench.arm.present(
        replace(BOX, weight_kg=70.0), pick_of(BOX)
    )
    report = bench.place(BOX)
    assert report.code is ErrorCode.BOX_MISMATCH, report.message
    assert 'it stands on the belt where it was' in report.message
    assert bench.events(BOX) == ['PICKED', 'RETURNED']
    assert_arm_waits(bench)
    assert bench.place(make_box(2)).code is ErrorCode.NONE


def lay_ghost(bench, height_mm):
    """A box that no model knows of, where BOX is to go; it comes while the arm carries that."""
    ghost = Box('ghost', (250.0, 180.0, height_mm), 8.0)
    x, y, _ = bench.in_cell(make_decision(BOX)).position
    place = Pose((x, y, FRAME.origin[2] + height_mm / 2000 + 0.001))
    bench.when[Phase.TRANSFERRING] = lambda: bench.arm.world.add_box(ghost, place)


@pytest.mark.parametrize('height_mm', [20.0, 120.0])
def test_a_box_that_the_model_does_not_know_is_felt_and_the_held_one_brought_back(bench, height_mm):
    lay_ghost(bench, height_mm)
    report = bench.place(BOX)
    assert report.code is ErrorCode.COLLISION, report.message
    assert 'pressed on box ghost with' in report.message
    assert bench.events(BOX) == ['PICKED', 'RETURNED']
    bench.assert_arm_is_still()
    bench.arm.world.remove_box('ghost')
    assert bench.place(BOX).code is ErrorCode.NONE


def test_an_arm_that_runs_into_something_stops_before_it_pushes(bench):
    from arm_executor.model.layout import Block

    def appear():
        x, y, _ = bench.arm.world.tool_pose().position
        wall = Block('ghost', (x - 0.5, y - 0.3, 0.6), (x - 0.4, 1.5, 2.4))
        bench.arm.world.add_part('ghost', (wall,))

    bench.when[Phase.TRANSFERRING] = appear
    report = bench.place(BOX)
    assert report.code in (ErrorCode.COLLISION, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert 'look what is in the way' in report.message
    assert bench.events(BOX)[0] == 'PICKED'
    bench.assert_arm_is_still()


def test_joints_without_the_strength_for_their_path_stop(bench):
    world = bench.arm.world
    strong = world._torques

    def weaken():
        world._torques = [force * 0.02 for force in strong]

    bench.when[Phase.APPROACHING] = weaken
    report = bench.place(BOX)
    assert report.code in (ErrorCode.PATH_TOLERANCE_VIOLATED, ErrorCode.COLLISION)
    assert bench.events(BOX) == []


@pytest.mark.parametrize('phase', [Phase.APPROACHING, Phase.TRANSFERRING, Phase.LOWERING])
def test_a_protective_stop_leaves_the_arm_still_and_the_box_in_the_gripper(bench, phase):
    bench.when[phase] = lambda: bench.core.protective_stop('a person came in')
    report = bench.place(BOX)
    assert report.code is ErrorCode.PROTECTIVE_STOP
    bench.assert_arm_is_still()
    held = phase is not Phase.APPROACHING
    assert bench.arm.holds() == (BOX.id if held else None)
    assert bench.core.status().mode is Mode.PROTECTIVE_STOP
    success, text = bench.reset()
    assert success, text
    bench.assert_arm_is_still()
    assert bench.events(BOX) == ['PICKED', 'RETURNED'] * held
    assert bench.place(BOX).code is ErrorCode.NONE


# -- noticed afterwards ---------------------------------------------------------------------------


def test_a_box_that_does_not_stay_upright_is_measured_where_it_lies(make_bench):
    careless = replace(CELL, com_margin_mm=None, min_support_share=0.0, stability_margin_mm=None)
    bench = make_bench(profile=careless)
    for number, (size, corner) in enumerate(
        [((296.0, 196.0, 150.0), (0, 0, 0)), ((196.0, 196.0, 150.0), (0, 200, 0))], 1
    ):
        box = make_box(number, size)
        assert bench.place(box, corner, revision=number).code is ErrorCode.NONE
    top = Box('top', (296.0, 396.0, 120.0), 2.0, (110.0, 150.0, 0.0))
    report = bench.place(top, (0, 0, 150), revision=3)
    assert report.code is ErrorCode.PLACED_OUT_OF_TOLERANCE, report.message
    assert 'degrees away from where it should' in report.message
    assert bench.events(top) == ['PICKED', 'PLACED']
    placed = bench.book.state.bins[0].boxes[-1]
    assert (placed.box.id, placed.measured_mm is not None) == ('top', True)
    bench.assert_arm_is_still()


def test_a_box_that_was_pushed_aside_meanwhile_is_reported_where_it_is(bench):
    other = make_box(2)
    assert bench.place(other).code is ErrorCode.NONE
    x, y, z = bench.arm.world.pose(other.id).position
    bench.when[Phase.RETREATING] = lambda: bench.arm.world.move_box(
        other.id, Pose((x, y + 0.006, z))
    )
    report = bench.place(BOX, (300, 0, 0), revision=2)
    assert report.code is ErrorCode.OTHERS_DISTURBED
    assert '6.0 mm' in report.message
