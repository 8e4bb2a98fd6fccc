"""Fixtures of the whole-cell tests: cells and groups of nodes that are cleaned up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import domain_coordinator
import pytest
from cell_process import CellProcess

from pack_cell.testing import NodeGroup


@pytest.fixture
def other_domain(ros_domain: int) -> Iterator[int]:
    """A second domain of this test."""
    with domain_coordinator.domain_id() as number:
        yield number


@pytest.fixture
def start_cell(tmp_path: Path, ros_domain: int) -> Iterator[Callable[..., CellProcess]]:
    """Start ``cell run`` with the given arguments."""
    cells: list[CellProcess] = []

    def start(*arguments: str, domain: int = ros_domain, out: Path | None = None) -> CellProcess:
        cell = CellProcess(out or tmp_path / f'run{len(cells)}', *arguments, domain=domain)
        cells.append(cell)
        return cell

    yield start
    for cell in cells:
        cell.close()


@pytest.fixture
def group(tmp_path: Path, ros_domain: int) -> Iterator[NodeGroup]:
    """The three nodes, to be started one by one."""
    nodes = NodeGroup(tmp_path, ros_domain)
    yield nodes
    nodes.close()
