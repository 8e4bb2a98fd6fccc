"""Each node starts alone, waits for the others in any order, and stops when it is told."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pack_cell.report.record import RunRecord
from pack_cell.ros.recorder import Recorder
from pack_cell.running.node_commands import NODES, executable
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros

PARAMETERS = {
    'conveyor': ['-p', 'count:=4', '-p', 'speed:=0.0'],
    'planner': ['-p', 'deadline_s:=60.0', '-p', 'orientations:=upright'],
    'arm_executor': ['-p', 'arm:=timed', '-p', 'speed:=0.0', '-p', 'orientations:=upright'],
}


def start(name: str, log: Path, *more: str) -> subprocess.Popen[bytes]:
    package, program = NODES[name]
    command = [sys.executable, str(executable(package, program)), '--ros-args', *PARAMETERS[name]]
    return subprocess.Popen([*command, *more], stdout=log.open('wb'), stderr=subprocess.STDOUT)


def wait_for_text(log: Path, text: str, seconds: float = 30.0) -> None:
    """Return when ``text`` is in the log; fail after ``seconds``."""
    end = time.monotonic() + seconds
    while text not in log.read_text():
        assert time.monotonic() < end, f'no {text!r} within {seconds} s:\n{log.read_text()}'
        time.sleep(0.02)


@pytest.fixture
def nodes(tmp_path: Path, ros_domain: int) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    running: dict[str, subprocess.Popen[bytes]] = {}
    yield running
    for process in running.values():
        if process.poll() is None:
            process.kill()
        process.wait()


@pytest.fixture
def watched(ros_domain: int):
    """A recorder in this process, and a way to wait for what it hears."""
    changed = threading.Condition()
    record = RunRecord()

    def on_change(kind: str, value: object) -> None:
        with changed:
            changed.notify_all()

    def wait_until(condition, seconds: float = 40.0) -> bool:
        with changed:
            return changed.wait_for(lambda: condition(record), seconds)

    with Spinner(domain=ros_domain) as spinner:
        spinner.add(Recorder(record, on_change, context=spinner.context))
        yield wait_until


@pytest.mark.cell
@pytest.mark.parametrize('order', list(itertools.permutations(NODES)), ids='-'.join)
def test_the_nodes_find_each_other_in_any_order(nodes, watched, tmp_path, order) -> None:
    seen = []
    for name in order:
        nodes[name] = start(name, tmp_path / f'{name}.log')
        seen.append(name)
    assert watched(lambda record: len(record.reports) >= 4), [
        (tmp_path / f'{name}.log').read_text() for name in order
    ]
    assert all(process.poll() is None for process in nodes.values())


@pytest.mark.parametrize('name', list(NODES))
@pytest.mark.parametrize('sig', [signal.SIGINT, signal.SIGTERM], ids=['SIGINT', 'SIGTERM'])
def test_a_node_alone_stops_with_code_0(nodes, ros_domain, tmp_path, name, sig) -> None:
    log = tmp_path / f'{name}.log'
    nodes[name] = start(name, log)
    wait_for_text(log, '[INFO]')
    assert nodes[name].poll() is None, log.read_text()
    nodes[name].send_signal(sig)
    assert nodes[name].wait(timeout=20) == 0, log.read_text()
    assert 'Traceback' not in log.read_text()


@pytest.mark.parametrize(
    ('name', 'parameter', 'named'),
    [
        ('conveyor', 'look_ahead:=0', 'look_ahead'),
        ('conveyor', 'boxes_file:=/does/not/exist.csv', '/does/not/exist.csv'),
        ('planner', 'algorithm:=magic', 'magic'),
        ('planner', 'deadline_s:=-1.0', 'deadline_s'),
        ('planner', 'look_ahaed:=5', 'look_ahaed'),
        ('arm_executor', 'bin_type:=LDX', 'LDX'),
        ('arm_executor', 'open_bins:=4', 'open_bins'),
    ],
)
def test_a_wrong_parameter_ends_a_node_with_code_2_and_its_name(
    nodes, tmp_path, name, parameter, named
) -> None:
    log = tmp_path / f'{name}.log'
    nodes[name] = start(name, log, '-p', parameter)
    assert nodes[name].wait(timeout=20) == 2, log.read_text()
    assert named in log.read_text()
    assert log.read_text().count('\n') == 1
    assert 'Traceback' not in log.read_text()


@pytest.mark.parametrize('name', list(NODES))
def test_an_installed_node_is_an_executable_of_its_package(name) -> None:
    assert os.access(executable(*NODES[name]), os.X_OK)
