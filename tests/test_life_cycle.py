"""The three nodes of the cell under a manager of life cycles: who is not active does nothing."""

from __future__ import annotations

import threading

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from arm_executor.ros.node import ArmExecutor
from conveyor_sim.ros.node import ConveyorNode
from pack_cell.ros.health import unhealthy
from pack_msgs.msg import BoxScan, ExecutorState, PlacementDecision, PlacementReport
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import time_from_ros
from pack_msgs_py.ros.testing import Spinner, private_context
from pack_planner.ros.node import PlannerNode

pytestmark = pytest.mark.ros

#: Nothing takes that long, also on a busy machine that compiles first.
TIMEOUT_S = 100.0
COUNT = 8
NODES = {
    'conveyor': (ConveyorNode, {'count': COUNT, 'speed': 0.0}),
    'planner': (PlannerNode, {'algorithm': 'mpack_lite', 'candidates': 1}),
    'arm_executor': (ArmExecutor, {'arm': 'timed', 'speed': 0.0}),
}


class Watcher:
    """Hears the cell, and asks for transitions."""

    def __init__(self, spinner):
        self.node = spinner.add(Node('watcher', context=spinner.context))
        self._news = threading.Condition()
        self.heard = {'box_scan': [], 'placements': [], 'placement_report': [], 'clock': []}
        self.mode, self._on_beats = None, []
        for topic, kind in (
            ('box_scan', BoxScan),
            ('placements', PlacementDecision),
            ('placement_report', PlacementReport),
        ):
            take = self.heard[topic].append
            self._listen(kind, topic, take, qos.TOPICS[topic])
        self._listen(ExecutorState, 'executor_state', self._on_beat, 10)
        self._listen(Clock, '/clock', self.heard['clock'].append, 10)
        self._change = {
            name: self.node.create_client(ChangeState, f'{name}/change_state') for name in NODES
        }

    def _listen(self, kind, topic, take, profile):
        def told(msg):
            with self._news:
                take(msg)
                self._news.notify_all()

        self.node.create_subscription(kind, topic, told, profile)

    def _on_beat(self, msg):
        self.mode = msg.mode
        self._on_beats.append(msg)

    def wait(self, condition, what):
        with self._news:
            assert self._news.wait_for(condition, TIMEOUT_S), f'{what}: never within {TIMEOUT_S} s'

    def change(self, name, transition):
        client = self._change[name]
        assert client.wait_for_service(TIMEOUT_S)
        answered = threading.Event()
        future = client.call_async(ChangeState.Request(transition=Transition(id=transition)))
        future.add_done_callback(lambda _: answered.set())
        assert answered.wait(TIMEOUT_S)
        return future.result().success

    def beats(self, number):
        """Let this many heartbeats go by: whoever wanted to act would have."""
        seen = []
        subscription = self.node.create_subscription(
            ExecutorState, 'executor_state', seen.append, 10
        )
        self.wait(lambda: len(seen) >= number, 'heartbeats')
        self.node.destroy_subscription(subscription)


def start(spinners, **common):
    for spinner, (kind, values) in zip(spinners, NODES.values(), strict=True):
        given = [Parameter(name, value=value) for name, value in (values | common).items()]
        if kind is ArmExecutor and common.get('use_sim_time'):
            given.append(Parameter('publish_clock', value=True))
        spinner.add(kind(context=spinner.context, parameter_overrides=given))


@pytest.fixture
def spinners(ros_domain):
    made = [Spinner() for _ in NODES]
    yield made
    for spinner in made:
        spinner.close()


@pytest.fixture
def watcher(ros_domain):
    with Spinner() as spinner:
        yield Watcher(spinner)


def test_who_is_not_active_does_nothing_and_goes_on_when_it_is(spinners, watcher):
    start(spinners, autostart=False)
    configure, activate = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE
    deactivate = Transition.TRANSITION_DEACTIVATE
    scans, placements = watcher.heard['box_scan'], watcher.heard['placements']
    reports = watcher.heard['placement_report']
    for name in NODES:
        assert watcher.change(name, configure)
    watcher.wait(lambda: scans and watcher.mode is not None, 'all tell what they know')
    watcher.beats(10)
    assert not scans[-1].boxes  # the belt stands
    assert watcher.change('conveyor', activate)
    watcher.wait(lambda: scans[-1].boxes, 'boxes on the belt')
    assert watcher.change('planner', activate)
    watcher.beats(10)
    assert not placements and watcher.mode == ExecutorState.MODE_INACTIVE
    assert watcher.change('arm_executor', activate)
    watcher.wait(lambda: len(reports) >= 2, 'two boxes placed')
    assert watcher.change('planner', deactivate)
    watcher.beats(10)
    decided, placed = len(placements), len(reports)
    watcher.beats(10)
    assert (len(placements), len(reports)) == (decided, placed) and placed < COUNT
    assert watcher.change('planner', activate)
    watcher.wait(lambda: len(reports) == COUNT, 'every box placed')
    assert {report.error_code for report in reports} == {0}


def test_a_health_check_tells_who_is_not_well(spinners, ros_domain):
    with private_context() as context:
        asking = Node('health', context=context)
        assert unhealthy(asking, '/planner', 0.5) == '/planner is not there'
        given = [Parameter('autostart', value=False)]
        node = ConveyorNode(context=spinners[0].context, parameter_overrides=given)
        spinners[0].add(node)
        assert unhealthy(asking, '/conveyor', TIMEOUT_S) == '/conveyor is unconfigured'
        node.trigger_configure()
        node.trigger_activate()
        assert unhealthy(asking, '/conveyor', TIMEOUT_S) == ''
        spinners[0].close()
        asking.destroy_node()


def test_cleaned_up_and_configured_anew_the_cell_begins_anew(spinners, watcher):
    start(spinners)
    reports = watcher.heard['placement_report']
    watcher.wait(lambda: len(reports) == COUNT, 'every box placed')
    for transition in (
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ):
        for name in NODES:
            # Refused while a decision is being computed, or the arm is being made ready.
            assert any(watcher.change(name, transition) for _ in range(2000)), (name, transition)
    watcher.wait(lambda: len(reports) == 2 * COUNT, 'every box placed once more')


@pytest.mark.parametrize('speed', [0.0, 20.0])
def test_the_cell_lives_by_robot_time_when_it_is_told_to(spinners, watcher, speed):
    start(spinners, use_sim_time=True)
    reports, clock = watcher.heard['placement_report'], watcher.heard['clock']
    watcher.wait(lambda: len(reports) == COUNT, 'every box placed')
    times = [time_from_ros(msg.clock) for msg in clock]
    assert times == sorted(times)
    stamps = [time_from_ros(msg.header.stamp) for msg in reports]
    moved_s = sum(msg.motion_time.sec for msg in reports)
    assert moved_s <= stamps[-1] - times[0] + 10.0
    assert {report.error_code for report in reports} == {0}
