"""Start the whole cell: ``ros2 launch pack_cell cell.launch.py bin_type:=EQ speed:=0.0``."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from arm_executor.layout import lifting_limit
from arm_executor.layout_file import find_layout

ARGUMENTS = {
    'namespace': ('', 'namespace of every node'),
    'boxes_file': ('', 'CSV or BED-BPP JSON; empty: the built-in cartons'),
    'count': ('0', 'number of boxes; 0: the whole stream'),
    'seed': ('0', 'seed of the shuffle; 0: as listed'),
    'bin_type': ('LDC', 'LDC, RC, PAL, EQ, SYN or LxBxH in centimetres'),
    'open_bins': ('2', 'bins open at a time, 1 to 3'),
    'look_ahead': ('5', 'boxes the planner may choose from, 1 to 6'),
    'algorithm': ('mpack_lite', 'packing algorithm'),
    'profile': ('cell', 'packing rules: paper or cell'),
    'deadline_s': ('5.5', 'seconds a box may take'),
    'speed': ('1.0', 'robot time against wall time; 0: as fast as possible'),
    'arm': ('physics', 'physics or timed'),
    'robot': ('', 'ur5e, ur10e, ur16e, ur20 or ur30; empty: that of the layout'),
    'layout': ('', 'YAML file of the layout; empty: the default'),
    'state_dir': ('', 'folder of the journals; empty: state is lost with the node'),
}


def typed(name: str, kind: type) -> ParameterValue:
    """A launch argument as a parameter of ``kind``."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def planner(context: LaunchContext) -> list[Node]:
    """The planner, with what the robot of the layout lifts."""
    arm, robot, layout = (
        LaunchConfiguration(name).perform(context) for name in ('arm', 'robot', 'layout')
    )
    payload = lifting_limit(find_layout(layout, robot)) if arm == 'physics' else 0.0
    node = Node(
        package='pack_planner',
        executable='planner',
        namespace=LaunchConfiguration('namespace'),
        output='screen',
        parameters=[
            {
                'algorithm': typed('algorithm', str),
                'profile': typed('profile', str),
                'orientations': 'upright',
                'look_ahead': typed('look_ahead', int),
                'deadline_s': typed('deadline_s', float),
                'max_payload_kg': payload,
            }
        ],
    )
    return [node]


def generate_launch_description() -> LaunchDescription:
    """The three nodes and their arguments."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    namespace = LaunchConfiguration('namespace')
    conveyor = Node(
        package='conveyor_sim',
        executable='conveyor',
        namespace=namespace,
        output='screen',
        parameters=[
            {
                'boxes_file': typed('boxes_file', str),
                'count': typed('count', int),
                'seed': typed('seed', int),
                'look_ahead': typed('look_ahead', int),
                'speed': typed('speed', float),
                'state_dir': typed('state_dir', str),
            }
        ],
    )
    arm = Node(
        package='arm_executor',
        executable='arm_executor',
        namespace=namespace,
        output='screen',
        parameters=[
            {
                'arm': typed('arm', str),
                'robot': typed('robot', str),
                'layout': typed('layout', str),
                'bin_type': typed('bin_type', str),
                'open_bins': typed('open_bins', int),
                'profile': typed('profile', str),
                'orientations': 'upright',
                'speed': typed('speed', float),
                'state_dir': typed('state_dir', str),
            }
        ],
    )
    return LaunchDescription([*arguments, conveyor, OpaqueFunction(function=planner), arm])
