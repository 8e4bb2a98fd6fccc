"""A node of the cell hears this computer alone, unless a network is asked for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pack_cell.running.node_commands import NODES, executable

pytestmark = pytest.mark.ros

PROFILES = Path(__file__).resolve().parents[1] / 'tools' / 'fastdds.xml'
#: Ports of a ROS domain, by the DDS-RTPS standard.
FIRST_PORT, PORTS_OF_A_DOMAIN = 7400, 250
LOOPBACK = '127.0.0.1'


def heard_on(pid: int, domain: int) -> list[str]:
    """Addresses on which a process hears the messages of a domain."""
    sockets = set()
    for link in Path(f'/proc/{pid}/fd').iterdir():
        try:
            sockets.add(os.readlink(link))
        except OSError:
            continue
    first = FIRST_PORT + PORTS_OF_A_DOMAIN * domain
    addresses = []
    for line in Path('/proc/net/udp').read_text().splitlines()[1:]:
        words = line.split()
        address, port = words[1].split(':')
        mine = f'socket:[{words[9]}]' in sockets
        if mine and first <= int(port, 16) < first + PORTS_OF_A_DOMAIN:
            number = bytes.fromhex(address)[::-1]
            addresses.append('.'.join(map(str, number)))
    return addresses


@pytest.mark.skipif(
    not Path('/proc/net/udp').exists()
    or os.environ.get('RMW_IMPLEMENTATION') not in (None, 'rmw_fastrtps_cpp'),
    reason='asks Linux, about Fast DDS',
)
def test_a_node_hears_this_computer_alone(tmp_path: Path, ros_domain: int) -> None:
    program = str(executable(*NODES['conveyor']))
    log = tmp_path / 'conveyor.log'
    with log.open('wb') as out:
        process = subprocess.Popen(
            [sys.executable, program, '--ros-args', '-p', 'count:=4'],
            stdout=out,
            stderr=subprocess.STDOUT,
            env={
                **os.environ,
                'FASTRTPS_DEFAULT_PROFILES_FILE': str(PROFILES),
                'PYTHONUNBUFFERED': '1',
            },
        )
    try:
        while '[INFO]' not in log.read_text():
            assert process.poll() is None, log.read_text()
        addresses = heard_on(process.pid, ros_domain)
    finally:
        process.terminate()
        process.wait(timeout=20)
    assert addresses and set(addresses) == {LOOPBACK}
