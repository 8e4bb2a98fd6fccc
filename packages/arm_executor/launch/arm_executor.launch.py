"""Start the node alone: ``ros2 launch arm_executor arm_executor.launch.py respawn:=true``."""

from launch import LaunchDescription

from pack_msgs_py.ros.launch_node import node_launch


def generate_launch_description() -> LaunchDescription:
    """The arguments, and the node."""
    return node_launch('arm_executor', 'arm_executor')
