"""A robot with its driver as the cell meets them, without the robot.

It behaves as the controllers of Universal Robots on Jazzy do: `scaled` takes a new trajectory in
place of the one that runs, holds still where it is when that is cancelled, aborts on tolerances and
runs as fast as the speed slider says; `passthrough` refuses while it is busy, says nothing
meanwhile and, when the robot gives up, aborts with code 0. A protective stop stops the program, and
with it the trajectory. The vacuum builds up while there is a box.

`python fake_robot.py FIXED_X SPEED [KIND]` runs one until it is killed.
"""

from __future__ import annotations

import bisect
import sys
import threading
import time

import numpy as np
import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import SetBool
from ur_dashboard_msgs.msg import RobotMode, SafetyMode
from ur_msgs.msg import Digital, IOStates
from ur_msgs.srv import SetIO, SetPayload

from arm_executor.model.robot_data import JOINT_NAMES

LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
TICK_S = 0.01
#: Every so many ticks a running trajectory says how far it is.
FEEDBACK_EVERY = 5
VACUUM_S = 0.1
#: What `stopj` of the robot does about, rad/s2.
STOP_ACCELERATION = 4.0
RESULT = FollowJointTrajectory.Result


class Running:
    """A trajectory that is being followed, cubic between its points."""

    def __init__(self, handle, names, start, speed):
        trajectory = handle.request.trajectory
        order = [trajectory.joint_names.index(name) for name in names]
        seconds = [
            point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
            for point in trajectory.points
        ]
        at, going = (
            [[getattr(point, what)[i] for i in order] for point in trajectory.points]
            for what in ('positions', 'velocities')
        )
        self.times = [0.0, *seconds]
        self.q = np.vstack([start, at])
        self.qd = np.vstack([speed, going])
        self.handle, self.at_s, self.done = handle, 0.0, Future()
        self.tolerance = {one.name: one.position for one in handle.request.path_tolerance}

    def sample(self):
        row = min(max(bisect.bisect_right(self.times, self.at_s) - 1, 0), len(self.times) - 2)
        span = self.times[row + 1] - self.times[row]
        u = min(1.0, (self.at_s - self.times[row]) / span)
        (a, b), (va, vb) = self.q[row : row + 2], self.qd[row : row + 2]
        q = a + u * u * (3 - 2 * u) * (b - a) + span * u * (1 - u) * ((1 - u) * va - u * vb)
        return q, va + (vb - va) * u


class Controller:
    """One controller of some joints; ``kind`` is 'scaled' or 'passthrough'."""

    def __init__(self, node, name, joints, kind='scaled'):
        self.node, self.joints, self.kind = node, list(joints), kind
        self.running, self.goals, self.active = None, [], True
        self.ticks = 0
        self.stopping = None
        self.server = ActionServer(
            node,
            FollowJointTrajectory,
            f'{name}/follow_joint_trajectory',
            self._execute,
            goal_callback=self._admit,
            handle_accepted_callback=self._accepted,
            cancel_callback=self._cancel,
        )

    def _admit(self, goal):
        names = list(goal.trajectory.joint_names)
        tolerances = goal.goal_tolerance
        seconds = [
            point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
            for point in goal.trajectory.points
        ]
        wrong = (
            not self.active
            or sorted(names) != sorted(self.joints)
            or not seconds
            or any(b <= a for a, b in zip([0.0, *seconds], seconds, strict=False))
            or (tolerances and sorted(one.name for one in tolerances) != sorted(self.joints))
            or (self.kind == 'passthrough' and self.running is not None)
        )
        self.goals.append(goal)
        return GoalResponse.REJECT if wrong else GoalResponse.ACCEPT

    def _accepted(self, handle):
        start, speed = self.node.state(self.joints)
        if self.running is not None:
            self._end('canceled', RESULT.SUCCESSFUL, 'cancelled due to new incoming action')
        self.running, self.stopping = Running(handle, self.joints, start, speed), None
        handle.execute()

    async def _execute(self, handle):
        running = self.running
        how, code, text = await running.done
        if how == 'canceled' and not handle.is_cancel_requested:
            # Only rclpy insists that a goal is cancelled on request.
            how = 'abort'
        getattr(handle, how)()
        return RESULT(error_code=code, error_string=text)

    def _cancel(self, handle):
        if self.running is not None and self.running.handle == handle:
            _, speed = self.node.state(self.joints)
            if self.kind == 'passthrough':
                self.stopping = speed
            else:
                self.node.hold(self.joints)
            self._end('canceled', RESULT.SUCCESSFUL, '')
        return CancelResponse.ACCEPT

    def abort(self, code, text):
        """Give up, for whatever reason."""
        self.node.hold(self.joints)
        if self.running is not None:
            self._end('abort', code, text)

    def _end(self, how, code, text):
        running, self.running = self.running, None
        running.done.set_result((how, code, text))

    def tick(self, dt):
        """Let ``dt`` of the trajectory's time pass."""
        if self.stopping is not None:
            self._brake(dt)
        running = self.running
        if running is None or dt <= 0:
            return
        running.at_s = min(running.at_s + dt, running.times[-1])
        q, qd = running.sample()
        self.node.move(self.joints, q, qd)
        actual, _ = self.node.state(self.joints)
        error = np.abs(actual - q)
        worst = int(error.argmax())
        self.ticks += 1
        if error[worst] > running.tolerance.get(self.joints[worst], 0.2):
            self.abort(RESULT.PATH_TOLERANCE_VIOLATED, 'Aborted due to path tolerance violation')
        elif running.at_s >= running.times[-1]:
            self.node.hold(self.joints)
            self._end('succeed', RESULT.SUCCESSFUL, 'Goal successfully reached!')
        elif self.kind == 'scaled' and self.ticks % FEEDBACK_EVERY == 0:
            feedback = FollowJointTrajectory.Feedback(joint_names=self.joints)
            feedback.desired.time_from_start.sec = int(running.at_s)
            feedback.desired.time_from_start.nanosec = int(running.at_s % 1 * 1e9)
            running.handle.publish_feedback(feedback)

    def _brake(self, dt):
        slower = np.maximum(np.abs(self.stopping) - STOP_ACCELERATION * dt, 0.0)
        q, _ = self.node.state(self.joints)
        self.stopping = np.sign(self.stopping) * slower
        self.node.move(self.joints, q + self.stopping * dt, self.stopping)
        if not slower.any():
            self.stopping = None


class FakeRobot(rclpy.node.Node):
    """The node of a driver; what it is told is kept, and what happens is asked for.

    ``start`` are the six joints at the beginning, ``rail`` is where a rail of its own stands;
    ``speed`` is robot seconds per wall-clock second, ``urdf`` how it describes itself.
    """

    def __init__(
        self,
        start,
        *,
        kind='scaled',
        rail=None,
        speed=1.0,
        context=None,
        seven=False,
        running=True,
        urdf=None,
    ):
        super().__init__('fake_robot', context=context)
        names = list(JOINT_NAMES) + (['rail_joint'] if rail is not None else [])
        values = [*start, *([rail] if rail is not None else [])]
        self.q = dict(zip(names, map(float, values), strict=True))
        self.qd = dict.fromkeys(names, 0.0)
        self.pushed = dict.fromkeys(names, 0.0)
        self.speed, self.scaling = speed, 1.0
        self.has_box, self.leaks = True, False
        self.outputs, self.payloads, self.path = {}, [], []
        self._vacuum, self._vacuum_at = False, time.monotonic()
        controller = f'{kind}_trajectory_controller'.replace('scaled', 'scaled_joint')
        arm = [*JOINT_NAMES, 'rail_joint'] if seven else JOINT_NAMES
        self.controllers = [Controller(self, controller, arm, kind)]
        if rail is not None and not seven:
            self.controllers.append(Controller(self, 'rail_controller', ['rail_joint']))
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._scaling = self.create_publisher(
            Float64, 'speed_scaling_state_broadcaster/speed_scaling', 10
        )
        status = 'io_and_status_controller'
        self._io = self.create_publisher(IOStates, f'{status}/io_states', 10)
        self._holds = self.create_publisher(Bool, 'vacuum_holds', 10)
        self._robot_mode = self.create_publisher(RobotMode, f'{status}/robot_mode', LATCHED)
        self._safety_mode = self.create_publisher(SafetyMode, f'{status}/safety_mode', LATCHED)
        self._running = self.create_publisher(Bool, f'{status}/robot_program_running', LATCHED)
        self.create_service(SetIO, f'{status}/set_io', self._set_io)
        self.create_service(SetPayload, f'{status}/set_payload', self._set_payload)
        self.create_service(SetBool, 'vacuum', self._set_bool)
        self._urdf = self.create_publisher(String, 'robot_description', LATCHED)
        self._urdf.publish(String(data=described() if urdf is None else urdf))
        self.set_modes(running=running)
        self._last = time.monotonic()
        self.create_timer(TICK_S, self._tick)

    # -- what a test does to it

    def set_modes(self, safety=SafetyMode.NORMAL, robot=RobotMode.RUNNING, running=True):
        self._safety_mode.publish(SafetyMode(mode=safety))
        self._robot_mode.publish(RobotMode(mode=robot))
        self._running.publish(Bool(data=running))

    def protective_stop(self):
        """The robot stops by itself: program and trajectory with it."""
        self.set_modes(safety=SafetyMode.PROTECTIVE_STOP, running=False)
        for controller in self.controllers:
            controller.active = False
            controller.abort(0, 'Aborting current goal, since the controller is deactivated.')

    def unlock(self):
        """A person has looked: go on."""
        for controller in self.controllers:
            controller.active = True
        self.set_modes()

    def lose_vacuum(self):
        self.leaks = True

    def push(self, joint, by):
        """Something pushes a joint aside for good."""
        self.pushed[joint] = by

    # -- what controllers do with it

    def state(self, joints):
        return (
            np.array([self.q[name] + self.pushed[name] for name in joints]),
            np.array([self.qd[name] for name in joints]),
        )

    def move(self, joints, q, qd):
        for name, position, speed in zip(joints, q, qd, strict=True):
            self.q[name], self.qd[name] = float(position), float(speed)

    def hold(self, joints):
        for name in joints:
            self.qd[name] = 0.0

    # -- the driver

    def _set_io(self, request, response):
        self.outputs[request.pin] = bool(request.state)
        if request.pin == 0:
            self._switch(bool(request.state))
        response.success = request.fun == SetIO.Request.FUN_SET_DIGITAL_OUT
        return response

    def _set_bool(self, request, response):
        self._switch(request.data)
        response.success = True
        return response

    def _switch(self, on):
        self._vacuum, self._vacuum_at, self.leaks = on, time.monotonic(), False

    def holds(self):
        """Whether the vacuum holds: it builds up, and goes, after a while."""
        settled = time.monotonic() - self._vacuum_at > VACUUM_S / self.speed
        wanted = self._vacuum and self.has_box and not self.leaks
        return wanted if settled or self.leaks else not self._vacuum and self.has_box

    def _set_payload(self, request, response):
        self.payloads.append((request.mass, request.center_of_gravity.z))
        response.success = True
        return response

    def _tick(self):
        now = time.monotonic()
        dt, self._last = (now - self._last) * self.speed * self.scaling, now
        for controller in self.controllers:
            controller.tick(dt)
        names = list(self.q)
        q, qd = self.state(names)
        msg = JointState(name=names, position=q.tolist(), velocity=qd.tolist())
        msg.header.stamp = self.get_clock().now().to_msg()
        self._joints.publish(msg)
        self._scaling.publish(Float64(data=100.0 * self.scaling))
        holds = self.holds()
        self._io.publish(IOStates(digital_in_states=[Digital(pin=0, state=holds)]))
        self._holds.publish(Bool(data=holds))


def described(name='ur20'):
    """The description of a robot without a calibration of its own."""
    from arm_executor.model.layout import Layout
    from arm_executor.model.robot_data import find_robot
    from arm_executor.model.urdf import cell_urdf

    return cell_urdf(find_robot(name), Layout(), described=True)


def home_of(layout):
    """The six joints with which the arm waits above the belt."""
    from arm_executor.arms.prediction import PredictedCell

    return PredictedCell(layout).home[1:]


def main():
    from dataclasses import replace

    from arm_executor.model.layout import Layout

    x, speed = float(sys.argv[1]), float(sys.argv[2])
    layout = Layout()
    layout = replace(layout, rail=replace(layout.rail, x_min=x, x_max=x))
    kind = sys.argv[3] if len(sys.argv) > 3 else 'scaled'
    rclpy.init()
    node = FakeRobot(home_of(layout), speed=speed, kind=kind)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print('ready', flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    threading.current_thread().name = 'fake_robot'
    main()
