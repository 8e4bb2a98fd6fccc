"""Start the node alone: ``ros2 launch conveyor_sim conveyor.launch.py params_file:=mine.yaml``."""

from launch import LaunchDescription

from pack_msgs_py.ros.launch_node import node_launch


def generate_launch_description() -> LaunchDescription:
    """The arguments, and the node."""
    return node_launch('conveyor_sim', 'conveyor')
