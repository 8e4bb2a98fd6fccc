"""Fixtures of the executor's tests; those for the node load ROS when they are used."""

from __future__ import annotations

import pytest


@pytest.fixture
def arm():
    """An arm in physics with empty bins at A and B."""
    from physics_cases import empty

    from arm_executor.arms.physics.arm import PhysicsArm

    arm = PhysicsArm()
    arm.set_bins(empty('A', 'B'), {})
    yield arm
    arm.close()


@pytest.fixture
def make_core_bench():
    """Make the core of an executor without ROS; all are ended after the test."""
    from core_bench import CoreBench

    made = []

    def make(**arguments):
        made.append(CoreBench(**arguments))
        return made[-1]

    yield make
    for bench in made:
        bench.end()


@pytest.fixture
def spinners(ros_domain):
    """One context for the executor and one for who talks to it, as in the cell."""
    from pack_msgs_py.ros.testing import Spinner

    made = [Spinner(), Spinner()]
    yield made
    for spinner in made:
        spinner.close()


@pytest.fixture
def make_bench(spinners):
    from executor_bench import ExecutorBench

    def run():
        bench = ExecutorBench(spinners[1].context)
        # Like an action server, a client outlives its node unless told.
        spinners[1].add(bench.node, bench.client.destroy)
        return bench

    return run


@pytest.fixture
def start(spinners, make_bench):
    """Start the executor with these parameters and faults; returns a bench that talks to it."""
    from rclpy.parameter import Parameter

    from arm_executor.arms.timed import TimedArm
    from arm_executor.ros.node import ArmExecutor

    def run(*, faults=None, **parameters):
        values = {'arm': 'timed', 'speed': 0.0, 'open_bins': 2, **parameters}

        def make_arm(setup):
            return TimedArm(setup.layout, speed=setup.speed, faults=faults)

        node = ArmExecutor(
            make_arm=None if faults is None else make_arm,
            context=spinners[0].context,
            parameter_overrides=[Parameter(key, value=value) for key, value in values.items()],
        )
        spinners[0].add(node, node.stop_motion)
        bench = make_bench()
        bench.executor_node = node
        return bench.ready()

    return run
