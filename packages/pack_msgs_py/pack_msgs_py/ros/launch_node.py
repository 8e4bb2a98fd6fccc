"""Launch files of single nodes (imports launch, which is there only where they are launched)."""

from __future__ import annotations

from typing import Any


def node_launch(package: str, executable: str) -> Any:  # noqa: ANN401 - launch has no types
    """A description that launches one node, with the arguments that every one of them takes."""
    from launch import LaunchDescription
    from launch.actions import DeclareLaunchArgument
    from launch.conditions import (
        LaunchConfigurationEquals,
        LaunchConfigurationNotEquals,
    )
    from launch.substitutions import LaunchConfiguration
    from launch_ros.actions import Node

    arguments = {
        'namespace': ('', 'of the node'),
        'params_file': ('', 'YAML file of parameters'),
        'use_sim_time': ('false', 'take the time from /clock'),
        'autostart': ('true', 'otherwise it waits, unconfigured, for its transitions'),
        'respawn': ('false', 'start the node again when it has ended'),
        'log_level': ('info', 'debug, info, warn, error or fatal'),
    }

    shared = {name: LaunchConfiguration(name) for name in ('use_sim_time', 'autostart')}

    def node(condition: Any, *more: Any) -> Any:  # noqa: ANN401 - launch has no types
        return Node(
            package=package,
            executable=executable,
            namespace=LaunchConfiguration('namespace'),
            output='screen',
            parameters=[*more, shared],
            arguments=['--ros-args', '--log-level', LaunchConfiguration('log_level')],
            respawn=LaunchConfiguration('respawn'),
            respawn_delay=1.0,
            condition=condition,
        )

    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=description)
                for name, (default, description) in arguments.items()
            ),
            node(LaunchConfigurationEquals('params_file', '')),
            node(
                LaunchConfigurationNotEquals('params_file', ''), LaunchConfiguration('params_file')
            ),
        ]
    )
