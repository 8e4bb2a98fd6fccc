"""Wrong options and files are one clear line and exit code 2, before anything starts."""

import math
from dataclasses import replace

import pytest

from arm_executor.parameters import ExecutorParameters, settings_from
from conveyor_sim.parameters import ConveyorParameters
from conveyor_sim.scanning.faults import FAULTS
from pack_cell.cli import main
from pack_cell.options.declaration import declared_options
from pack_cell.options.run_options import RunOptions, parse_run_options
from pack_cell.report.ended_run import execution_profile
from pack_cell.running.node_commands import node_parameters
from pack_cell.running.node_parameters import check_cell
from pack_msgs_py.orientation import UPRIGHT_OR_TIPPED
from pack_planner.parameters import PlannerParameters, settings

WRONG = [
    (['--bin', 'LDX'], 'unknown bin'),
    (['--bin', '0x10x10'], 'out of range'),
    (['--bin', '100x60x60:fence'], '100x60x60:box, 100x60x60:cage, 100x60x60:pallet'),
    (['--open-bins', '4'], '1, 2 or 3'),
    (['--look-ahead', '0'], '1 to 6'),
    (['--look-ahead', '7'], '1 to 6'),
    (['--deadline', '-1'], 'above 0'),
    (['--deadline', 'nan'], 'above 0'),
    (['--deadline', '0'], 'above 0'),
    (['--speed', 'inf'], '0 to 100'),
    (['--count', '-3'], '0 to 1000000'),
    (['--count', 'many'], 'whole number'),
    (['--algorithm', 'magic'], 'magic'),
    (['--profile', 'lab'], 'lab'),
    (['--seed', '1.5'], 'whole number'),
    (['--unknown'], 'unrecognized'),
    (['--scan-sigma', '51'], '0 to 50 mm'),
    (['--size-sigmas', 'nan'], '0 to 10'),
    (['--clearance', '-1'], '0 to 100 mm'),
    (['--resolution', '2.5'], 'whole number'),
    (['--resolution', '0'], '1 to 100 mm'),
    (['--planner', 'clearance_mm=1'], 'NAME=VALUE'),
    (['--destinations', '-1'], '0 to 1000'),
    (['--max-laps', '1.5'], 'whole number'),
    (['--belt-mode', 'flying'], 'flying'),
    (['--planner', 'cep'], 'NAME=VALUE'),
    (['--executor', 'speed=1'], 'NAME=VALUE'),
    (['--executor', 'joint_jerk=-2'], 'at least -1'),
    (['--executor', 'trajectory.stop_by=wait'], 'one of ramp, cancel'),
    (['--planner', 'algorithm=dbl'], 'NAME=VALUE'),
    (['--planner', 'cep=2'], 'of type bool'),
    (['--planner', 'closing=newest'], 'fullest'),
    (['--planner', 'weights=1,nan,3'], 'w2 is nan'),
]


def refusal(arguments, capsys):
    """The one line that `cell run` ends with, code 2."""
    with pytest.raises(SystemExit) as caught:
        main(['run', *arguments])
    assert caught.value.code == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    return error


@pytest.mark.parametrize(('arguments', 'text'), WRONG)
def test_a_wrong_option_is_one_line_with_the_value(arguments, text, capsys):
    assert text in refusal(arguments, capsys)


def test_every_default_is_a_value_of_its_option():
    for named in declared_options(RunOptions):
        declaration = named.declaration
        if declaration.default:
            assert named.read(declaration.default) == declaration.default_value(), named.flag
        if declaration.launch_default:
            named.read(declaration.launch_default)


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (['--faults', 'magic=0.1'], "unknown fault 'magic'"),
        (['--faults', 'all=1'], f'add up to {len(FAULTS)}'),
        (['--arrivals', 'never'], "arrivals is 'never'"),
        (['--jams', 'always'], "jams is 'always'"),
        (['--boxes', 'mpv:class=12'], 'class=12'),
        (['--boxes', 'br:x.txt'], 'which problem'),
    ],
)
def test_what_the_conveyor_cannot_do_is_one_line_that_names_the_option(arguments, text, capsys):
    error = refusal(arguments, capsys)
    assert text in error
    assert f'argument {arguments[0]}: ' in error


@pytest.mark.parametrize(
    ('arguments', 'sigma_mm', 'sigmas'),
    [
        ([], 2.0, 2.0),
        (['--profile', 'paper'], 0.0, 0.0),
        (['--scan-sigma', '4', '--size-sigmas', '0'], 4.0, 0.0),
        (['--profile', 'paper', '--scan-sigma', '1', '--size-sigmas', '3'], 1.0, 3.0),
    ],
)
def test_the_scanner_is_as_good_as_the_profile_says_unless_told_otherwise(
    arguments, sigma_mm, sigmas
):
    options = parse_run_options(arguments)
    assert (options.scan_sigma_mm, options.size_sigmas) == (sigma_mm, sigmas)


@pytest.mark.parametrize(
    ('arguments', 'clearance_mm', 'resolution_mm'),
    [
        ([], 2.0, 10),
        (['--profile', 'paper'], 0.0, 10),
        (['--profile', 'dense', '--clearance', '1.5', '--resolution', '1'], 1.5, 1),
        (['--clearance', '0'], 0.0, 10),
    ],
)
def test_planner_executor_and_report_keep_the_same_margins(
    arguments, clearance_mm, resolution_mm, tmp_path
):
    options = parse_run_options(arguments)
    nodes = node_parameters(tmp_path, options)
    planner = PlannerParameters(**nodes['planner'])
    executor = ExecutorParameters(**nodes['arm_executor'])
    rules = execution_profile(options)
    assert (rules.clearance_mm, rules.resolution_mm) == (clearance_mm, resolution_mm)
    unlimited = replace(rules, max_payload_kg=None)
    for theirs in (settings(planner).profile, settings_from(executor).profile):
        assert replace(theirs, max_payload_kg=None) == unlimited


@pytest.mark.parametrize(
    ('arguments', 'rule', 'tips'),
    [
        ([], UPRIGHT_OR_TIPPED, True),
        (['--profile', 'dense'], UPRIGHT_OR_TIPPED, True),
        (['--profile', 'paper'], 'upright', False),
        (['--robot', 'ur5e'], 'upright', False),
        (['--profile', 'dense', '--belt-mode', 'continuous'], 'upright', False),
        (['--profile', 'dense', '--grasp-faces', 'any'], 'upright_or_front_up', False),
        (['--profile', 'paper', '--grasp-faces', 'tray'], UPRIGHT_OR_TIPPED, True),
    ],
)
def test_planner_executor_and_conveyor_mean_the_same_faces(arguments, rule, tips, tmp_path):
    options = parse_run_options(['--tilt-time', '2.5', *arguments])
    nodes = node_parameters(tmp_path, options)
    assert settings(PlannerParameters(**nodes['planner'])).profile.orientations == rule
    executor = settings_from(ExecutorParameters(**nodes['arm_executor']))
    assert (executor.profile.orientations, executor.tilt_time_s) == (rule, 2.5)
    conveyor = ConveyorParameters(**nodes['conveyor'])
    assert (conveyor.tilt_tray, conveyor.tilt_time) == (tips, 2.5)
    assert execution_profile(options).orientations == rule


@pytest.mark.parametrize(
    ('arguments', 'why'),
    [
        (['--belt-mode', 'continuous'], 'stop_at_pick'),
        (['--robot', 'ur5e', '--bin', 'SYN'], 'conveyor.tallest_box of 450 mm'),
    ],
)
def test_a_tray_where_none_can_stand_is_refused(arguments, why):
    options = parse_run_options(['--grasp-faces', 'tray', '--arm', 'timed', *arguments])
    with pytest.raises(ValueError, match=why):
        check_cell(options)


def test_a_missing_box_file_is_one_line(tmp_path, capsys):
    error = refusal(['--boxes', str(tmp_path / 'none.csv')], capsys)
    assert 'none.csv' in error


def test_a_box_file_without_sizes_is_one_line(tmp_path, capsys):
    path = tmp_path / 'boxes.csv'
    path.write_text('id,colour\n1,red\n')
    error = refusal(['--boxes', str(path)], capsys)
    assert 'no column length, width, height; found id, colour' in error


def test_help_names_every_option(capsys):
    with pytest.raises(SystemExit) as caught:
        main(['run', '--help'])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    for option in ('--boxes', '--count', '--bin', '--open-bins', '--look-ahead', '--algorithm'):
        assert option in text
    for option in ('--profile', '--deadline', '--speed', '--seed', '--out', '--respawn'):
        assert option in text


def test_defaults_are_the_demo_settings():
    options = parse_run_options([])
    assert options.bin_spec.name == 'LDC'
    assert (options.look_ahead, options.open_bins, options.profile) == (5, 2, 'cell')
    assert math.isclose(options.deadline_s, 5.5)


@pytest.mark.parametrize(
    ('arguments', 'payload'),
    [([], 22.0), (['--robot', 'ur10e'], 9.5), (['--robot', 'ur10e', '--arm', 'timed'], 9.5)],
)
def test_the_planner_knows_what_the_robot_lifts(arguments, payload, tmp_path):
    options = parse_run_options(arguments)
    parameters = node_parameters(tmp_path, options)
    assert parameters['planner']['max_payload_kg'] == payload
    assert parameters['arm_executor']['robot'] == options.robot


def test_parameters_of_the_planner_reach_its_node(tmp_path):
    given = ['cep=true', 'max_passed_over=7', 'large_until=0.25', 'weights=1,1,50 RC:2,1,50']
    arguments = [word for text in given for word in ('--planner', text)]
    parameters = node_parameters(tmp_path, parse_run_options(arguments))['planner']
    assert (parameters['cep'], parameters['max_passed_over']) == (True, 7)
    assert (parameters['large_until'], parameters['weights']) == (0.25, '1,1,50 RC:2,1,50')


def test_parameters_of_the_executor_and_its_arm_reach_its_node(tmp_path):
    given = ['joint_jerk=300', 'trajectory.vacuum_output=2', 'trajectory.joint_prefix=left_']
    arguments = [word for text in given for word in ('--executor', text)]
    parameters = node_parameters(tmp_path, parse_run_options(arguments))['arm_executor']
    assert parameters['joint_jerk'] == 300.0
    assert parameters['trajectory.vacuum_output'] == 2
    assert parameters['trajectory.joint_prefix'] == 'left_'


def test_an_arm_that_moves_a_robot_is_not_run_as_fast_as_possible():
    with pytest.raises(ValueError, match='give --speed 1'):
        check_cell(parse_run_options(['--arm', 'trajectory']))


@pytest.mark.parametrize(
    ('arguments', 'budget_s'),
    [
        ([], 0.55),
        (['--speed', '1'], 3.55),
        (['--speed', '0.1'], 5.0),
        (['--speed', '0.1', '--deadline', '60'], 5.0),
        (['--planner', 'budget_s=2.5'], 2.5),
    ],
)
def test_a_decision_gets_the_time_that_motions_and_the_deadline_leave(
    tmp_path, arguments, budget_s
):
    options = parse_run_options(arguments)
    assert node_parameters(tmp_path, options)['planner']['budget_s'] == pytest.approx(budget_s)


def test_the_demo_takes_speed_and_folder_and_names_a_wrong_one(capsys):
    with pytest.raises(SystemExit) as caught:
        main(['demo', '--speed', 'fast'])
    assert caught.value.code == 2
    assert capsys.readouterr().err.startswith("cell demo: argument --speed: 'fast' is not a number")
    with pytest.raises(SystemExit):
        main(['demo', '--bin', 'EQ'])
    assert 'unrecognized arguments: --bin' in capsys.readouterr().err
