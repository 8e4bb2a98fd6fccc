"""Fixtures of the executor's tests."""

from __future__ import annotations

import sys
from pathlib import Path

import domain_coordinator
import pytest

# pytest's importlib mode leaves the folder of the tests off the path
sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def ros_domain(monkeypatch):
    """Reserve a ROS_DOMAIN_ID that no other test on this host is using."""
    with domain_coordinator.domain_id() as number:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        yield number
