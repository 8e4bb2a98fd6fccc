"""The supervisor starts, reaps, restarts and stops real processes."""

import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from pack_cell.running.supervisor import NodeSpec, Supervisor

PATIENT = 'import signal; print("up", flush=True); signal.pause()'
FAILING = 'import sys; print("no bins"); sys.exit(7)'
POLITE = (
    'import signal, sys\n'
    'signal.signal(signal.SIGINT, lambda *_: sys.exit(0))\n'
    'print("up", flush=True)\n'
    'signal.pause()\n'
)


def spec(folder: Path, name: str, code: str) -> NodeSpec:
    return NodeSpec(name, [sys.executable, '-c', code], folder / f'{name}.log')


def wait_for(condition, seconds=10.0):
    """Poll ``condition`` until it gives something true; fail after ``seconds``."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    pytest.fail(f'{condition} did not come true in {seconds} s')


def is_up(node: NodeSpec) -> bool:
    return node.log.exists() and 'up' in node.log.read_text()


def test_a_node_that_dies_is_reported_with_its_code_and_the_end_of_its_log(tmp_path):
    supervisor = Supervisor([spec(tmp_path, 'planner', FAILING)], {})
    supervisor.start()
    [death] = wait_for(supervisor.poll)
    assert 'planner ended with code 7' in str(death)
    assert death.tail() == ['no bins']
    assert supervisor.pids() == {}


@pytest.mark.parametrize(('number', 'name'), [(signal.SIGKILL, 'SIGKILL'), (35, 'signal 35')])
def test_a_killed_node_is_reported_with_the_signal(tmp_path, number, name):
    node = spec(tmp_path, 'arm', PATIENT)
    supervisor = Supervisor([node], {})
    supervisor.start()
    os.kill(supervisor.pids()['arm'], number)
    [death] = wait_for(supervisor.poll)
    assert f'killed by {name}' in str(death)


def test_with_respawn_a_dead_node_comes_back(tmp_path):
    node = spec(tmp_path, 'arm', PATIENT)
    supervisor = Supervisor([node], {}, respawn=True)
    supervisor.start()
    first = supervisor.pids()['arm']
    os.kill(first, signal.SIGKILL)
    [death] = wait_for(supervisor.poll)
    assert death.respawned
    assert supervisor.pids()['arm'] != first
    supervisor.stop()


def test_stop_ends_nodes_with_sigint_first(tmp_path):
    node = spec(tmp_path, 'polite', POLITE)
    supervisor = Supervisor([node], {})
    supervisor.start()
    wait_for(lambda: is_up(node))
    assert supervisor.stop() == {'polite': 0}


def test_an_attendant_that_dies_is_reported_and_not_started_again(tmp_path):
    node = replace(spec(tmp_path, 'recorder', FAILING), attendant=True)
    supervisor = Supervisor([node], {}, respawn=True)
    supervisor.start()
    [death] = wait_for(supervisor.poll)
    assert (death.attendant, death.respawned) == (True, False)
    assert supervisor.pids() == {}


def test_an_attendant_sees_the_others_out(tmp_path):
    told = tmp_path / 'ends'
    program = POLITE.replace('sys.exit(0)', f'open({str(told)!r}, "a").write(NAME)')
    program = program.replace('signal.pause()', f'signal.pause(); assert open({str(told)!r})')
    nodes = [
        replace(spec(tmp_path, name, f'NAME = {name!r}\n' + program), attendant=name == 'recorder')
        for name in ('recorder', 'arm')
    ]
    supervisor = Supervisor(nodes, {})
    supervisor.start()
    wait_for(lambda: all(map(is_up, nodes)))
    assert supervisor.stop() == {'arm': 0, 'recorder': 0}
    assert told.read_text() == 'armrecorder'


def test_nodes_do_not_outlive_a_supervisor_that_is_killed(tmp_path):
    log = tmp_path / 'child.log'
    program = (
        'import sys, signal\n'
        'from pathlib import Path\n'
        'from pack_cell.running.supervisor import NodeSpec, Supervisor\n'
        f'child = NodeSpec("child", [sys.executable, "-c", {PATIENT!r}], Path({str(log)!r}))\n'
        'supervisor = Supervisor([child], {})\n'
        'supervisor.start()\n'
        'print(supervisor.pids()["child"], flush=True)\n'
        'signal.pause()\n'
    )
    import subprocess

    parent = subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    wait_for(lambda: log.exists() and 'up' in log.read_text())
    parent.kill()
    parent.wait()

    def gone() -> bool:
        try:
            return Path(f'/proc/{child}/stat').read_text().split()[2] == 'Z'
        except FileNotFoundError:
            return True

    wait_for(gone)
