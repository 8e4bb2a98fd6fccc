"""``ros2 action list``."""

from __future__ import annotations

import argparse

from rclpy.action import get_action_names_and_types

from ros2cli_standin.graph import add_discovery_arguments, open_node, print_names


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of action names."""
    add_discovery_arguments(parser)
    parser.add_argument(
        '-t', '--show-types', action='store_true', help='Additionally show the action type'
    )
    parser.add_argument(
        '-c',
        '--count-actions',
        action='store_true',
        help='Only display the number of actions discovered',
    )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> None:
    with open_node(arguments) as node:
        print_names(get_action_names_and_types(node), arguments.show_types, arguments.count_actions)
