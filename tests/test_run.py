"""The cell packs real boxes and accounts for each of them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from run_checks import TIMED, StartCell, assert_every_box_in_one_place, assert_rules_hold, replay

from conveyor_sim.streams import load_boxes
from pack_msgs_py.orientation import oriented_size

pytestmark = pytest.mark.cell


@pytest.mark.physics
def test_the_arm_packs_twelve_boxes_where_the_planner_says(start_cell: StartCell) -> None:
    cell = start_cell('--count', '12')
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 12)
    assert_rules_hold(cell, 'LDC')
    summary = cell.summary()
    assert summary['placed'] == 12, cell.text()
    assert summary['rule_violations'] == 0
    assert summary['max_pose_error_mm'] < 5.0
    for boxes in replay(cell).values():
        for placed in boxes:
            centre = [c + s / 2 for c, s in zip(placed.corner_mm, placed.size_mm, strict=True)]
            assert placed.measured_mm is not None
            assert math.dist(centre[:2], placed.measured_mm[:2]) < 5.0, placed
            edge = oriented_size(placed.box.size_mm, placed.orientation)[2]
            height = placed.corner_mm[2] + edge / 2
            assert abs(height - placed.measured_mm[2]) < 5.0, placed


@pytest.mark.parametrize('bin_type', ['EQ', 'SYN', '100x70x60'])
def test_bins_are_closed_and_swapped_and_the_rules_hold(
    start_cell: StartCell, bin_type: str
) -> None:
    cell = start_cell('--count', '60', '--bin', bin_type, '--open-bins', '1', *TIMED)
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 60)
    assert_rules_hold(cell, bin_type)
    summary = cell.summary()
    assert summary['closed_bins'] >= 2
    assert summary['fill_closed'] > 10.0
    assert summary['fill_first_failure'] is not None


@pytest.mark.parametrize('bin_type', ['120x80x150:pallet', '110x75x160:cage'])
def test_a_pallet_or_a_cage_of_any_size_is_packed(start_cell: StartCell, bin_type: str) -> None:
    cell = start_cell('--count', '15', '--bin', bin_type, '--open-bins', '2', *TIMED)
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 15)
    assert_rules_hold(cell, bin_type)
    summary = cell.summary()
    assert (summary['bin'], summary['placed']) == (bin_type, 15)
    assert {row['bin_type'] for row in cell.placements()} == {bin_type}


def test_the_same_seed_gives_the_same_plan_with_an_exact_scanner(start_cell: StartCell) -> None:
    plans = []
    for _ in range(2):
        cell = start_cell('--count', '25', '--seed', '7', '--scan-sigma', '0', *TIMED)
        assert cell.wait() == 0, cell.text()
        rows = sorted(cell.placements(), key=lambda row: row['box_id'])
        plans.append([(r['box_id'], r['bin_serial'], r['position_mm']) for r in rows])
    assert plans[0] == plans[1]


def test_bad_rows_of_a_box_file_are_rejected_and_the_rest_is_packed(
    start_cell: StartCell, tmp_path: Path
) -> None:
    path = tmp_path / 'boxes.csv'
    path.write_text(
        'id,length_mm,width_mm,height_mm,weight_kg\n'
        'good-1,300,200,150,2.0\n'
        'nan,nan,200,150,2.0\n'
        'weightless,300,200,150,0\n'
        'good-1,300,200,150,2.0\n'
        'too-long,1900,200,150,2.0\n'
        'too-heavy,300,200,150,45\n'
        'good-2,250,200,150,2.0\n'
    )
    cell = start_cell('--boxes', str(path), *TIMED)
    assert cell.wait() == 0, cell.text()
    summary = cell.summary()
    assert (summary['boxes_supplied'], summary['placed'], summary['rejected']) == (7, 3, 4)
    assert (summary['lost'], summary['unaccounted']) == (0, 0), summary['problems']
    reasons = {row['reason'].split(':')[0] for row in cell.placements() if row['reason']}
    assert reasons == {'invalid_data', 'oversize', 'overweight'}


def test_names_are_literal_and_a_box_file_that_is_deleted_changes_nothing(
    start_cell: StartCell, tmp_path: Path
) -> None:
    names = ['box[1]', '[red]A', 'KARTON[/2]', 'lot:key:12', '=1+1']
    path = tmp_path / 'boxes [red].csv'
    rows = ''.join(f'{name},300,200,150,2\n' for name in names)
    path.write_text('id,length_mm,width_mm,height_mm,weight_kg\n' + rows)
    cell = start_cell('--boxes', str(path), *TIMED)
    cell.wait_for_placements(1, seconds=240)
    path.unlink()
    assert cell.wait() == 0, cell.text()
    assert all(name in cell.text() for name in names)
    assert [row['box_id'] for row in cell.placements() if row['outcome'] == 'placed']
    boxes, rejected = load_boxes(f'run:{cell.out}')
    assert ([box.id for box in boxes], rejected) == (names, [])


def test_nothing_moves_when_no_deadline_can_be_met_and_the_reason_is_told(
    start_cell: StartCell,
) -> None:
    cell = start_cell(
        '--count', '3', '--arm', 'timed', '--deadline', '0.5', '--stall-timeout', '60'
    )
    code = cell.wait()
    summary = cell.summary()
    assert summary['placed'] == 0
    assert set(summary['goal_codes']) <= {'DEADLINE_UNREACHABLE'}
    assert (summary['rejected'], summary['lost']) == (3, 0)
    assert all(row['reason'].startswith('unreachable') for row in cell.placements())
    assert code in (0, 4), cell.text()


def test_two_cells_at_once_do_not_disturb_each_other(
    start_cell: StartCell, other_domain: int
) -> None:
    first = start_cell('--count', '20', *TIMED)
    second = start_cell('--count', '15', *TIMED, domain=other_domain)
    assert first.wait() == 0, first.text()
    assert second.wait() == 0, second.text()
    assert_every_box_in_one_place(first, 20)
    assert_every_box_in_one_place(second, 15)


def test_a_second_cell_in_the_same_domain_is_refused(start_cell: StartCell) -> None:
    first = start_cell('--count', '0', '--arm', 'timed', '--speed', '1')
    first.wait_for_placements(1)
    second = start_cell('--count', '5', *TIMED)
    assert second.wait() == 2
    assert 'another cell runs in ROS domain' in second.text()
    first.interrupt()
    assert first.wait() == 0
