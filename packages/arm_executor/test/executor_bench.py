"""A scripted rest of the cell: conveyor and planner as seen from the executor."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time

import rclpy
from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from executor_cases import make_scan, pick_of
from rclpy.action import ActionClient
from rclpy.qos import qos_profile_action_status_default
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from pack_msgs.action import PlaceBox
from pack_msgs.msg import (
    AlarmArray,
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    ExecutorState,
    PlacementReport,
)
from pack_msgs.srv import (
    CheckPlacements,
    CutOff,
    InsertPlacedBox,
    Operate,
    RemoveBox,
    SwapBin,
)
from pack_msgs_py.ros import conversions, qos

#: Nothing takes that long, also on a busy machine.
TIMEOUT_S = 30.0


TOPICS = {
    'box_event': BoxEvent,
    'bin_state': BinStateArray,
    'bin_closed': BinState,
    'placement_report': PlacementReport,
    'executor_state': ExecutorState,
    'alarms': AlarmArray,
}


class ExecutorBench:
    """Talks to one executor; keeps everything it hears, in the order in which it came."""

    def __init__(self, context):
        self.node = rclpy.create_node('bench', context=context)
        self._news = threading.Condition()
        self.heard = []
        for topic, kind in TOPICS.items():
            self._listen(topic, kind, qos.TOPICS[topic])
        self._listen('joint_states', JointState, 10)
        self._listen('/diagnostics', DiagnosticArray, 10)
        self._listen('place_box/_action/status', GoalStatusArray, qos_profile_action_status_default)
        self._scan = self.node.create_publisher(BoxScan, 'box_scan', qos.TOPICS['box_scan'])
        self.client = ActionClient(self.node, PlaceBox, 'place_box')
        self._services = {
            'swap_bin': self.node.create_client(SwapBin, 'swap_bin'),
            'cut_off': self.node.create_client(CutOff, 'cut_off'),
            'check_placements': self.node.create_client(CheckPlacements, 'check_placements'),
            'pause': self.node.create_client(SetBool, 'arm_executor/pause'),
            'stop': self.node.create_client(Trigger, 'arm_executor/stop'),
            'reset': self.node.create_client(Trigger, 'arm_executor/reset'),
            'operate': self.node.create_client(Operate, 'arm_executor/operate'),
            'insert_box': self.node.create_client(InsertPlacedBox, 'arm_executor/insert_box'),
            'remove_box': self.node.create_client(RemoveBox, 'arm_executor/remove_box'),
        }
        self.feedback = []
        self.sequence = 0

    def _listen(self, topic, kind, profile):
        self.node.create_subscription(kind, topic, lambda msg: self._hear(topic, msg), profile)

    def _hear(self, topic, msg):
        with self._news:
            self.heard.append((topic, msg, time.monotonic()))
            self._news.notify_all()

    # -- what was heard

    def of(self, topic):
        return [msg for name, msg, _ in list(self.heard) if name == topic]

    def wait(self, condition, what):
        """Until ``condition()``, looked at again whenever something was heard."""
        with self._news:
            if not self._news.wait_for(condition, TIMEOUT_S):
                seen = [name for name, _, _ in self.heard if name != 'executor_state']
                raise AssertionError(f'no {what} within {TIMEOUT_S} s; heard {seen}')

    def wait_mode(self, mode):
        def in_mode():
            states = self.of('executor_state')
            return bool(states) and states[-1].mode == mode

        self.wait(in_mode, f'mode {mode}')
        return self

    def ready(self):
        """The executor is idle, and its bins are known."""
        self.wait_mode(ExecutorState.MODE_IDLE)
        self.wait(lambda: self.of('bin_state'), 'bin_state')
        if not self.client.wait_for_server(TIMEOUT_S):
            raise AssertionError('no action server place_box')
        return self

    @property
    def statuses(self):
        """Every status that a goal was seen in."""
        return [
            goal.status for msg in self.of('place_box/_action/status') for goal in msg.status_list
        ]

    def bins(self):
        return conversions.bins_from_ros(self.of('bin_state')[-1])

    def events(self, box_id):
        return [BoxEventName[msg.event] for msg in self.of('box_event') if msg.box_id == box_id]

    # -- what is said

    def now(self):
        return 1e-9 * self.node.get_clock().now().nanoseconds

    def show(self, *boxes, presented='', age_s=0.0):
        """The belt holds ``boxes``; returns once an executor listens."""
        self.wait_listener()
        self.sequence += 1
        scan = make_scan(
            *boxes, stamp_s=self.now() - age_s, presented=presented, sequence=self.sequence
        )
        self._scan.publish(conversions.scan_to_ros(scan))

    def wait_listener(self):
        self.wait(lambda: self._scan.get_subscription_count() > 0, 'subscriber of box_scan')

    def goal_msg(self, decision, *, deadline_in_s=60.0, frame_id='bin_a'):
        goal = PlaceBox.Goal(placement=conversions.placement_to_ros(decision, frame_id))
        goal.pick_pose.header.frame_id = 'cell'
        goal.pick_pose.pose = conversions.pose_to_ros(pick_of(decision.box))
        goal.placement.scan_sequence = self.sequence
        goal.deadline = conversions.time_to_ros(self.now() + deadline_in_s)
        return goal

    def send(self, goal):
        """Send the goal; returns its handle."""
        future = self.client.send_goal_async(goal, feedback_callback=self._on_feedback)
        return self._await(future, 'answer to the goal')

    def _on_feedback(self, msg):
        with self._news:
            self.feedback.append(msg.feedback)
            self._news.notify_all()

    def wait_phase(self, phase):
        self.wait(
            lambda: any(feedback.phase == phase for feedback in list(self.feedback)),
            f'phase {phase}',
        )

    def result(self, handle):
        """(status, result) of the goal."""
        reply = self._await(handle.get_result_async(), 'result')
        with self._news:
            self.heard.append(('result', reply.result, time.monotonic()))
        return reply.status, reply.result

    def place(self, decision, **goal_options):
        """Show, send, wait: (status, result)."""
        return self.result(self.send(self.goal_msg(decision, **goal_options)))

    def cancel(self, handle):
        return self._await(handle.cancel_goal_async(), 'answer to cancel')

    def call(self, service, request):
        client = self._services[service]
        assert client.wait_for_service(TIMEOUT_S), f'no service {service}'
        return self._await(client.call_async(request), f'answer of {service}')

    def operate(self, command, bin_id='', who='anna', why='a test'):
        """(success, message) of an operator's command."""
        request = Operate.Request(command=int(command), bin_id=bin_id, who=who, why=why)
        answer = self.call('operate', request)
        return answer.success, answer.message

    def _await(self, future, what):
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        assert done.wait(TIMEOUT_S), f'no {what} within {TIMEOUT_S} s'
        return future.result()


BoxEventName = {
    getattr(BoxEvent, name): name
    for name in ('PICKED', 'PLACED', 'RETURNED', 'REJECTED', 'LOST', 'UNKNOWN')
}


class ExecutorProcess:
    """``python -m arm_executor.ros.node`` with these parameters."""

    def __init__(self, folder, **parameters):
        command = [sys.executable, '-m', 'arm_executor.ros.node', '--ros-args']
        for name, value in parameters.items():
            command += ['-p', f'{name}:={value}']
        self.log = folder / f'executor-{time.monotonic_ns()}.log'
        with self.log.open('w') as stream:
            self.process = subprocess.Popen(
                command, stdout=stream, stderr=subprocess.STDOUT, env=os.environ.copy()
            )

    def end(self, signal_number, within_s=TIMEOUT_S):
        """Send the signal; (exit code, seconds it took)."""
        started = time.monotonic()
        self.process.send_signal(signal_number)
        code = self.process.wait(within_s)
        return code, time.monotonic() - started

    def wait(self):
        return self.process.wait(TIMEOUT_S)

    def text(self):
        return self.log.read_text()

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
