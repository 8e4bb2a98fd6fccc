"""A robot behind its ROS driver: trajectories, vacuum, payload, modes (imports ROS).

Names are those of :class:`~arm_executor.arms.trajectory.parameters.TrajectoryParameters`:

- action `<controller>/follow_joint_trajectory` (control_msgs/FollowJointTrajectory), the rail's too
- subscribes to the measured joints (sensor_msgs/JointState), speed scaling (std_msgs/Float64), and
  of the status controller `robot_mode`, `safety_mode` (ur_dashboard_msgs), `robot_program_running`
  (std_msgs/Bool) and `io_states` (ur_msgs/IOStates), or to a vacuum topic (std_msgs/Bool), and to
  the description of the robot (std_msgs/String)
- calls of the status controller `set_io` and `set_payload` (ur_msgs), or a vacuum service
  (std_srvs/SetBool)

Subscriptions and answers come on the node's executor; the arm's thread asks and waits. What it asks
is asked on the executor as well, since rclpy's clients are not made for two threads.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from control_msgs.action import FollowJointTrajectory
from numpy.typing import NDArray
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import SetBool
from ur_dashboard_msgs.msg import RobotMode, SafetyMode
from ur_msgs.msg import IOStates
from ur_msgs.srv import SetIO, SetPayload

from arm_executor.arms.trajectory.description import judged
from arm_executor.arms.trajectory.parameters import TrajectoryParameters
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.robot_data import JOINT_NAMES, RobotModel
from arm_executor.motion.timing import Trajectory
from arm_executor.ros.robot_motion import RobotMotion, TrajectoryPart, goal_of
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: The newest value is what counts; a late one is worth nothing.
_NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
#: Modes are told once, on each change.
_LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
#: Longest that a driver takes to answer a request, and to accept a trajectory, seconds.
_ANSWER_S = 4.0
#: What has not been heard for so long is subscribed to anew, seconds.
_AGAIN_S = 3.0
#: How long the description of the robot is waited for, seconds.
_DESCRIPTION_S = 8.0
#: In these safety modes the robot moves.
_SAFE = (SafetyMode.NORMAL, SafetyMode.REDUCED)
#: A rail of its own does not slow down with the arm: then the arm must not be slowed down.
_FULL_SPEED = 0.99


class RosRobotLink:
    """A :class:`~arm_executor.arms.trajectory.link.RobotLink` made of ROS interfaces.

    Parameters
    ----------
    node : whose interfaces they are; it is spun by somebody else.
    own : names, pins and tolerances.
    rail_at : where the arm stands when there is no rail, m.
    speed : robot seconds per wall-clock second, 1 but for a simulated robot.
    robot : what motions are planned with.
    """

    def __init__(
        self,
        node: Node,
        own: TrajectoryParameters,
        rail_at: float,
        speed: float,
        robot: RobotModel,
    ) -> None:
        self._node, self._own, self._speed, self._robot = node, own, speed, robot
        self._rail_at = rail_at
        self._names = [f'{own.joint_prefix}{name}' for name in JOINT_NAMES]
        self._moved_by_rail = bool(own.rail_controller)
        self._lock = threading.Lock()
        self._heard = threading.Condition(self._lock)
        self._joints: dict[str, tuple[float, float]] = {}
        self._scaling = 1.0
        self._robot_mode: int | None = None
        self._safety_mode: int | None = None
        self._running: bool | None = None
        self._vacuum: bool | None = None
        self._description: str | None = None
        self._jobs: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._guard = node.create_guard_condition(self._do_jobs)
        self._hearing: list[Any] = []
        self._subscribe()
        self._clients = self._action_clients()
        self._set_io = self._set_payload = self._set_bool = None
        if own.status:
            self._set_io = node.create_client(SetIO, f'{own.status}/set_io')
            self._set_payload = node.create_client(SetPayload, f'{own.status}/set_payload')
        if own.vacuum_service:
            self._set_bool = node.create_client(SetBool, own.vacuum_service)

    def _subscribe(self) -> None:
        """Listen to the driver; done once more, it brings what the driver keeps for sure."""
        node, own = self._node, self._own
        while self._hearing:
            node.destroy_subscription(self._hearing.pop())

        def listen(kind: type, topic: str, hear: Callable[[Any], None], profile: Any) -> None:  # noqa: ANN401 - rclpy's
            self._hearing.append(node.create_subscription(kind, topic, hear, profile))

        listen(JointState, own.joint_states, self._on_joints, _NEWEST)
        if own.speed_scaling:
            listen(Float64, own.speed_scaling, self._on_scaling, _NEWEST)
        if own.status:
            for name, kind, hear in (
                ('robot_mode', RobotMode, self._on_robot_mode),
                ('safety_mode', SafetyMode, self._on_safety_mode),
                ('robot_program_running', Bool, self._on_running),
            ):
                listen(kind, f'{own.status}/{name}', hear, _LATCHED)
        if own.vacuum_topic:
            listen(Bool, own.vacuum_topic, self._on_vacuum, _NEWEST)
        elif own.status:
            listen(IOStates, f'{own.status}/io_states', self._on_io, _NEWEST)
        if own.robot_description:
            listen(String, own.robot_description, self._on_description, _LATCHED)

    def _action_clients(self) -> list[tuple[ActionClient, list[int], list[str]]]:
        """Of each controller: its client, which of the seven joints it moves, and their names."""
        own = self._own
        arm, joints = list(range(1, 7)), self._names
        if own.rail_controller == own.controller:
            return [(self._client(own.controller), [0, *arm], [own.rail_joint, *joints])]
        clients = [(self._client(own.controller), arm, joints)]
        if own.rail_controller:
            clients.append((self._client(own.rail_controller), [0], [own.rail_joint]))
        return clients

    def _client(self, controller: str) -> ActionClient:
        name = f'{controller}/follow_joint_trajectory'
        return ActionClient(self._node, FollowJointTrajectory, name)

    # -- what the driver says -------------------------------------------------------------------

    def _on_joints(self, msg: JointState) -> None:
        now = time.monotonic()
        with self._heard:
            for name, position in zip(msg.name, msg.position, strict=False):
                self._joints[name] = (position, now)
            self._heard.notify_all()

    def _on_scaling(self, msg: Float64) -> None:
        self._scaling = min(1.0, max(0.0, msg.data / 100.0))

    def _on_robot_mode(self, msg: RobotMode) -> None:
        self._hear('_robot_mode', msg.mode)

    def _on_safety_mode(self, msg: SafetyMode) -> None:
        self._hear('_safety_mode', msg.mode)

    def _on_running(self, msg: Bool) -> None:
        self._hear('_running', msg.data)

    def _on_vacuum(self, msg: Bool) -> None:
        self._hear('_vacuum', msg.data)

    def _on_io(self, msg: IOStates) -> None:
        pin = self._own.vacuum_input
        for digital in msg.digital_in_states:
            if digital.pin == pin:
                self._hear('_vacuum', digital.state)

    def _on_description(self, msg: String) -> None:
        self._hear('_description', msg.data)

    def _hear(self, what: str, value: int | bool | str) -> None:
        with self._heard:
            setattr(self, what, value)
            self._heard.notify_all()

    # -- see arm_executor.arms.trajectory.link ---------------------------------------------------

    def connect(self) -> None:
        """Wait for all of it; see :class:`~arm_executor.arms.trajectory.link.RobotLink`."""
        until = time.monotonic() + self._own.connect_timeout_s
        for client, _, _ in self._clients:
            if not client.wait_for_server(max(0.1, until - time.monotonic())):
                self._missing(f'action {client._action_name}')  # noqa: SLF001 - no public reader
        for service in (self._set_io, self._set_payload, self._set_bool):
            if service is not None and not service.wait_for_service(
                max(0.1, until - time.monotonic())
            ):
                self._missing(f'service {service.srv_name}')
        self._wait_for(self._unheard, until)
        absent = self._unheard()
        if absent:
            self._missing(absent)
        self._compare_description()

    def _wait_for(self, absent: Callable[[], str], until: float) -> None:
        """Wait until nothing is absent; what says nothing for long is subscribed to anew.

        What a driver says once and keeps may have been lost on its way.
        """
        asked = time.monotonic()
        with self._heard:
            while absent() and (now := time.monotonic()) < until:
                if now - asked > _AGAIN_S:
                    asked = now
                    self._on_executor(self._subscribe)
                self._heard.wait(min(_AGAIN_S, until - now))

    def _compare_description(self) -> None:
        """Hold the robot's own description against the model; ``MotionError`` for another robot."""
        own, log = self._own, self._node.get_logger()
        topic = own.robot_description
        until = time.monotonic() + (_DESCRIPTION_S if topic else 0.0)
        self._wait_for(lambda: topic if self._description is None else '', until)
        if self._description is not None:
            prefix, allowed_m = own.joint_prefix, own.model_tolerance
            text, well = judged(self._description, self._robot, prefix, allowed_m)
            log.info(text) if well else log.warning(text)
        elif topic:
            log.warning(f'nothing on {topic}: whether there is a {self._robot.name} is not known')

    def _unheard(self) -> str:
        """What has not been heard yet, in words; empty when nothing is missing."""
        own = self._own
        joints = [*self._names, *([own.rail_joint] if self._moved_by_rail else [])]
        missing = [name for name in joints if name not in self._joints]
        if missing:
            return f'joint {missing[0]} on topic {own.joint_states}'
        if self._vacuum is None:
            where = own.vacuum_topic or f'{own.status}/io_states'
            return f'the vacuum on topic {where}'
        if own.status and None in (self._robot_mode, self._safety_mode, self._running):
            return f'robot_mode, safety_mode or robot_program_running of {own.status}'
        return ''

    def _missing(self, what: str) -> None:
        msg = (
            f'{what} is not there after {self._own.connect_timeout_s:g} s: start the driver of the '
            'robot, and see whether the parameters trajectory.* name what it offers'
        )
        raise MotionError(ErrorCode.NOT_ACTIVE, msg)

    def positions(self) -> Array:
        """Measured configuration (7,)."""
        silent = self._silent()
        if silent:
            raise MotionError(ErrorCode.START_STATE_INVALID, silent)
        with self._lock:
            rail = self._joints[self._own.rail_joint][0] if self._moved_by_rail else self._rail_at
            return np.array([rail, *(self._joints[name][0] for name in self._names)])

    def _silent(self) -> str:
        now = time.monotonic()
        joints = [*self._names, *([self._own.rail_joint] if self._moved_by_rail else [])]
        with self._lock:
            oldest = min(joints, key=lambda name: self._joints[name][1])
            age_s = now - self._joints[oldest][1]
        if age_s <= self._own.silent_s:
            return ''
        return f'joint {oldest} was last heard of {age_s:.1f} s ago on {self._own.joint_states}'

    def trouble(self) -> str:
        """Why the robot cannot move, empty when it can."""
        if not self._own.status:
            return self._silent()
        safety, mode = self._safety_mode, self._robot_mode
        if safety not in _SAFE:
            return f'the robot is in safety mode {_name(SafetyMode, safety)}'
        if mode != RobotMode.RUNNING:
            return f'the robot is in mode {_name(RobotMode, mode)}, not RUNNING'
        if not self._running:
            return 'the External Control program does not run on the robot: start it'
        return self._silent()

    def speed_scaling(self) -> float:
        """Share of its speed at which the robot runs trajectories, 0 to 1."""
        return self._scaling

    def start(self, timed: Trajectory) -> RobotMotion:
        """Send ``timed`` to every controller, and wait until all have accepted it."""
        if len(self._clients) > 1 and self._scaling < _FULL_SPEED:
            msg = (
                f'the robot runs at {self._scaling:.0%} of its speed and the rail does not: '
                'set the speed slider to 100 %'
            )
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        parts = [TrajectoryPart(names) for _, _, names in self._clients]
        motion = RobotMotion(parts, timed.duration, self._speed, self.speed_scaling)
        goals = [goal_of(timed, columns, names, self._own) for _, columns, names in self._clients]

        def send() -> None:
            for part, goal, (client, _, _) in zip(parts, goals, self._clients, strict=True):
                asked = client.send_goal_async(goal, feedback_callback=part.on_feedback)
                asked.add_done_callback(part.on_answer)

        self._on_executor(send)
        motion.ask_by = self._on_executor
        for part in parts:
            refused = part.refused(_ANSWER_S)
            if refused:
                motion.cancel()
                raise MotionError(ErrorCode.START_STATE_INVALID, refused)
        return motion

    def set_vacuum(self, *, on: bool) -> None:
        """Switch the vacuum, and blow off the other way round."""
        if self._set_bool is not None:
            answer = self._call(self._set_bool, SetBool.Request(data=on))
            if not answer.success:
                self._refused(f'{self._own.vacuum_service} says {answer.message!r}')
            return
        self._output(self._own.vacuum_output, on)
        if self._own.blow_off_output >= 0:
            self._output(self._own.blow_off_output, not on)

    def _output(self, pin: int, on: bool) -> None:
        request = SetIO.Request(fun=SetIO.Request.FUN_SET_DIGITAL_OUT, pin=pin, state=float(on))
        if not self._call(self._set_io, request).success:
            self._refused(f'digital output {pin} could not be switched {"on" if on else "off"}')

    def vacuum_holds(self) -> bool:
        """Whether the pad holds something."""
        return bool(self._vacuum)

    def set_payload(self, mass: float, centre: Vec3) -> None:
        """Tell what hangs on the flange."""
        if self._set_payload is None:
            return
        request = SetPayload.Request(mass=mass)
        gravity = request.center_of_gravity
        gravity.x, gravity.y, gravity.z = centre
        if not self._call(self._set_payload, request).success:
            self._refused(f'the payload could not be set to {mass:.2f} kg')

    def close(self) -> None:
        """Give the action clients back, which outlive their node unless told."""
        for client, _, _ in self._clients:
            client.destroy()

    # -- asking ---------------------------------------------------------------------------------

    def _on_executor(self, job: Callable[[], None]) -> None:
        self._jobs.put(job)
        self._guard.trigger()

    def _do_jobs(self) -> None:
        while True:
            try:
                job = self._jobs.get_nowait()
            except queue.Empty:
                return
            job()

    def _call(self, client: Any, request: Any) -> Any:  # noqa: ANN401 - any service
        """The answer of a service; ``MotionError`` when none comes."""
        answered, answers = threading.Event(), []

        def keep(future: Future) -> None:
            answers.append(future.result())
            answered.set()

        self._on_executor(lambda: client.call_async(request).add_done_callback(keep))
        if not answered.wait(_ANSWER_S) or answers[0] is None:
            self._refused(f'service {client.srv_name} does not answer')
        return answers[0]

    def _refused(self, what: str) -> None:
        raise MotionError(ErrorCode.PROTECTIVE_STOP, f'{what}; look at the driver of the robot')


def _name(kind: type, value: int | None) -> str:
    """What a message type calls a value of its modes."""
    names = [name for name in dir(kind) if name.isupper() and getattr(kind, name) == value]
    return names[0] if names else str(value)
