"""With everything going wrong on the belt, every box ends in exactly one place."""

from __future__ import annotations

import json

import pytest
from run_checks import TIMED, StartCell

from conveyor_sim.streams import Stream, load_boxes

pytestmark = pytest.mark.cell

FAULTS = 'all=0.04'


@pytest.mark.parametrize('boxes', ['cartons', 'mpv:class=5,edge=600'])
def test_every_box_is_in_one_place_whatever_goes_wrong(start_cell: StartCell, boxes: str) -> None:
    asked = ('--boxes', boxes, '--count', '60', '--seed', '5')
    cell = start_cell(*TIMED, *asked, '--faults', FAULTS, '--destinations', '2')
    assert cell.wait(240.0) == 0, cell.text()
    summary, rows = cell.summary(), cell.placements()
    accounts = summary['accounts']
    assert accounts['sum_is_right'] and accounts['fed'] == summary['boxes_supplied'] == 60
    assert accounts['placed'] + sum(accounts['rejected'].values()) == 60
    assert (accounts['lost'], accounts['unknown'], summary['unaccounted']) == (0, 0, 0)
    assert len(accounts['rejected']) >= 3, accounts
    assert len({row['box_id'] for row in rows}) == len(rows) == 60
    for log in (cell.out / 'log').glob('*.log'):
        assert 'Traceback' not in log.read_text(), log.read_text()


def test_a_run_can_be_fed_again_with_the_same_boxes_in_the_same_order(
    start_cell: StartCell,
) -> None:
    cell = start_cell(*TIMED, '--boxes', 'draw:cartons', '--count', '6', '--seed', '3')
    assert cell.wait(120.0) == 0, cell.text()
    boxes, rejected = load_boxes(f'run:{cell.out}')
    assert rejected == []
    assert boxes == list(Stream.open('draw:cartons', 6, 3))
    assert json.loads((cell.out / 'summary.json').read_text())['boxes'] == 'draw:cartons'
