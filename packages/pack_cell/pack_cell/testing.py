"""Fixtures for tests of one's own that start nodes of the cell (docs/testing.md).

Use them with ``pytest_plugins = ['pack_cell.testing']``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import domain_coordinator
import pytest

from pack_cell.ros.node_group import NodeGroup

__all__ = ['NodeGroup', 'cell_domain', 'cell_nodes']


@pytest.fixture
def cell_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A ROS domain that no other test on this machine is using, also for what the test starts."""
    with domain_coordinator.domain_id() as number:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        if not os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE'):
            monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        yield number


@pytest.fixture
def cell_nodes(tmp_path: Path, cell_domain: int) -> Iterator[NodeGroup]:
    """Nodes of the cell, to be started one by one; they are ended with the test."""
    nodes = NodeGroup(tmp_path, cell_domain)
    yield nodes
    nodes.close()
