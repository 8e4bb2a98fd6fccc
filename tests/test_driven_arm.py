"""The cell with a robot that a driver moves: the same books and reports as in physics."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from run_checks import StartCell, assert_every_box_in_one_place, assert_rules_hold

pytest.importorskip('control_msgs')
pytest.importorskip('ur_msgs')

pytestmark = [pytest.mark.cell, pytest.mark.physics]

ROBOT = Path(__file__).parents[1] / 'packages' / 'arm_executor' / 'test' / 'fake_robot.py'
SPEED = '4'
#: Steps of a placement in the journal, as any arm leaves them.
STEPS = ['planned', 'picked', 'releasing', 'placed', 'verified']


@pytest.fixture
def robot(ros_domain: int) -> Iterator[None]:
    """A robot of its own with its driver, which stands at x = 0."""
    process = subprocess.Popen(
        [sys.executable, str(ROBOT), '0.0', SPEED],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ, ROS_DOMAIN_ID=str(ros_domain)),
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == 'ready'
    yield
    process.terminate()
    process.wait(timeout=20)


def test_a_driven_robot_packs_boxes_as_the_one_in_physics_does(
    robot: None, start_cell: StartCell, tmp_path: Path
) -> None:
    layout = tmp_path / 'layout.yaml'
    layout.write_text('rail:\n  x_min: 0\n  x_max: 0\n')
    cell = start_cell(
        *('--arm', 'trajectory', '--speed', SPEED, '--layout', str(layout), '--bin', 'EQ'),
        *('--count', '6', '--deadline', '60', '--algorithm', 'mpack_lite'),
        *('--grasp-faces', 'top', '--executor', 'trajectory.silent_s=10'),
    )
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 6)
    assert_rules_hold(cell, 'EQ')
    summary = cell.summary()
    assert (summary['placed'], summary['arm']) == (6, 'trajectory')
    assert summary['max_pose_error_mm'] < 5.0
    with closing(sqlite3.connect(cell.out / 'state' / 'executor.sqlite')) as books:
        rows = books.execute('SELECT attempt, step FROM step ORDER BY rowid').fetchall()
        events = books.execute('SELECT box_id, event FROM event ORDER BY sequence').fetchall()
    for attempt in {row[0] for row in rows}:
        assert [step for number, step in rows if number == attempt] == STEPS
    for box_id in {row[0] for row in events}:
        assert [event for name, event in events if name == box_id] == [1, 2]
