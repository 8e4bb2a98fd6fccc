"""The arm with a driver, against a robot that behaves as one of Universal Robots does."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('control_msgs')
pytest.importorskip('ur_msgs')
pytest.importorskip('ur_dashboard_msgs')
pytest.importorskip('pybullet')
pytest.importorskip('toppra')

import rclpy
from executor_cases import make_box, make_decision
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from ur_dashboard_msgs.msg import SafetyMode

from arm_executor.arms.kind import ArmSetup
from arm_executor.arms.trajectory.arm import TrajectoryArm
from arm_executor.arms.trajectory.parameters import TrajectoryParameters
from arm_executor.goals.condition import trouble_of
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout, LayoutError
from arm_executor.model.robot_data import find_robot
from arm_executor.motion.timing import Load, MotionLimits, Timing
from arm_executor.ros.node import ArmExecutor
from arm_executor.ros.robot_link import RosRobotLink
from arm_executor.ros.robot_motion import RobotMotion, TrajectoryPart
from pack_msgs.action import PlaceBox
from pack_msgs.msg import ExecutorState
from pack_msgs_py.codes import ErrorCode

pytestmark = [pytest.mark.ros, pytest.mark.physics]

FIXED = replace(Layout(), rail=replace(Layout().rail, x_min=0.0, x_max=0.0))
BOX = make_box()
UR20 = find_robot('ur20')
PHASE = PlaceBox.Feedback


@pytest.fixture
def robot_of(spinners):
    """Make the robot; it is spun by a thread of its own."""
    from fake_robot import FakeRobot, home_of

    from pack_msgs_py.ros.testing import Spinner

    spinner = Spinner()

    def make(layout=FIXED, **arguments):
        robot = FakeRobot(home_of(layout), context=spinner.context, **arguments)
        servers = [controller.server for controller in robot.controllers]
        spinner.add(robot, lambda: [server.destroy() for server in servers])
        return robot

    yield make
    spinner.close()


@pytest.fixture
def cell(spinners, make_bench, robot_of, tmp_path):
    """Start robot and executor; the bench that talks to the executor has the robot as `robot`."""

    def start(*, robot=None, ready=True, rail=(0.0, 0.0), **parameters):
        layout = replace(FIXED, rail=replace(FIXED.rail, x_min=rail[0], x_max=rail[1]))
        made = robot_of(layout, **{'speed': 4.0, **(robot or {})})
        path = tmp_path / 'layout.yaml'
        path.write_text(f'rail:\n  x_min: {rail[0]}\n  x_max: {rail[1]}\n')
        values = {
            'arm': 'trajectory',
            'speed': 4.0,
            'layout': str(path),
            'bin_type': 'EQ',
            **{name.replace('__', '.'): value for name, value in parameters.items()},
        }
        node = ArmExecutor(
            context=spinners[0].context,
            parameter_overrides=[Parameter(key, value=value) for key, value in values.items()],
        )
        spinners[0].add(node, node.stop_motion)
        bench = make_bench()
        bench.robot, bench.executor = made, node
        return bench.ready() if ready else bench

    return start


def begin(bench, box=BOX, *, in_s=60.0, **arguments):
    """Show ``box`` at the pick point and send its goal; the handle."""
    bench.show(box, presented=box.id)
    decision = make_decision(box, bin_id='EQ-1', **arguments)
    return bench.send(bench.goal_msg(decision, deadline_in_s=in_s))


def place(bench, box=BOX, **arguments):
    return bench.result(begin(bench, box, **arguments))[1]


def reset(bench):
    return bench.call('reset', Trigger.Request())


def seconds(duration):
    return duration.sec + 1e-9 * duration.nanosec


def slide(bench, share):
    """Set the speed slider, and wait until the executor has heard of it."""
    bench.robot.scaling = share
    link = bench.executor._core._tools.arm._link
    bench.wait(lambda: link.speed_scaling() == pytest.approx(share), 'the speed slider')


def test_a_box_is_placed_by_the_driver_and_measured_by_the_joints(cell):
    bench = cell()
    result = place(bench)
    assert (result.error_code, result.error_msg) == (ErrorCode.NONE, '')
    assert result.report.position_error < 0.003
    assert bench.events(BOX.id) == ['PICKED', 'PLACED']
    robot = bench.robot
    assert robot.outputs == {0: False}
    masses = [mass for mass, _ in robot.payloads]
    tool = FIXED.tool.mass
    assert masses == pytest.approx([tool, tool + BOX.weight_kg, tool])
    for goal in robot.controllers[0].goals:
        assert len(goal.trajectory.joint_names) == 6
        assert {one.position for one in goal.goal_tolerance} == {0.01}
        assert all(one.velocity > 0 for one in goal.goal_tolerance)
    again = place(bench, make_box(2), corner_mm=(300, 0, 0), revision=2)
    assert again.error_code == ErrorCode.NONE, again.error_msg


@pytest.mark.parametrize('kind', ['scaled', 'passthrough'])
def test_a_cancelled_box_goes_back_to_the_belt(cell, kind):
    controller = {'scaled': 'scaled_joint', 'passthrough': 'passthrough'}[kind]
    bench = cell(
        robot={'kind': kind},
        trajectory__controller=f'{controller}_trajectory_controller',
        trajectory__stop_by='ramp' if kind == 'scaled' else 'cancel',
    )
    handle = begin(bench)
    bench.wait_phase(PHASE.PHASE_TRANSFERRING)
    bench.cancel(handle)
    result = bench.result(handle)[1]
    assert result.error_code == ErrorCode.CANCELED, result.error_msg
    assert bench.events(BOX.id) == ['PICKED', 'RETURNED']
    assert bench.robot.outputs[0] is False
    assert place(bench).error_code == ErrorCode.NONE


def test_a_stop_is_a_trajectory_that_the_load_bears(cell):
    heavy = make_box(size_mm=(396.0, 296.0, 250.0), weight_kg=15.0)
    bench = cell(robot={'speed': 1.0}, speed=1.0)
    handle = begin(bench, heavy)
    bench.wait_phase(PHASE.PHASE_LOWERING)
    bench.cancel(handle)
    assert bench.result(handle)[1].error_code == ErrorCode.CANCELED
    _, carried, ramp, back, *_ = bench.robot.controllers[0].goals
    assert back.trajectory.points[-1] != ramp.trajectory.points[-1]
    times = [seconds(point.time_from_start) for point in ramp.trajectory.points]
    assert len(times) < len(carried.trajectory.points) and times[-1] < 1.5
    assert not any(ramp.trajectory.points[-1].velocities)
    q = np.array([[0.0, *point.positions] for point in ramp.trajectory.points])
    pad = CellKinematics(find_robot('ur20'), FIXED).tool(q)[:, :3, 3]
    load = Load(15.0, (0.396, 0.296, 0.25))
    directions, most = Timing(find_robot('ur20'), FIXED, MotionLimits()).tool_limits(load)
    assert (np.diff(pad, 2, axis=0) / 0.02**2 @ directions.T <= most * 1.1 + 0.2).all()


def test_a_controller_that_is_busy_ends_the_goal_before_anything_moves(cell):
    bench = cell(
        robot={'kind': 'passthrough'},
        trajectory__controller='passthrough_trajectory_controller',
        trajectory__stop_by='cancel',
    )
    bench.robot.controllers[0].active = False
    result = place(bench)
    assert result.error_code == ErrorCode.START_STATE_INVALID
    assert 'refused the trajectory' in result.error_msg
    assert bench.events(BOX.id) == []


def test_a_joint_off_its_path_ends_the_motion_and_the_box_goes_back(cell):
    bench = cell()
    handle = begin(bench)
    bench.wait_phase(PHASE.PHASE_TRANSFERRING)
    bench.robot.push('elbow_joint', 0.3)
    bench.wait(lambda: bench.robot.controllers[0].running is None, 'the abort')
    bench.robot.push('elbow_joint', 0.0)
    result = bench.result(handle)[1]
    assert result.error_code == ErrorCode.PATH_TOLERANCE_VIOLATED
    assert 'path tolerance violation' in result.error_msg
    assert bench.events(BOX.id) == ['PICKED', 'RETURNED']


def test_the_speed_slider_counts_towards_time_and_deadline(cell):
    bench = cell()
    full = seconds(place(bench).report.motion_time)
    slide(bench, 0.5)
    second = place(bench, make_box(2), corner_mm=(300, 0, 0), revision=2)
    slow = seconds(second.report.motion_time)
    assert 1.6 * full < slow < 2.4 * full
    slide(bench, 0.1)
    result = place(bench, make_box(3), corner_mm=(0, 300, 0), revision=3, in_s=3.0)
    assert result.error_code == ErrorCode.DEADLINE_UNREACHABLE


def test_a_slider_at_zero_ends_motion_and_way_back_and_the_box_stays_in_the_gripper(
    cell, monkeypatch
):
    monkeypatch.setattr('arm_executor.arms.trajectory.following.STALLED_S', 0.5)
    bench = cell(watchdog_s=1.0)
    handle = begin(bench)
    bench.wait_phase(PHASE.PHASE_TRANSFERRING)
    slide(bench, 0.0)
    result = bench.result(handle)[1]
    assert result.error_code == ErrorCode.PROTECTIVE_STOP
    assert 'no progress' in result.error_msg and 'speed slider at zero' in result.error_msg
    assert bench.robot.holds()
    slide(bench, 1.0)
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert reset(bench).success
    assert bench.events(BOX.id) == ['PICKED', 'RETURNED']


def test_a_protective_stop_waits_for_the_robot_and_for_a_person(cell):
    bench = cell()
    handle = begin(bench)
    bench.wait_phase(PHASE.PHASE_TRANSFERRING)
    bench.robot.protective_stop()
    result = bench.result(handle)[1]
    assert result.error_code == ErrorCode.PROTECTIVE_STOP
    assert 'safety mode PROTECTIVE_STOP' in result.error_msg
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert bench.robot.holds()
    refused = reset(bench)
    assert not refused.success and 'make the robot ready first' in refused.message
    bench.robot.unlock()
    bench.wait(lambda: not trouble_of(bench.executor._core._tools), 'a robot that is ready')
    assert reset(bench).success
    assert bench.events(BOX.id) == ['PICKED', 'RETURNED']
    assert not bench.robot.holds()
    bench.wait_mode(ExecutorState.MODE_IDLE)
    assert place(bench).error_code == ErrorCode.NONE


def test_a_robot_that_stops_while_nothing_is_done_is_noticed(cell):
    bench = cell()
    bench.robot.set_modes(safety=SafetyMode.ROBOT_EMERGENCY_STOP)
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert 'ROBOT_EMERGENCY_STOP' in bench.of('executor_state')[-1].message


def test_a_robot_that_is_off_at_the_start_is_waited_for(cell):
    bench = cell(robot={'running': False}, ready=False)
    bench.wait_mode(ExecutorState.MODE_PROTECTIVE_STOP)
    assert 'External Control' in bench.of('executor_state')[-1].message
    bench.robot.unlock()
    bench.wait(lambda: not trouble_of(bench.executor._core._tools), 'a robot that is ready')
    assert reset(bench).success
    bench.wait_mode(ExecutorState.MODE_IDLE)
    assert place(bench).error_code == ErrorCode.NONE


def test_a_lost_vacuum_is_a_lost_box(cell):
    bench = cell()
    handle = begin(bench)
    bench.wait_phase(PHASE.PHASE_TRANSFERRING)
    bench.robot.lose_vacuum()
    result = bench.result(handle)[1]
    assert result.error_code == ErrorCode.BOX_LOST
    assert 'the vacuum was lost after' in result.error_msg
    assert bench.events(BOX.id) == ['PICKED', 'LOST']
    assert bench.robot.controllers[0].running is None


def test_an_arm_whose_pad_holds_something_at_the_start_does_not_begin(robot_of, spinners):
    robot = robot_of()
    robot._switch(True)
    robot._vacuum_at -= 1.0
    node = rclpy.create_node('executor', context=spinners[0].context)
    link = RosRobotLink(node, TrajectoryParameters(), 0.0, 1.0, UR20)
    spinners[0].add(node, link.close)
    with pytest.raises(MotionError, match='the vacuum holds something'):
        TrajectoryArm(ArmSetup(FIXED, link=link))


def test_a_box_that_the_pad_does_not_get_stays_on_the_belt(cell):
    bench = cell(trajectory__grip_timeout_s=0.3)
    bench.robot.has_box = False
    result = place(bench)
    assert result.error_code == ErrorCode.GRASP_FAILED
    assert 'no vacuum builds up' in result.error_msg
    assert bench.events(BOX.id) == []
    bench.robot.has_box = True
    assert place(bench).error_code == ErrorCode.NONE


def test_a_gripper_of_another_kind_is_switched_and_read(cell):
    bench = cell(trajectory__vacuum_service='vacuum', trajectory__vacuum_topic='vacuum_holds')
    assert place(bench).error_code == ErrorCode.NONE
    assert bench.robot.outputs == {}


@pytest.mark.parametrize('seven', [False, True])
def test_a_rail_is_a_second_controller_or_a_seventh_joint(cell, seven):
    own = 'scaled_joint_trajectory_controller' if seven else 'rail_controller'
    bench = cell(
        robot={'rail': 0.0, 'seven': seven}, rail=(-2.4, 2.4), trajectory__rail_controller=own
    )
    result = place(bench)
    assert result.error_code == ErrorCode.NONE, result.error_msg
    goals = [goal for controller in bench.robot.controllers for goal in controller.goals]
    moved = [
        np.ptp([point.positions[goal.trajectory.joint_names.index('rail_joint')]
                for point in goal.trajectory.points])
        for goal in goals if 'rail_joint' in goal.trajectory.joint_names
    ]  # fmt: skip
    assert max(moved) > 0.1


def test_a_rail_does_not_slow_down_with_the_arm_so_neither_may_be_slowed(cell):
    bench = cell(
        robot={'rail': 0.0}, rail=(-2.4, 2.4), trajectory__rail_controller='rail_controller'
    )
    slide(bench, 0.5)
    result = place(bench)
    assert result.error_code == ErrorCode.START_STATE_INVALID
    assert 'set the speed slider to 100 %' in result.error_msg


def test_arm_and_rail_out_of_step_are_both_cancelled():
    parts, asked = [TrajectoryPart(['rail_joint']), TrajectoryPart(['a', 'b'])], []
    for part, at_s in zip(parts, (1.0, 0.7), strict=True):
        part.feedback = (time.monotonic(), at_s)
        part.handle = type('Handle', (), {'cancel_goal_async': lambda self: asked.append(self)})()
    motion = RobotMotion(parts, 3.0, 1.0, lambda: 1.0)
    assert not motion.wait(0.0)
    assert asked == [part.handle for part in parts]
    code, text = motion.outcome()
    assert code is ErrorCode.PATH_TOLERANCE_VIOLATED and 'out of step' in text


def test_a_rail_that_nobody_moves_is_named():
    with pytest.raises(LayoutError, match=r'no trajectory.rail_controller moves it'):
        TrajectoryArm(ArmSetup(Layout(), link=object()))


def test_a_robot_has_its_own_speed():
    with pytest.raises(ValueError, match='give speed 1'):
        TrajectoryArm(ArmSetup(FIXED, speed=0.0, link=object()))


def test_a_driver_that_is_not_there_is_named(spinners):
    node = rclpy.create_node('lonely', context=spinners[0].context)
    link = RosRobotLink(node, TrajectoryParameters(connect_timeout_s=1.0), 0.0, 1.0, UR20)
    spinners[0].add(node, link.close)
    with pytest.raises(MotionError, match=r'follow_joint_trajectory is not there after 1 s: start'):
        link.connect()


def test_parameters_of_a_kind_are_checked_like_all_others(spinners):
    with pytest.raises(ValueError, match=r"unknown parameter 'trajectory.kontroller'"):
        ArmExecutor(
            context=spinners[0].context,
            parameter_overrides=[
                Parameter('arm', value='trajectory'),
                Parameter('trajectory.kontroller', value='x'),
            ],
        )
