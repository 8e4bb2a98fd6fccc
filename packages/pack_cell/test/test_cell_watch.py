"""What the nodes say, put together: one state, one sentence, one thing to do."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_cell.watching.cell_watch import NODES, STARTING_S, CellWatch
from pack_cell.watching.state_text import status_json, status_lines
from pack_msgs_py.alarms import Alarm, raised
from pack_msgs_py.codes import Condition, Level, Mode

PAUSED = 'PAUSED by anna (since 14:03:12): lunch'
DRAINED = 'DRAINED by ben (since 15:00:00)'


class Heard:
    """A watch with a clock, and a cell that works unless told otherwise."""

    def __init__(self):
        self.now = 100.0
        self.watch = CellWatch(lambda: self.now)

    def all_well(self, mode=Mode.IDLE, message='', belt='running', said='', boxes=5, remaining=10):
        self.watch.on_heartbeat(mode, 'b1' if mode is Mode.EXECUTING else '', message)
        values = {'mode': mode.name}
        self.watch.on_diagnostics('arm_executor', Level.OK, message, values)
        self.watch.on_diagnostics('planner', Level.OK, 'deciding', {'waits_for': ''})
        self.watch.on_diagnostics('conveyor', Level.OK, said or belt, {'belt': belt})
        self.watch.on_scan(boxes, remaining)
        return self

    @property
    def state(self):
        return self.watch.state()


def test_nobody_is_heard():
    state = Heard().state
    assert (state.condition, state.next_action) == (Condition.UNKNOWN, 'Start one: cell run')


@pytest.mark.parametrize(
    ('told', 'condition', 'summary', 'action'),
    [
        (
            {'mode': Mode.EXECUTING},
            Condition.RUNNING,
            "RUNNING: the arm is placing box 'b1', 5 boxes on the belt.",
            '',
        ),
        ({'boxes': 0}, Condition.WAITING, 'WAITING for boxes: the belt is empty.', ''),
        (
            {'boxes': 0, 'remaining': 0},
            Condition.ENDED,
            'ENDED: every box has come to its end.',
            '',
        ),
        (
            {'mode': Mode.PAUSED, 'message': PAUSED},
            Condition.PAUSED,
            PAUSED,
            'To go on: cell resume',
        ),
        (
            {'belt': 'paused', 'said': PAUSED},
            Condition.PAUSED,
            f'The belt is {PAUSED}',
            'To go on: cell resume',
        ),
        (
            {'belt': 'draining', 'said': DRAINED},
            Condition.DRAINING,
            f'{DRAINED}; 5 boxes on the belt still to be packed.',
            '',
        ),
        (
            {'belt': 'draining', 'said': DRAINED, 'boxes': 0},
            Condition.ENDED,
            f'{DRAINED}; the belt is empty.',
            'To go on: cell feed',
        ),
        (
            {'mode': Mode.PROTECTIVE_STOP, 'message': 'stopped by anna'},
            Condition.STOPPED,
            'STOPPED: stopped by anna',
            'See that nobody is near the arm, then: cell reset',
        ),
        (
            {'mode': Mode.FAULT, 'message': 'RuntimeError: 7'},
            Condition.FAULT,
            'FAULT: RuntimeError: 7',
            'Look at the arm and at its log, and restart arm_executor.',
        ),
        ({'mode': Mode.INACTIVE}, Condition.STARTING, 'STARTING: waits for the arm.', ''),
    ],
)
def test_the_state_has_a_sentence_and_one_next_action(told, condition, summary, action):
    state = Heard().all_well(**told).state
    assert (state.condition, state.summary, state.next_action) == (condition, summary, action)


def test_an_alarm_of_any_node_comes_before_a_pause_and_says_what_to_do():
    heard = Heard().all_well(mode=Mode.PAUSED, message=PAUSED)
    jam = raised('JAM', 'the belt has jammed', 5.0)
    heard.watch.on_alarms('/arm_executor', (raised('GRASP_FAILED', 'no vacuum', 1.0),))
    heard.watch.on_alarms('/conveyor', (jam,))
    state = heard.state
    assert (state.condition, state.summary) == (Condition.ALARM, 'ALARM JAM: the belt has jammed')
    assert state.next_action == jam.action
    assert [alarm.code for alarm in state.alarms] == ['JAM', 'GRASP_FAILED']
    heard.watch.on_alarms('/conveyor', ())
    assert heard.state.condition is Condition.PAUSED


def test_a_node_that_falls_silent_is_named_with_how_long():
    heard = Heard().all_well()
    heard.now += 2.5
    heard.watch.on_diagnostics('conveyor', Level.OK, 'running', {'belt': 'running'})
    heard.watch.on_diagnostics('planner', Level.OK, 'deciding', {})
    state = heard.state
    assert state.condition is Condition.FAULT
    assert state.summary == 'FAULT: arm_executor is silent for 2 s.'
    assert state.next_action == 'Look at its log, and restart arm_executor.'
    heard.watch.on_heartbeat(Mode.IDLE, '', '')
    assert heard.state.condition is Condition.RUNNING


def test_a_node_that_never_comes_is_missing_only_after_a_while():
    heard = Heard()
    heard.watch.on_heartbeat(Mode.IDLE, '', '')
    heard.watch.on_scan(5, 5)
    assert heard.state.condition is Condition.STARTING
    heard.now += STARTING_S + 1
    heard.watch.on_heartbeat(Mode.IDLE, '', '')
    state = heard.state
    assert state.condition is Condition.FAULT
    assert state.summary == 'FAULT: conveyor is not heard and planner is not heard.'


def test_a_node_says_what_it_waits_for():
    heard = Heard().all_well()
    heard.watch.on_diagnostics('planner', Level.OK, 'waiting', {'waits_for': 'boxes'})
    planner = next(node for node in heard.state.nodes if node.name == 'planner')
    assert (planner.state, planner.waits_for) == ('waiting', 'boxes')
    assert any('planner' in line.plain and 'waits for boxes' in line.plain
               for line in status_lines(heard.state))  # fmt: skip


@given(
    st.sampled_from(Mode),
    st.sampled_from(['running', 'paused', 'jammed', 'draining', 'standing with the arm']),
    st.integers(0, 6),
    st.integers(-1, 9),
    st.booleans(),
)
def test_whatever_is_heard_there_is_one_sentence_and_json(mode, belt, boxes, remaining, alarmed):
    heard = Heard().all_well(mode=mode, belt=belt, boxes=boxes, remaining=remaining)
    if alarmed:
        heard.watch.on_alarms('/x', (Alarm('X', 'm'),))
    state = heard.state
    assert state.summary
    assert {node.name for node in state.nodes} == set(NODES)
    assert (state.condition is Condition.ALARM) == (
        (alarmed or mode is Mode.ALARM) and mode is not Mode.FAULT
    )
    assert json.loads(json.dumps(status_json(state)))['state'] == state.condition.name


def test_a_cell_whose_belt_was_not_seen_yet_waits_for_the_belt_and_not_for_its_arm():
    heard = Heard()
    heard.watch.on_heartbeat(Mode.EXECUTING, 'b1', '')
    for node in NODES:
        heard.watch.on_diagnostics(node, Level.OK, 'running', {})
    assert heard.state.summary == 'STARTING: waits for the belt.'
    assert not heard.watch.complete
    heard.watch.on_scan(5, 10)
    assert heard.watch.complete and heard.state.condition is Condition.RUNNING


def test_a_planner_that_compiles_its_search_says_that_it_starts():
    heard = Heard().all_well()
    assert not any(heard.watch.starts(node) for node in NODES)
    heard.watch.on_diagnostics('planner', Level.OK, 'starting', {})
    heard.watch.on_heartbeat(Mode.INACTIVE, '', 'starting')
    assert [node for node in NODES if heard.watch.starts(node)] == ['planner', 'arm_executor']
