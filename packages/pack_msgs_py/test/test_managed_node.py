"""The life of a managed node, asked for by the services that every managed node has."""

from __future__ import annotations

import threading

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String

from pack_msgs.action import PlaceBox
from pack_msgs_py.ros.managed_node import ManagedNode
from pack_msgs_py.ros.testing import Spinner, private_context

pytestmark = pytest.mark.ros

CONFIGURE, ACTIVATE = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE
DEACTIVATE, CLEANUP = Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP
SHUTDOWN = Transition.TRANSITION_ACTIVE_SHUTDOWN
TIMEOUT_S = 20.0


class Lamp(ManagedNode):
    """Has one of everything that a node can have."""

    def __init__(self, context, **parameters):
        given = [Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__('lamp', context=context, parameter_overrides=given)
        self.done, self.why_not, self.works_on, self.ends = [], '', '', True
        self.begin()

    def make(self):
        self.at_release(lambda: self.done.append('closed'))
        self.at_release(lambda: self.ends)
        self.create_publisher(String, 'light', 10)
        if self.why_not:
            raise ValueError(self.why_not)
        self.create_subscription(String, 'switch', self.done.append, 10)
        self.create_client(GetState, 'other')
        self.create_service(GetState, '~/own', lambda request, response: response)
        self.create_timer(0.01, lambda: None)
        self.create_guard_condition(lambda: None)
        ActionServer(self, PlaceBox, 'move', lambda handle: None)
        self.done.append('made')

    def set_active(self, *, active):
        self.done.append('on' if active else 'off')

    def busy(self):
        return self.works_on


class Manager:
    """Asks for transitions as any manager of life cycles does."""

    def __init__(self, spinner):
        self._node = spinner.add(Node('manager', context=spinner.context))
        self._change = self._node.create_client(ChangeState, 'lamp/change_state')
        self._get = self._node.create_client(GetState, 'lamp/get_state')
        assert self._change.wait_for_service(TIMEOUT_S) and self._get.wait_for_service(TIMEOUT_S)

    def ask(self, transition):
        """Whether it was done, and the state then."""
        request = ChangeState.Request(transition=Transition(id=transition))
        done = self._answer(self._change, request).success
        return done, self._answer(self._get, GetState.Request()).current_state.label

    @staticmethod
    def _answer(client, request):
        arrived = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: arrived.set())
        assert arrived.wait(TIMEOUT_S)
        return future.result()


@pytest.fixture
def spinner(domain):
    with Spinner(domain=domain) as made:
        yield made


def count(node):
    return len(node._entities())


def test_it_begins_by_itself(spinner):
    lamp = spinner.add(Lamp(spinner.context))
    assert lamp.done == ['made', 'on'] and lamp.is_active


def test_told_not_to_it_follows_its_transitions_and_leaves_nothing_behind(spinner):
    lamp = spinner.add(Lamp(spinner.context, autostart=False))
    manager, bare = Manager(spinner), count(lamp)
    for _ in range(2):
        assert lamp.done == [] and not lamp.is_configured
        assert manager.ask(CONFIGURE) == (True, 'inactive')
        assert manager.ask(ACTIVATE) == (True, 'active') and lamp.is_active
        assert manager.ask(DEACTIVATE) == (True, 'inactive') and not lamp.is_active
        assert manager.ask(CLEANUP) == (True, 'unconfigured')
        assert lamp.done == ['made', 'on', 'off', 'closed'] and count(lamp) == bare
        lamp.done.clear()


def test_a_transition_that_there_is_not_is_answered_with_no(spinner):
    spinner.add(Lamp(spinner.context, autostart=False))
    manager = Manager(spinner)
    assert manager.ask(ACTIVATE) == (False, 'unconfigured')
    assert manager.ask(77) == (False, 'unconfigured')
    assert manager.ask(CONFIGURE) == (True, 'inactive')


def test_what_cannot_be_configured_is_configured_once_the_reason_is_gone(spinner):
    lamp = spinner.add(Lamp(spinner.context, autostart=False))
    manager, bare = Manager(spinner), count(lamp)
    lamp.why_not = 'the bulb is missing'
    assert manager.ask(CONFIGURE) == (False, 'unconfigured')
    assert lamp.done == ['closed'] and count(lamp) == bare
    lamp.why_not = ''
    assert manager.ask(CONFIGURE) == (True, 'inactive')


def test_it_is_not_cleaned_up_in_the_middle_of_something(spinner):
    lamp = spinner.add(Lamp(spinner.context, autostart=False))
    manager = Manager(spinner)
    manager.ask(CONFIGURE)
    lamp.works_on = 'a box is under way'
    assert manager.ask(CLEANUP) == (False, 'inactive') and lamp.done == ['made']
    lamp.works_on = ''
    assert manager.ask(CLEANUP) == (True, 'unconfigured')


def test_a_thread_that_does_not_end_is_an_end_for_good(spinner):
    lamp = spinner.add(Lamp(spinner.context, autostart=False))
    manager = Manager(spinner)
    manager.ask(CONFIGURE)
    lamp.ends = False
    assert manager.ask(CLEANUP) == (False, 'finalized')
    assert 'closed' not in lamp.done  # the thread may still write


def test_shut_down_it_acts_no_more(spinner):
    lamp = spinner.add(Lamp(spinner.context))
    manager = Manager(spinner)
    assert manager.ask(SHUTDOWN) == (True, 'finalized')
    assert lamp.done == ['made', 'on', 'closed'] and not lamp.is_active


def test_what_it_cannot_be_made_of_ends_a_node_that_begins_by_itself(domain):
    class Broken(Lamp):
        def make(self):
            msg = 'the bulb is missing'
            raise ValueError(msg)

    with private_context(domain) as context:
        with pytest.raises(ValueError, match='bulb'):
            Broken(context)
        with pytest.raises(ValueError, match='autostart is 3'):
            Lamp(context, autostart=3)
