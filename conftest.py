"""What all tests of the repository share: ROS domains that nothing else on this host is using."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator

import pytest


def pytest_collection_finish() -> None:
    """Collecting garbage, which tests of nodes do, need not look at all that was imported."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What is slow is not measured for the coverage; what starts nodes may run a second time.

    The middleware loses messages of discovery now and then, the more the busier the machine is; the
    summary names each test that needed it.
    """
    for item in items:
        if item.get_closest_marker('slow'):
            item.add_marker('no_cover')
        if any(item.get_closest_marker(name) for name in ('ros', 'cell')):
            item.add_marker(pytest.mark.flaky(reruns=1))


def free_domain(request: pytest.FixtureRequest) -> Iterator[int]:
    """Reserve a ROS domain; the test must say that it starts nodes, so that it can be left out."""
    import domain_coordinator

    if not any(request.node.get_closest_marker(name) for name in ('ros', 'cell')):
        pytest.fail(f'{request.node.nodeid} starts nodes: mark it ros or cell')
    with domain_coordinator.domain_id() as number:
        yield number
        # A node that is still there would be seen by the next test that is given the domain.
        gc.collect()


@pytest.fixture(scope='module')
def domain(request: pytest.FixtureRequest) -> Iterator[int]:
    """A ROS domain for all tests of a file."""
    yield from free_domain(request)


@pytest.fixture
def ros_domain(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A ROS domain for one test, also in the environment of what it starts."""
    for number in free_domain(request):
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        reach = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', reach)
        yield number
