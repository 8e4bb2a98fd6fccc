"""The launch file takes what `cell run` takes."""

from __future__ import annotations

import re
import runpy
import sys
import types
from pathlib import Path

import pytest

from pack_cell.launching import FORMER_NAMES, check_names, launch_arguments, launched_nodes
from pack_cell.options.declaration import add_options, declared_options
from pack_cell.options.parsers import OneLineParser
from pack_cell.options.run_options import RunOptions

#: Options of `cell run` that are about the run as a whole, not about its nodes.
OF_THE_RUN = {
    *('--help', '--record', '--respawn', '--resume', '--stall-timeout', '--out', '--quiet'),
    '--planner',
    '--executor',
}
OF_THE_RUN |= {'--view', '--view-port'}


def test_every_option_of_a_node_is_an_argument_of_the_same_name():
    parser = OneLineParser(prog='cell run')
    add_options(parser, RunOptions)
    options = {name for action in parser._actions for name in action.option_strings if name[2:]}
    arguments = {f'--{argument.name.replace("_", "-")}' for argument in launch_arguments()}
    assert options - OF_THE_RUN - {'-h'} == arguments


def test_defaults_are_those_of_the_run_in_real_time():
    arguments = {argument.name: argument for argument in launch_arguments()}
    for named in declared_options(RunOptions):
        if named.declaration.launched and named.key not in ('speed', 'acknowledge'):
            assert arguments[named.argument].default == named.declaration.default
    defaults = {name: argument.default for name, argument in arguments.items()}
    nodes = launched_nodes(defaults, state_dir='/somewhere')
    assert set(nodes) == {'conveyor', 'planner', 'arm_executor'}
    assert nodes['conveyor']['size_sigma'] == 2.0 and nodes['planner']['size_sigmas'] == 2.0
    assert nodes['conveyor']['speed'] == nodes['arm_executor']['speed'] == 1.0
    assert nodes['planner']['max_payload_kg'] > 0
    assert nodes['conveyor']['state_dir'] == nodes['arm_executor']['state_dir'] == '/somewhere'


def test_arguments_become_parameters_of_the_nodes_that_they_are_about():
    nodes = launched_nodes(
        {
            'belt_mode': 'continuous', 'arrivals': 'poisson:900', 'jams': 'random:600,20',
            'faults': 'all=0.01', 'scan_sigma': '3', 'size_sigmas': '1', 'max_laps': '7',
            'clearance': '1', 'resolution': '5',
            'destinations': '2', 'arm': 'timed',
        }
    )  # fmt: skip
    conveyor = nodes['conveyor']
    assert (conveyor['belt_mode'], conveyor['arrivals'], conveyor['jams']) == (
        'continuous', 'poisson:900', 'random:600,20',
    )  # fmt: skip
    assert (conveyor['faults'], conveyor['size_sigma'], conveyor['max_laps']) == (
        'all=0.01',
        3.0,
        7,
    )
    for node in ('planner', 'arm_executor'):
        names = ('size_sigmas', 'clearance_mm', 'resolution_mm')
        assert [nodes[node][name] for name in names] == [1.0, 1.0, 5]
    assert (conveyor['destinations'], nodes['arm_executor']['destinations']) == (2, 'D1,D2')


@pytest.mark.parametrize(
    ('wrong', 'text'),
    [
        ({'speed': 'fast'}, "argument speed: 'fast' is not a number"),
        ({'arm': 'robot'}, "argument arm: unknown arm 'robot'"),
        ({'max_laps': '-1'}, 'argument max_laps: -1 is out of range'),
        ({'jams': 'sometimes'}, 'argument jams: '),
        ({'boxes': '/none.csv'}, 'argument boxes: box file /none.csv cannot be read'),
        ({'colour': 'red'}, 'unknown argument colour'),
    ],
)
def test_a_wrong_argument_ends_the_launch_with_its_name(wrong, text):
    with pytest.raises(ValueError, match=re.escape(f'cell.launch.py: {text}')):
        launched_nodes(wrong)


@pytest.mark.parametrize('name', FORMER_NAMES)
def test_an_argument_under_its_former_name_is_not_passed_over(name):
    with pytest.raises(ValueError, match=f'{name}: it is called {FORMER_NAMES[name]} now'):
        launched_nodes({name: 'EQ'})


def test_a_cell_that_cannot_be_run_is_refused():
    with pytest.raises(ValueError, match='jams'):
        launched_nodes({'jams': 'sometimes'})
    with pytest.raises(ValueError, match='ur5e'):
        launched_nodes({'robot': 'ur5e', 'bin': 'PAL'})


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
    nodes = launched_nodes({'max_laps': max_laps, 'belt_mode': belt_mode})
    assert nodes['planner']['max_passed_over'] == expected


class Recorded:
    """Stands for whatever class of launch: remembers what it was made with."""

    def __init__(self, *positional, **named):
        self.positional, self.named = positional, named


class LaunchConfiguration(Recorded):
    def perform(self, context):
        return context.launch_configurations[self.positional[0]]


@pytest.fixture
def launch_file(monkeypatch):
    """The launch file, where launch itself is not installed."""
    names = {
        'launch': ('LaunchContext', 'LaunchDescription'),
        'launch.actions': ('DeclareLaunchArgument', 'OpaqueFunction', 'Shutdown'),
        'launch.substitutions': (),
        'launch_ros': (),
        'launch_ros.actions': ('Node',),
    }
    for module, classes in names.items():
        made = types.ModuleType(module)
        for name in classes:
            setattr(made, name, type(name, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, module, made)
    sys.modules['launch.substitutions'].LaunchConfiguration = LaunchConfiguration
    path = Path(__file__).resolve().parents[1] / 'launch' / 'cell.launch.py'
    return runpy.run_path(str(path))


def launched(launch_file, **given):
    """The nodes that the launch file makes of what is given on the command line."""
    *arguments, function = launch_file['generate_launch_description']().positional[0]
    texts = {
        argument.positional[0]: argument.named['default_value'] for argument in arguments
    } | given
    context = types.SimpleNamespace(launch_configurations=texts)
    return {node.named['executable']: node.named for node in function.named['function'](context)}


def test_without_a_recording_and_a_folder_nobody_records(launch_file):
    assert 'topic_recorder' not in launched(launch_file)
    given, *_ = launched(launch_file, record='cell.mcap')['topic_recorder']['parameters']
    assert given == {'file': 'cell.mcap', 'state_dir': ''}


def test_the_launch_file_starts_the_nodes_with_their_parameters(launch_file):
    nodes = launched(launch_file, bin='EQ', namespace='north', state_dir='/somewhere')
    assert set(nodes) == {
        'cell_monitor', 'conveyor', 'planner', 'arm_executor', 'topic_recorder', 'end_of_stream'
    }  # fmt: skip
    assert {node['namespace'] for node in nodes.values()} == {'north'}
    parameters, *_ = nodes['arm_executor']['parameters']
    assert (parameters['bin_type'], parameters['state_dir']) == ('EQ', '/somewhere')


def test_the_launch_file_refuses_a_former_name(launch_file):
    with pytest.raises(ValueError, match='bin_type: it is called bin now'):
        launched(launch_file, bin_type='EQ')


def test_the_launch_file_shows_the_page_when_it_is_asked_to(launch_file):
    nodes = launched(launch_file, view='true', view_port='8090', namespace='north')
    assert nodes['viewer']['parameters'][0] == {'port': 8090}
    assert nodes['viewer']['namespace'] == 'north'
    with pytest.raises(ValueError, match="view: 'perhaps' is neither true nor false"):
        launched(launch_file, view='perhaps')


def test_rviz_is_opened_on_the_topics_of_the_namespace(launch_file, monkeypatch):
    monkeypatch.setattr('shutil.which', lambda name: f'/usr/bin/{name}')
    rviz = launched(launch_file, rviz='true', namespace='north')['rviz2']
    assert Path(rviz['arguments'][1]).is_file()
    assert ('/robot_description', '/north/robot_description') in rviz['remappings']
    assert launched(launch_file, rviz='true')['rviz2']['remappings'] == []


def test_without_rviz_the_launch_says_what_to_install(launch_file, monkeypatch):
    monkeypatch.setattr('shutil.which', lambda name: None)
    with pytest.raises(ValueError, match='ros-jazzy-rviz2'):
        launched(launch_file, rviz='true')


def test_one_launch_takes_the_habits_of_ros(launch_file):
    nodes = launched(
        launch_file, use_sim_time='true', log_level='debug', params_file='mine.yaml',
        frame_prefix='north/', exit_at_end='false',
    )  # fmt: skip
    assert 'end_of_stream' not in nodes
    for name in ('conveyor', 'planner', 'arm_executor'):
        own, common, file = nodes[name]['parameters']
        assert common == {'use_sim_time': True} and file == 'mine.yaml', 'what is last wins'
        assert nodes[name]['arguments'] == ['--ros-args', '--log-level', 'debug']
        assert own.get('frame_prefix') == (None if name == 'conveyor' else 'north/')


def test_a_node_that_ends_ends_the_launch_or_is_started_again(launch_file):
    ending, again = launched(launch_file), launched(launch_file, respawn='true', record='a.mcap')
    for name in ('conveyor', 'planner', 'arm_executor'):
        [shutdown] = ending[name]['on_exit']
        assert shutdown.named['reason'] == f'{name} has ended' and not ending[name]['respawn']
        assert again[name]['on_exit'] is None and again[name]['respawn']
    assert again['topic_recorder']['on_exit'] is None, 'it only listens'
    assert again['end_of_stream']['on_exit'], 'the stream ends all the same'


def test_an_argument_that_nobody_declared_is_refused_with_what_was_meant():
    command = ['ros2', 'launch', 'pack_cell', 'cell.launch.py', 'bin:=EQ', 'log_level:=warn']
    check_names(command)
    with pytest.raises(ValueError, match=r'unknown argument bins: did you mean bin'):
        check_names([*command, 'bins:=EQ'])
    check_names(['ros2', 'launch', 'mine', 'plant.launch.py', 'line:=7'])


@pytest.mark.parametrize('package', ['conveyor_sim', 'pack_planner', 'arm_executor'])
def test_every_node_has_a_launch_file_of_its_own_that_is_installed(package):
    folder = Path(__file__).resolve().parents[2] / package
    [path] = (folder / 'launch').glob('*.launch.py')
    assert f"node_launch('{package}', '{path.name.split('.')[0]}')" in path.read_text()
    assert "'/launch', glob('launch/*.launch.py')" in (folder / 'setup.py').read_text()
    assert '<exec_depend>launch_ros</exec_depend>' in (folder / 'package.xml').read_text()
