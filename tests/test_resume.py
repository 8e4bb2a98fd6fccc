"""A run that is cut goes on where it was: the same boxes, each in one place, one summary."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest
from cell_process import CellProcess
from run_checks import TIMED, StartCell

from pack_cell.chaos.book_checker import check_books, check_run

pytestmark = pytest.mark.cell

BOXES = 24


def cut(cell: CellProcess) -> None:
    """Kill `cell run` and its nodes at once, as a power cut does."""
    pids = json.loads((cell.out / 'pids.json').read_text()).values()
    for pid in (cell.process.pid, *pids):
        os.kill(pid, signal.SIGKILL)
    cell.process.wait()


def test_a_run_that_is_cut_twice_goes_on_without_its_box_file(
    start_cell: StartCell, tmp_path: Path
) -> None:
    path = tmp_path / 'orders.csv'
    rows = [f'b{n},{200 + 7 * n},{180 + 5 * n},{150 + 4 * n},{n % 9 + 1}' for n in range(BOXES)]
    path.write_text('\n'.join(['id,length_mm,width_mm,height_mm,weight_kg', *rows]) + '\n')
    cell = start_cell('--boxes', str(path), '--speed', '30', '--open-bins', '1', *TIMED)
    for placements in (5, 4):
        cell.wait_for_placements(placements)
        cut(cell)
        path.unlink(missing_ok=True)
        assert check_books(cell.out, BOXES, ended=False) == []
        cell = start_cell('--resume', str(cell.out), out=cell.out)
    assert cell.wait() == 0, cell.text()
    assert check_run(cell.out, BOXES) == [], cell.text()
    summary = cell.summary()
    assert summary['resumed']['times'] == 2
    assert summary['boxes'] == str(path)
    assert sum(summary['goal_codes'].values()) >= BOXES - 2
    again = start_cell('--resume', str(cell.out), out=cell.out)
    assert again.wait(30) == 0
    assert 'is complete' in again.text()
