"""What every node does about its parameters and its clock."""

from __future__ import annotations

import queue
from dataclasses import dataclass

import pytest

pytest.importorskip('rclpy')

from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from pack_msgs_py.parameter_fields import parameter
from pack_msgs_py.ros import run_node
from pack_msgs_py.ros.declare_parameters import declare_parameters
from pack_msgs_py.ros.testing import Spinner, private_context

pytestmark = pytest.mark.ros


@dataclass(frozen=True)
class Parameters:
    speed: float = parameter(1.0, 'How fast.')


class TalkingNode(Node):
    """Keeps its warnings."""

    def __init__(self, context, *overrides):
        super().__init__('talking', context=context, parameter_overrides=list(overrides))
        self.said = queue.Queue()

    def get_logger(self):
        said = getattr(self, 'said', None)
        logger = super().get_logger()
        if said is not None:
            logger.warning = said.put
        return logger


@pytest.mark.parametrize(
    ('name', 'text'),
    [('qos_overrides./box_scan.publisher.depth', 'interfaces.md'), ('spede', 'has speed')],
)
def test_a_parameter_that_would_do_nothing_is_refused(domain, name, text):
    with private_context(domain) as context:
        node = TalkingNode(context, Parameter(name, value=1))
        with pytest.raises(ValueError, match=text):
            declare_parameters(node, Parameters)
        node.destroy_node()


@pytest.mark.parametrize('told', [False, True])
def test_a_node_without_the_clock_that_it_waits_for_says_so(domain, told, monkeypatch):
    monkeypatch.setattr(run_node, 'CLOCK_S', 0.5)
    with Spinner(domain=domain) as spinner:
        node = TalkingNode(spinner.context, Parameter('use_sim_time', value=True))
        if told:
            clock = node.create_publisher(Clock, '/clock', 10)
            msg = Clock()
            msg.clock.sec = 5
            timer_clock = run_node.Clock(clock_type=run_node.ClockType.STEADY_TIME)
            node.create_timer(0.05, lambda: clock.publish(msg), clock=timer_clock)
        run_node.warn_without_clock(node)
        spinner.add(node)
        if told:
            with pytest.raises(queue.Empty):
                node.said.get(timeout=1.5)
        else:
            assert 'nothing has come on /clock' in node.said.get(timeout=20.0)
