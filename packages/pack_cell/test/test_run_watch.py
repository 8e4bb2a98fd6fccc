"""What ends a run, and what does not: people who have stopped it, and a belt that was drained."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pack_cell.options.run_options import RunOptions
from pack_cell.report.record import RunRecord
from pack_cell.running.run import EXIT_OK, EXIT_STALLED, RunWatch
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.codes import Condition

RUNNING = CellState(Condition.RUNNING, 'RUNNING')
DRAINED = CellState(Condition.ENDED, 'DRAINED by anna; the belt is empty.')


class Quiet:
    """A run in which nothing has happened for ``idle_s`` seconds."""

    def __init__(self, state, idle_s, scan=None):
        supervisor = SimpleNamespace(poll=list, pids=dict, tell=lambda name, number: None)
        record = RunRecord()
        if scan is not None:
            record.on_scan(scan)
        self.watch = RunWatch(
            replace(RunOptions(), stall_timeout_s=30.0),
            supervisor,
            record,
            SimpleNamespace(signal=None),
            0.0,
            Path(),
            None,
        )
        self.watch._recorder = SimpleNamespace(cell_state=state)
        self.watch._last_change = time.monotonic() - idle_s
        self.display = SimpleNamespace(on_state=lambda state: None)

    def ending(self):
        return self.watch._ending(self.display)


@pytest.mark.parametrize('condition', [Condition.PAUSED, Condition.STOPPED, Condition.ALARM])
def test_a_run_that_waits_for_people_does_not_stall(condition):
    quiet = Quiet(CellState(condition, 'by anna'), idle_s=1000.0)
    assert quiet.ending() is None
    quiet.watch._recorder.cell_state = RUNNING
    assert quiet.ending() is None, 'the time counts from when it goes on'


def test_a_run_in_which_nothing_happens_for_no_reason_stalls():
    ending = Quiet(RUNNING, idle_s=31.0).ending()
    assert ending.code == EXIT_STALLED and 'nothing has happened for 31 s' in ending.reason


def test_a_drained_run_ends_well_and_says_what_was_not_fed():
    ending = Quiet(DRAINED, 5.0, Scan(1, 1.0, remaining=12)).ending()
    assert (ending.code, ending.interrupted) == (EXIT_OK, False)
    assert ending.reason == 'DRAINED by anna; the belt is empty. 12 boxes were not fed'


def test_a_drained_run_does_not_end_before_its_boxes_have():
    assert Quiet(DRAINED, 5.0, Scan(1, 1.0, supplied=1, remaining=12)).ending() is None
