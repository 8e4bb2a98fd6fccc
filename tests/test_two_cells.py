"""Two cells in one ROS domain, each under a namespace of its own, with frames of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from pack_cell.ros.executables import NODES, executable
from pack_msgs.msg import BoxEvent
from pack_msgs_py.ros.qos import TOPICS
from pack_msgs_py.ros.testing import Spinner
from pack_msgs_py.ros.transforms import STATIC_FRAMES

pytestmark = pytest.mark.cell

BOXES = 20
TIMEOUT_S = 120.0
CELLS = {
    'north': {'robot': 'ur20', 'bin_type': 'LDC', 'seed': 3},
    'south': {'robot': 'ur10e', 'bin_type': 'EQ', 'seed': 4},
}


class Listener(Node):
    """Hears both cells."""

    def __init__(self, **arguments: object) -> None:
        super().__init__('listener', **arguments)
        self.changed = threading.Condition()
        self.ended: dict[str, set[str]] = {name: set() for name in CELLS}
        self.frames: set[tuple[str, str]] = set()
        for name in CELLS:
            self.create_subscription(
                BoxEvent, f'/{name}/box_event', self._hear(name), TOPICS['box_event']
            )
        self.create_subscription(TFMessage, '/tf_static', self._on_frames, STATIC_FRAMES)

    def _hear(self, name: str):
        def hear(msg: BoxEvent) -> None:
            if msg.event in (BoxEvent.PLACED, BoxEvent.REJECTED):
                with self.changed:
                    self.ended[name].add(msg.box_id)
                    self.changed.notify_all()

        return hear

    def _on_frames(self, msg: TFMessage) -> None:
        self.frames |= {(item.header.frame_id, item.child_frame_id) for item in msg.transforms}


def parameters_of(name: str) -> dict[str, dict[str, object]]:
    cell = CELLS[name]
    return {
        'conveyor': {'count': BOXES, 'seed': cell['seed'], 'speed': 0.0},
        'planner': {'orientations': 'upright', 'frame_prefix': f'{name}/', 'max_payload_kg': 8.0},
        'arm_executor': {
            'arm': 'timed', 'speed': 0.0, 'orientations': 'upright', 'frame_prefix': f'{name}/',
            'robot': cell['robot'], 'bin_type': cell['bin_type'],
        },
    }  # fmt: skip


@pytest.fixture
def cells(ros_domain: int, tmp_path: Path) -> Iterator[Path]:
    """Both cells, as processes; their logs are in the folder."""
    processes = []
    for name in CELLS:
        for node, parameters in parameters_of(name).items():
            words = [
                word for key, value in parameters.items() for word in ('-p', f'{key}:={value}')
            ]
            command = [str(executable(*NODES[node])), '--ros-args', '-r', f'__ns:=/{name}', *words]
            with (tmp_path / f'{name}-{node}.log').open('wb') as log:
                processes.append(
                    subprocess.Popen(
                        [sys.executable, *command],
                        stdout=log,
                        stderr=subprocess.STDOUT,
                        env=dict(os.environ, PYTHONUNBUFFERED='1'),
                    )
                )
    yield tmp_path
    for process in processes:
        process.terminate()
    for process in processes:
        process.wait(timeout=20)


def test_two_cells_side_by_side_pack_their_own_boxes(cells: Path, ros_domain: int) -> None:
    with Spinner(domain=ros_domain) as spinner:
        listener = spinner.add(Listener(context=spinner.context))
        until = time.monotonic() + TIMEOUT_S
        with listener.changed:
            while time.monotonic() < until and any(
                len(ended) < BOXES for ended in listener.ended.values()
            ):
                listener.changed.wait(1.0)
        logs = {path.name: path.read_text(errors='replace')[-1500:] for path in cells.glob('*.log')}
        counts = {name: len(ended) for name, ended in listener.ended.items()}
        assert counts == dict.fromkeys(CELLS, BOXES), logs
        children = {child for _, child in listener.frames}
        for name in CELLS:
            assert {f'{name}/bin_a', f'{name}/bin_b', f'{name}/belt'} <= children
        assert all(child.startswith(('north/', 'south/')) for child in children)
        assert all(parent.split('/')[0] == child.split('/')[0] for parent, child in listener.frames)
