"""Kill any node, press Ctrl-C: no box is lost or doubled, and the cell says what happened."""

from __future__ import annotations

import pytest
from page_client import wait_until
from run_checks import TIMED, StartCell, assert_every_box_in_one_place, assert_rules_hold

from pack_cell.recording.reading import read_messages

pytestmark = pytest.mark.cell


@pytest.mark.parametrize('node', ['planner', 'conveyor', 'arm_executor'])
def test_after_a_kill_and_a_restart_the_run_goes_on(start_cell: StartCell, node: str) -> None:
    cell = start_cell('--count', '16', '--speed', '8', '--respawn', *TIMED)
    for _ in range(2):
        cell.wait_for_placements(3)
        cell.kill_node(node)
        cell.wait_for_line(f'node {node} was killed by SIGKILL')
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 16)
    assert_rules_hold(cell, 'LDC')
    assert cell.summary()['placed'] == 16, cell.text()


@pytest.mark.parametrize('node', ['planner', 'conveyor', 'arm_executor'])
def test_boxes_on_the_tilt_tray_survive_a_kill_faults_and_jams(
    start_cell: StartCell, node: str
) -> None:
    cell = start_cell(
        *('--count', '24', '--speed', '8', '--respawn', '--profile', 'dense'),
        *('--grasp-faces', 'tray', '--faults', 'all=0.02', '--jams', 'random:300,3'),
        *TIMED,
    )
    cell.wait_for_placements(4)
    cell.kill_node(node)
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 24)
    summary = cell.summary()
    assert summary['rule_violations'] == 0, cell.text()
    assert summary['turned_over'] > 0


@pytest.mark.physics
def test_the_bins_survive_a_kill_of_the_arm_in_physics(start_cell: StartCell) -> None:
    cell = start_cell('--count', '8', '--respawn')
    cell.wait_for_placements(3)
    cell.kill_node('arm_executor')
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 8)
    assert_rules_hold(cell, 'LDC')
    summary = cell.summary()
    assert summary['placed'] == 8, cell.text()
    assert summary['max_pose_error_mm'] < 5.0


@pytest.mark.parametrize('node', ['planner', 'conveyor', 'arm_executor'])
def test_without_respawn_a_dead_node_ends_the_run_with_its_name(
    start_cell: StartCell, node: str
) -> None:
    cell = start_cell('--speed', '8', *TIMED)
    cell.wait_for_placements(1)
    wait_until((cell.out / 'run.mcap').exists, 'the recorder')
    cell.kill_node(node)
    assert cell.wait(30) == 3, cell.text()
    assert f'node {node} was killed by SIGKILL' in '\n'.join(cell.lines)
    assert cell.summary()['unaccounted'] == 0, cell.summary()['problems']
    [kept] = (cell.out / 'state' / 'faults' / 'NODE_DIED').iterdir()
    list(read_messages(kept / 'last_seconds.mcap'))
    assert (kept / 'executor.sqlite').exists() and (kept / 'conveyor.sqlite').exists()


def test_ctrl_c_ends_with_code_0_and_a_summary(start_cell: StartCell) -> None:
    cell = start_cell('--speed', '8', *TIMED)
    cell.wait_for_placements(2)
    cell.interrupt()
    assert cell.wait(30) == 0, cell.text()
    summary = cell.summary()
    assert summary['placed'] >= 2
    assert summary['lost'] == 0
