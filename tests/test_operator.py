"""An operator works a running cell from another terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from run_checks import TIMED, StartCell, assert_every_box_in_one_place

pytestmark = pytest.mark.cell


def verb(domain: int, *words: str) -> tuple[int, str]:
    """Exit code and text of ``cell WORDS``."""
    done = subprocess.run(
        [sys.executable, '-m', 'pack_cell', *words],
        capture_output=True,
        text=True,
        timeout=60,
        env=dict(os.environ, ROS_DOMAIN_ID=str(domain)),
    )
    return done.returncode, done.stdout + done.stderr


def test_a_paused_run_waits_and_a_drained_one_ends_well(
    start_cell: StartCell, ros_domain: int
) -> None:
    cell = start_cell('--count', '60', '--speed', '8', *TIMED)
    cell.wait_for_placements(2)
    code, text = verb(ros_domain, 'pause', '--who', 'anna', '--why', 'lunch')
    assert code == 0, text
    cell.wait_for_line(r'PAUSED by anna \(since \d\d:\d\d:\d\d\): lunch. To go on: cell resume')
    code, text = verb(ros_domain, 'status', '--json')
    state = json.loads(text)
    assert (code, state['state']) == (0, 'PAUSED')
    waits = {name: node['waits_for'] for name, node in state['nodes'].items()}
    assert waits == {
        'conveyor': 'the arm',
        'planner': 'the arm, which is paused, to be resumed',
        'arm_executor': 'an operator to resume',
    }
    assert verb(ros_domain, 'resume')[0] == 0
    cell.wait_for_placements(1)
    assert verb(ros_domain, 'drain', '--who', 'ben')[0] == 0
    assert cell.wait(60) == 0, cell.text()
    assert 'DRAINED by ben' in cell.lines[-1] and 'Not fed: ' in cell.lines[-1]
    summary = cell.summary()
    assert 0 < summary['placed'] == summary['boxes_supplied'] < 60
    assert_every_box_in_one_place(cell, summary['boxes_supplied'])


def test_at_the_end_of_a_shift_the_belt_is_emptied_and_every_bin_closed(
    start_cell: StartCell, ros_domain: int
) -> None:
    cell = start_cell('--count', '60', '--speed', '8', *TIMED)
    cell.wait_for_placements(2)
    code, text = verb(ros_domain, 'finish', '--who', 'anna')
    assert code == 0, text
    assert 'boxes went to the reject lane' in text and 'Closed: LDC-' in text
    assert cell.wait(60) == 0, cell.text()
    summary = cell.summary()
    assert summary['unaccounted'] == 0, summary['problems']
    assert summary['accounts']['on_belt'] == 0
    assert summary['accounts']['rejected'] == {'operator': summary['rejected']}
    assert summary['placed'] + summary['rejected'] == summary['boxes_supplied'] < 60
    in_bins = {row['bin_serial'] for row in cell.placements() if row['outcome'] == 'placed'}
    assert in_bins and len(in_bins) == summary['closed_bins']
