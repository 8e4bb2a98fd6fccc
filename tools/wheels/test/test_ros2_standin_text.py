"""The stand-in `ros2` writes messages, interfaces and rates as ros2cli does."""

import argparse
import subprocess
from pathlib import Path

import pytest
from geometry_msgs.msg import PointStamped
from rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from sensor_msgs.msg import JointState

from ros2cli_standin.cli import build_parser, main
from ros2cli_standin.hz import Rate
from ros2cli_standin.interfaces import load_interface
from ros2cli_standin.message_text import Style, set_fields, to_csv, to_yaml

POINT_YAML = """\
header:
  stamp:
    sec: 1
    nanosec: 2
  frame_id: 'bin: 1'
point:
  x: 0.5
  y: 0.0
  z: 0.0
"""


@pytest.fixture
def point() -> PointStamped:
    message = PointStamped()
    message.header.stamp.sec = 1
    message.header.stamp.nanosec = 2
    message.header.frame_id = 'bin: 1'
    message.point.x = 0.5
    return message


def test_yaml_keeps_the_order_of_the_fields(point: PointStamped) -> None:
    assert to_yaml(point, Style()) == POINT_YAML


def test_csv_is_flat(point: PointStamped) -> None:
    assert to_csv(point, Style()) == '1,2,bin: 1,0.5,0.0,0.0'


def test_long_values_end_in_dots() -> None:
    message = JointState(name=['shoulder', 'elbow', 'wrist'], position=[1.0, 2.0, 3.0])
    text = to_yaml(message, Style(truncate=2))
    assert "name:\n- sh...\n- el...\n- '...'\n" in text
    assert "position:\n- 1.0\n- 2.0\n- '...'\n" in text


def test_arrays_and_strings_can_be_left_out() -> None:
    message = JointState(name=['a'], position=[1.0, 2.0])
    message.header.frame_id = 'base'
    text = to_yaml(message, Style(no_arr=True, no_str=True))
    assert "name: '<sequence type: string, length: 1>'" in text
    assert "position: '<sequence type: double, length: 2>'" in text
    assert "frame_id: '<string length: <4>>'" in text


def test_yaml_values_fill_nested_messages_and_lists() -> None:
    message = ParameterDescriptor()
    set_fields(message, {'name': 'rate', 'floating_point_range': [{'from_value': 1, 'step': 0.5}]})
    assert message.name == 'rate'
    assert message.floating_point_range[0].from_value == 1.0
    assert message.floating_point_range[0].step == 0.5


def test_yaml_values_fill_number_arrays() -> None:
    message = ParameterValue()
    set_fields(message, {'integer_array_value': [1, 2], 'bool_value': True})
    assert list(message.integer_array_value) == [1, 2]
    assert message.bool_value is True


def test_an_unknown_field_is_named() -> None:
    with pytest.raises(AttributeError, match='weight'):
        set_fields(PointStamped(), {'weight': 1})


def test_a_scalar_for_a_message_is_refused() -> None:
    with pytest.raises(TypeError, match='expected to be a dictionary'):
        set_fields(PointStamped(), {'point': 3})


@pytest.mark.parametrize('name', ['geometry_msgs/msg/PointStamped', 'geometry_msgs/PointStamped'])
def test_interfaces_are_found_by_name(name: str) -> None:
    assert load_interface(name) is PointStamped


@pytest.mark.parametrize('name', ['PointStamped', 'a/b/c/d', 'geometry_msgs//PointStamped'])
def test_a_malformed_interface_name_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match='not of the form'):
        load_interface(name)


def test_show_expands_nested_types_without_their_comments(capsys: pytest.CaptureFixture) -> None:
    assert main(['interface', 'show', 'geometry_msgs/msg/PointStamped']) is None
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith('# This represents a Point')
    header = lines.index('std_msgs/Header header')
    assert lines[header + 1 : header + 5] == [
        '\tbuiltin_interfaces/Time stamp',
        '\t\tint32 sec',
        '\t\tuint32 nanosec',
        '\tstring frame_id',
    ]


def test_show_leaves_out_comments_as_ros2cli_does(capsys: pytest.CaptureFixture) -> None:
    main(['interface', 'show', 'std_srvs/srv/SetBool', '--no-comments'])
    assert capsys.readouterr().out == 'bool data #\n---\nbool success   #\nstring message #\n'


def test_show_names_what_is_unknown() -> None:
    assert main(['interface', 'show', 'nowhere/msg/X']) == "Unknown package 'nowhere'"
    missing = main(['interface', 'show', 'std_msgs/msg/Nothing'])
    assert missing == "Could not find the interface 'std_msgs/msg/Nothing'"


def test_interface_list_has_each_kind(capsys: pytest.CaptureFixture) -> None:
    main(['interface', 'list', '-s'])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == 'Services:'
    assert '    std_srvs/srv/SetBool' in lines
    assert 'Messages:' not in lines


def test_rate_is_reported_once_a_second() -> None:
    rate = Rate(window=100)
    reports = []
    for tick in range(31):
        rate.tick(tick * 100_000_000)
        reports.append(rate.report())
    printed = [report for report in reports if report]
    assert len(printed) == 2
    assert printed[0] == (
        'average rate: 10.000\n\tmin: 0.100s max: 0.100s std dev: 0.00000s window: 11'
    )


def test_rate_starts_anew_when_time_goes_back() -> None:
    rate = Rate(window=100)
    for now in (5_000_000_000, 6_000_000_000, 1_000_000_000):
        rate.tick(now)
    assert rate.report() is None


def test_run_names_a_missing_package_and_executable() -> None:
    assert main(['run', 'nowhere', 'x']) == "Package 'nowhere' not found"
    assert main(['run', 'pack_cell', 'nothing']) == 'No executable found'


def test_what_only_a_real_ros_has_says_what_to_do_instead(capsys: pytest.CaptureFixture) -> None:
    assert main(['launch', 'pack_cell', 'cell.launch.py']) == 2
    assert './cell run' in capsys.readouterr().err


def test_an_unknown_command_ends_with_2() -> None:
    with pytest.raises(SystemExit) as ending:
        main(['fly'])
    assert ending.value.code == 2


def test_every_verb_has_help() -> None:
    def subparsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                return action.choices
        return {}

    for command, parser in subparsers(build_parser()).items():
        for name, verb in (subparsers(parser) or {'': parser}).items():
            assert verb.description, f'ros2 {command} {name} has no description'


def test_an_error_goes_to_stderr_with_code_1() -> None:
    command = [Path(__file__).parents[2] / 'standin' / 'ros2', 'run', 'nowhere', 'x']
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (ended.returncode, ended.stdout) == (1, '')
    assert ended.stderr == "Package 'nowhere' not found\n"
