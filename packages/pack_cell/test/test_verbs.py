"""Every verb of an operator, tried against the real nodes of a cell in a namespace of its own."""

from __future__ import annotations

import json
import re
import time

import pytest

pytest.importorskip('rclpy')

from rclpy.node import Node
from rclpy.parameter import Parameter

from arm_executor.ros.node import ArmExecutor
from conveyor_sim.ros.node import ConveyorNode
from pack_cell.operate.command import EXIT_DONE, EXIT_NO_CELL, EXIT_REFUSED, operate
from pack_msgs.msg import CellState as CellStateMsg
from pack_msgs_py.cell_state import CellState, NodeState
from pack_msgs_py.codes import Condition, Level
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros


def parameters(**values):
    return [Parameter(name, value=value) for name, value in values.items()]


@pytest.fixture
def cell(ros_domain, capsys):
    """Belt and arm without a planner; returns a function that carries out a verb."""
    with Spinner() as spinner:
        arm = ArmExecutor(
            context=spinner.context,
            namespace='north',
            parameter_overrides=parameters(arm='timed', speed=0.0, open_bins=2),
        )
        spinner.add(arm, arm.stop_motion)
        belt = ConveyorNode(
            context=spinner.context,
            namespace='north',
            parameter_overrides=parameters(speed=0.0, count=20),
        )
        spinner.add(belt)

        def verb(*words):
            capsys.readouterr()
            code = operate([*words, '--domain', str(ros_domain), '--timeout', '20'])
            heard = capsys.readouterr()
            return code, (heard.out + heard.err).strip()

        yield verb


#: Words, exit code, and what is answered; in this order against one cell.
STORY = [
    ('ack', EXIT_REFUSED, 'cell ack: no alarm and no warning stands'),
    ('pause --who anna --why lunch', EXIT_DONE, 'The arm is paused.'),
    ('pause', EXIT_REFUSED, r'cell pause: the arm is PAUSED by anna \(since .*\): lunch; .*resume'),
    (
        'insert box-1 300x200x150 --bin A --at 0,0,0',
        EXIT_DONE,
        r"Box 'box-1' is in bin LDC-1 at \(0, 0, 0\) mm.",
    ),
    (
        'insert box-2 300x200x150 --bin A --at 100,0,0',
        EXIT_REFUSED,
        r"cell insert: box 'box-2' at \(100, 0, 0\) mm would stand in box 'box-1'.*",
    ),
    (
        'insert box-2 300x200x150 --bin A --at 0,0,150',
        EXIT_DONE,
        r"Box 'box-2' is in bin LDC-1 at \(0, 0, 150\) mm.",
    ),
    (
        'remove box-1 --why lemons',
        EXIT_DONE,
        "Box 'box-1' is out of its bin; it carried box-2: look how they stand now.",
    ),
    ('insert box-3 300x200x150', EXIT_DONE, "Box 'box-3' lies on the belt, or waits .*"),
    ('remove box-3', EXIT_DONE, "Box 'box-3' is off the belt."),
    ('remove box-4', EXIT_REFUSED, "cell remove: box 'box-4' is not on the belt: .* not known"),
    ('hold A', EXIT_DONE, 'Bin LDC-1 is held; .* cell release LDC-1.'),
    ('hold LDC-1', EXIT_REFUSED, 'cell hold: bin LDC-1 is held already'),
    ('release A', EXIT_DONE, 'Bin LDC-1 is filled again.'),
    ('swap A', EXIT_DONE, 'Bin LDC-1 closed with 1 box; empty bin LDC-3 is open.'),
    ('close B', EXIT_DONE, 'Bin LDC-2 closed with 0 boxes; .*until: cell swap B.'),
    ('close B', EXIT_REFUSED, "cell close: there is no open bin 'B'; open are LDC-3 at A"),
    ('swap B', EXIT_DONE, 'Empty bin LDC-4 stands at station B.'),
    ('resume', EXIT_DONE, 'The arm goes on.'),
    ('resume', EXIT_REFUSED, 'cell resume: the arm is not paused: its mode is IDLE'),
    ('insert box-5 300x200x150 --bin A --at 0,0,0', EXIT_REFUSED, '.* cell pause first'),
    ('stop --who ben', EXIT_DONE, 'The arm stops and keeps what it holds; to go on: cell reset.'),
    ('reset', EXIT_DONE, 'The gripper was empty.'),
    ('drain', EXIT_DONE, 'No more boxes are fed; 5 on the belt are still packed.'),
    ('drain', EXIT_REFUSED, 'cell drain: the belt is DRAINED by .* to go on: cell feed'),
    ('empty', EXIT_DONE, '5 boxes went to the reject lane, no more are fed.'),
    ('feed', EXIT_DONE, 'Boxes are fed again.'),
    ('insert box-6 0x1x1', 2, ''),
]


def test_every_verb_answers_with_a_sentence(cell):
    for words, code, said in STORY:
        if code == EXIT_NO_CELL:
            with pytest.raises(SystemExit):
                cell(*words.split())
            continue
        answered = cell(*words.split())
        assert answered[0] == code and re.fullmatch(said, answered[1], re.DOTALL), (words, answered)


def test_the_state_is_told_in_words_and_as_json(cell):
    cell('pause', '--who', 'anna')
    code, text = cell('status')
    assert code in (EXIT_DONE, EXIT_REFUSED)
    assert text.splitlines()[0].startswith('PAUSED by anna (since ')
    assert text.splitlines()[1] == 'Next: To go on: cell resume'
    state = json.loads(cell('status', '--json')[1])
    assert state['state'] == 'PAUSED' and state['nodes']['planner']['state'] == 'not heard'


def test_of_a_node_that_hangs_the_monitor_knows_more_than_who_has_just_come(ros_domain, capsys):
    told = CellState(
        Condition.FAULT,
        'FAULT: arm_executor is silent for 9 s.',
        'Look at its log, and restart arm_executor.',
        (NodeState('arm_executor', Level.STALE, 'silent for 9 s'),),
        stamp_s=time.time(),
    )
    with Spinner() as spinner:
        node = Node('cell_monitor', context=spinner.context)
        node.create_publisher(CellStateMsg, 'cell_state', qos.TOPICS['cell_state']).publish(
            conversions.cell_state_to_ros(told)
        )
        spinner.add(node)
        belt = ConveyorNode(context=spinner.context, parameter_overrides=parameters(count=20))
        spinner.add(belt)
        words = ['--domain', str(ros_domain), '--timeout', '3']
        assert operate(['status', *words]) == EXIT_REFUSED
        assert capsys.readouterr().out.startswith('FAULT: arm_executor is silent for 9 s.')
        assert operate(['drain', *words]) == EXIT_DONE
        capsys.readouterr()
        assert operate(['stop', *words]) == EXIT_NO_CELL
        said = capsys.readouterr().err
        assert operate(['finish', *words]) == EXIT_NO_CELL
        assert 'arm_executor/operate of the cell in / is not there: its node is down' in said


def test_at_the_end_of_the_shift_the_belt_is_empty_and_the_bins_are_closed(cell):
    cell('pause')
    cell('insert', 'box-1', '300x200x150', '--bin', 'A', '--at', '0,0,0')
    code, text = cell('finish')
    assert (code, text.splitlines()) == (
        EXIT_DONE,
        [
            '5 boxes went to the reject lane, no more are fed.',
            'Closed: LDC-1.',
            'The arm goes on.',
        ],
    )


def test_where_no_cell_runs_that_is_said(ros_domain, capsys):
    assert operate(['pause', '--domain', str(ros_domain), '--timeout', '0.5']) == EXIT_NO_CELL
    said = capsys.readouterr().err
    assert said == (
        f'cell pause: no cell runs in ROS domain {ros_domain}: start one with cell run, '
        'or say --domain\n'
    )
