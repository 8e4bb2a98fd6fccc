"""The launch file takes what `cell run` takes."""

from __future__ import annotations

import pytest

from pack_cell.launching import ARGUMENTS, launched_nodes
from pack_cell.options import OneLineParser, add_run_options

#: Options of `cell run` that are about the run as a whole, not about its nodes.
OF_THE_RUN = {'--help', '--respawn', '--stall-timeout', '--out', '--quiet', '--planner'}


def test_every_option_of_a_node_is_an_argument():
    parser = OneLineParser(prog='cell run')
    add_run_options(parser, ('mpack_lite',))
    options = {one for action in parser._actions for one in action.option_strings if one[2:]}
    assert options - OF_THE_RUN - {'-h'} == {option for option, _, _ in ARGUMENTS.values()}


def test_defaults_are_those_of_the_run_in_real_time():
    defaults = {name: default for name, (_, default, _) in ARGUMENTS.items()}
    found = launched_nodes(defaults, state_dir='/somewhere')
    assert set(found) == {'conveyor', 'planner', 'arm_executor'}
    assert found['conveyor']['size_sigma'] == 2.0 and found['planner']['size_sigmas'] == 2.0
    assert found['conveyor']['speed'] == found['arm_executor']['speed'] == 1.0
    assert found['planner']['max_payload_kg'] > 0
    assert found['conveyor']['state_dir'] == found['arm_executor']['state_dir'] == '/somewhere'


def test_arguments_become_parameters_of_the_nodes_that_they_are_about():
    found = launched_nodes(
        {
            'belt_mode': 'continuous', 'arrivals': 'poisson:900', 'jams': 'random:600,20',
            'faults': 'all=0.01', 'scan_sigma': '3', 'size_sigmas': '1', 'max_laps': '7',
            'destinations': '2', 'arm': 'timed',
        }
    )  # fmt: skip
    conveyor = found['conveyor']
    assert (conveyor['belt_mode'], conveyor['arrivals'], conveyor['jams']) == (
        'continuous', 'poisson:900', 'random:600,20',
    )  # fmt: skip
    assert (conveyor['faults'], conveyor['size_sigma'], conveyor['max_laps']) == (
        'all=0.01',
        3.0,
        7,
    )
    assert found['planner']['size_sigmas'] == found['arm_executor']['size_sigmas'] == 1.0
    assert (conveyor['destinations'], found['arm_executor']['destinations']) == (2, 'D1,D2')


@pytest.mark.parametrize('wrong', [{'speed': 'fast'}, {'arm': 'robot'}, {'max_laps': '-1'}])
def test_a_wrong_argument_ends_the_launch(wrong, capsys):
    with pytest.raises(SystemExit):
        launched_nodes(wrong)
    assert 'cell.launch.py' in capsys.readouterr().err


def test_a_cell_that_cannot_be_run_is_refused():
    with pytest.raises(ValueError, match='jams'):
        launched_nodes({'jams': 'sometimes'})


@pytest.mark.parametrize(
    ('max_laps', 'belt_mode', 'expected'),
    [
        ('100', 'stop_at_pick', 40),
        ('12', 'stop_at_pick', 12),
        ('30', 'continuous', 15),
        ('12', 'continuous', 1),
        ('0', 'continuous', 40),
    ],
)
def test_the_planner_takes_a_box_before_the_conveyor_rejects_it(max_laps, belt_mode, expected):
    found = launched_nodes({'max_laps': max_laps, 'belt_mode': belt_mode})
    assert found['planner']['max_passed_over'] == expected
