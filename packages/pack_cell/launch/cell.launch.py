"""Start the whole cell: ``ros2 launch pack_cell cell.launch.py bin_type:=EQ speed:=0.0``."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from pack_cell.launching import ARGUMENTS, launched_nodes
from pack_cell.running.node_commands import NODES


def nodes(context: LaunchContext) -> list[Node]:
    """The three nodes, with the parameters that the arguments mean."""

    def given(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    found = launched_nodes({name: given(name) for name in ARGUMENTS}, given('state_dir'))
    return [
        Node(
            package=package,
            executable=executable,
            namespace=given('namespace'),
            output='screen',
            parameters=[found[name]],
        )
        for name, (package, executable) in NODES.items()
    ]


def generate_launch_description() -> LaunchDescription:
    """The arguments, and the nodes."""
    arguments = [
        DeclareLaunchArgument('namespace', default_value='', description='of every node'),
        DeclareLaunchArgument(
            'state_dir',
            default_value='',
            description='folder of the journals; empty: state is lost with the node',
        ),
        *(
            DeclareLaunchArgument(name, default_value=default, description=text)
            for name, (_, default, text) in ARGUMENTS.items()
        ),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
