"""Start the whole cell: ``ros2 launch pack_cell cell.launch.py bin:=EQ speed:=0.0``."""

import shutil
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from pack_cell.launching import FORMER_NAMES, is_on, launch_arguments, launched_nodes
from pack_cell.running.node_commands import NODES

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

    texts = {argument.name: given(argument.name) for argument in launch_arguments()}
    # Launch itself passes over arguments that nobody declared.
    texts |= {name: given(name) for name in FORMER_NAMES if name in context.launch_configurations}
    parameters = launched_nodes(texts, given('state_dir'))
    started = [
        (package, executable, parameters[name]) for name, (package, executable) in NODES.items()
    ]
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
            parameters=[values],
        )
        for package, executable, values in started
    ]
    if is_on('rviz', given('rviz')):
        made.append(_rviz(given('namespace')))
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


def generate_launch_description() -> LaunchDescription:
    """The arguments, and the nodes."""
    arguments = [
        DeclareLaunchArgument('namespace', default_value='', description='of every node'),
        DeclareLaunchArgument(
            'state_dir',
            default_value='',
            description='folder of the journals; empty: state is lost with the node',
        ),
        DeclareLaunchArgument(
            'record', default_value='', description='MCAP file for every topic; empty: none'
        ),
        DeclareLaunchArgument(
            'view', default_value='false', description='show the cell on a page in the browser'
        ),
        DeclareLaunchArgument('rviz', default_value='false', description='open RViz on the cell'),
        DeclareLaunchArgument('view_port', default_value='8080', description='port of that page'),
        *(
            DeclareLaunchArgument(
                argument.name, default_value=argument.default, description=argument.description
            )
            for argument in launch_arguments()
        ),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
