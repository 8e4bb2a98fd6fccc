"""Fixtures of the whole-cell tests: a private ROS domain, and cells that are cleaned up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import domain_coordinator
import pytest
from cell_process import CellProcess


@pytest.fixture
def ros_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve a ROS_DOMAIN_ID that no other test on this host is using."""
    with domain_coordinator.domain_id() as number:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        yield number


@pytest.fixture
def other_domain(ros_domain: int) -> Iterator[int]:
    """A second domain of this test."""
    with domain_coordinator.domain_id() as number:
        yield number


@pytest.fixture
def start_cell(tmp_path: Path, ros_domain: int) -> Iterator[Callable[..., CellProcess]]:
    """Start ``cell run`` with the given arguments."""
    cells: list[CellProcess] = []

    def start(*arguments: str, domain: int = ros_domain) -> CellProcess:
        cell = CellProcess(tmp_path / f'run{len(cells)}', *arguments, domain=domain)
        cells.append(cell)
        return cell

    yield start
    for cell in cells:
        cell.close()
