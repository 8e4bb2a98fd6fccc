"""What ends a run, and what does not: people who have stopped it, and a belt that was drained."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pack_cell.options.run_options import RunOptions
from pack_cell.report.record import RunRecord
from pack_cell.running.run_watch import EXIT_OK, EXIT_STALLED, RunWatch
from pack_msgs_py.cell_state import CellState, NodeState
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.codes import Condition

RUNNING = CellState(Condition.RUNNING, 'RUNNING')
DRAINED = CellState(Condition.ENDED, 'DRAINED by anna; the belt is empty.')


class Quiet:
    """A run in which nothing has happened for ``idle_s`` seconds."""

    def __init__(self, state, idle_s, scan=None):
        supervisor = SimpleNamespace(
            poll=list, pids=dict, tell=lambda name, number: None, started_s=lambda: self.started
        )
        self.started, self.said, self.starts = {}, [], set()
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
        self.heard = {'conveyor': math.inf, 'planner': math.inf, 'arm_executor': math.inf}
        listened = SimpleNamespace(
            heard_s=self.heard.__getitem__, starts=lambda name: name in self.starts
        )
        self.watch._recorder = SimpleNamespace(cell_state=state, watch=listened)
        self.watch._last_change = time.monotonic() - idle_s
        self.display = SimpleNamespace(
            on_state=lambda state: None, say=lambda text, style: self.said.append(text)
        )

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
    assert ending.reason == 'DRAINED by anna; the belt is empty. Not fed: 12 boxes'


def test_a_drained_run_does_not_end_before_its_boxes_have():
    assert Quiet(DRAINED, 5.0, Scan(1, 1.0, supplied=1, remaining=12)).ending() is None


def starting(seconds, *, said='not heard', name='arm_executor'):
    """A cell in which nothing has happened since a node was started ``seconds`` ago."""
    nodes = (NodeState('planner', state='waiting'), NodeState(name, state=said))
    quiet = Quiet(CellState(Condition.STARTING, 'STARTING', nodes=nodes), idle_s=seconds)
    quiet.started = {name: time.monotonic() - seconds, 'topic_recorder': 0.0}
    quiet.heard[name] = -math.inf
    return quiet


def test_the_clock_of_the_stall_begins_when_every_node_is_up():
    quiet = starting(200.0)
    assert quiet.ending() is None
    quiet.heard['arm_executor'] = time.monotonic()
    assert quiet.ending() is None, 'the time counts from when the cell is complete'
    assert quiet.said == ['       waits for arm_executor to come up, for 200 s by now']


def test_a_node_that_does_not_come_up_is_named():
    ending = starting(301.0).ending()
    assert ending.code == EXIT_STALLED
    assert 'node arm_executor has not come up within 301 s (not heard)' in ending.reason


def test_an_arm_that_is_not_ready_is_not_up():
    quiet = starting(301.0, said='the arm is being made ready')
    quiet.heard['arm_executor'] = time.monotonic()
    quiet.starts.add('arm_executor')
    assert '(the arm is being made ready)' in quiet.ending().reason


def test_while_the_planner_compiles_its_search_nothing_stalls():
    quiet = starting(200.0, name='planner', said='starting')
    quiet.heard['planner'] = time.monotonic()
    quiet.starts.add('planner')
    assert quiet.ending() is None
    assert quiet.said == ['       waits for planner to come up, for 200 s by now']


def test_an_arm_that_somebody_deactivates_later_is_a_stall_in_time():
    quiet = starting(400.0)
    quiet.heard['arm_executor'] = time.monotonic()
    assert quiet.ending().reason.startswith('nothing has happened for 400 s')
    quiet.starts.add('arm_executor')
    assert quiet.ending().reason.startswith('nothing has happened for 400 s')


def test_what_a_dead_node_has_said_last_is_not_the_word_of_the_new_one():
    quiet = starting(200.0)
    quiet.heard['arm_executor'] = quiet.started['arm_executor'] + 0.3
    assert quiet.ending() is None
