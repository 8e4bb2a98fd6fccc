"""Start the whole cell: ``ros2 launch pack_cell cell.launch.py bin:=EQ speed:=0.0``."""

import shutil
import sys
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from pack_cell.launching import (
    FORMER_NAMES,
    OWN_ARGUMENTS,
    check_names,
    is_on,
    launch_arguments,
    launched_nodes,
)
from pack_cell.ros.executables import NODES

#: What RViz shows, and what it listens to beside the transforms.
RVIZ_CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'cell.rviz'
RVIZ_TOPICS = ('/robot_description', '/arm_executor/markers')
NO_RVIZ = (
    'cell.launch.py: rviz:=true, but there is no rviz2 on the path: install it '
    '(apt-get install ros-jazzy-rviz2), or take view:=true, which needs a browser alone'
)


def nodes(context: LaunchContext) -> list[Node]:
    """The three nodes with the parameters that the arguments mean, who records and who shows."""

    def given(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    # Launch itself passes over arguments that nobody declared.
    check_names(sys.argv)
    texts = {argument.name: given(argument.name) for argument in launch_arguments()}
    texts |= {name: given(name) for name in FORMER_NAMES if name in context.launch_configurations}
    parameters = launched_nodes(texts, given('state_dir'))
    respawn = is_on('respawn', given('respawn'))
    common = {'use_sim_time': is_on('use_sim_time', given('use_sim_time'))}
    for name in ('planner', 'arm_executor'):
        parameters[name]['frame_prefix'] = given('frame_prefix')
    parameters['arm_executor']['publish_clock'] = is_on('publish_clock', given('publish_clock'))
    for name in NODES:
        parameters[name]['autostart'] = is_on('autostart', given('autostart'))
    own = [given('params_file')] if given('params_file') else []
    started = [
        (package, executable, parameters[name]) for name, (package, executable) in NODES.items()
    ]
    started.append(('pack_cell', 'cell_monitor', {}))
    recorder = {'file': given('record'), 'state_dir': given('state_dir')}
    if any(recorder.values()):
        started.insert(0, ('pack_cell', 'topic_recorder', recorder))
    if is_on('view', given('view')):
        started.append(('pack_cell', 'viewer', {'port': int(given('view_port'))}))
    made = [
        Node(
            package=package,
            executable=executable,
            namespace=given('namespace'),
            output='screen',
            parameters=[values, common, *own],
            arguments=['--ros-args', '--log-level', given('log_level')],
            # Belt, planner and arm find their state again; without one of them nothing goes on.
            respawn=respawn,
            respawn_delay=1.0,
            on_exit=None if respawn or package == 'pack_cell' else _shutdown(executable),
        )
        for package, executable, values in started
    ]
    if is_on('rviz', given('rviz')):
        made.append(_rviz(given('namespace')))
    if is_on('exit_at_end', given('exit_at_end')):
        made.append(
            Node(
                package='pack_cell',
                executable='end_of_stream',
                namespace=given('namespace'),
                output='screen',
                on_exit=_shutdown('end_of_stream'),
            )
        )
    return made


def _rviz(namespace: str) -> Node:
    """RViz on a cell in ``namespace``; ValueError where it is not installed."""
    if not shutil.which('rviz2'):
        raise ValueError(NO_RVIZ)
    within = f'/{namespace.strip("/")}' if namespace.strip('/') else ''
    return Node(
        package='rviz2',
        executable='rviz2',
        arguments=['-d', str(RVIZ_CONFIG)],
        remappings=[(topic, within + topic) for topic in RVIZ_TOPICS if within],
    )


def _shutdown(executable: str) -> list[Shutdown]:
    return [Shutdown(reason=f'{executable} has ended')]


def generate_launch_description() -> LaunchDescription:
    """The arguments, and the nodes."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in OWN_ARGUMENTS.items()
    ]
    arguments += [
        DeclareLaunchArgument(
            argument.name, default_value=argument.default, description=argument.description
        )
        for argument in launch_arguments()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
