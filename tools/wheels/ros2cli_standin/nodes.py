"""``ros2 node list | info``."""

from __future__ import annotations

import argparse
import sys

import rclpy.action

from ros2cli_standin.graph import (
    add_discovery_arguments,
    full_node_names,
    open_node,
    without_hidden,
)


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of available nodes."""
    add_discovery_arguments(parser)
    parser.add_argument(
        '-a', '--all', action='store_true', help='Display all nodes even hidden ones'
    )
    parser.add_argument(
        '-c',
        '--count-nodes',
        action='store_true',
        help='Only display the number of nodes discovered',
    )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> None:
    with open_node(arguments) as node:
        names = sorted(full_node_names(node, arguments.all))
    if arguments.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            'WARNING: Be aware that there are nodes in the graph that share an exact name, '
            'which can have unintended side effects.',
            file=sys.stderr,
        )
    for name in names:
        print(name)


def add_info(parser: argparse.ArgumentParser) -> None:
    """Output information about a node."""
    add_discovery_arguments(parser)
    parser.add_argument('node_name', help='Node name to request information')
    parser.add_argument(
        '--include-hidden',
        action='store_true',
        help='Display hidden topics, services, and actions as well',
    )
    parser.set_defaults(run=_info)


def _info(arguments: argparse.Namespace) -> str | None:
    full_name = arguments.node_name
    hidden = arguments.include_hidden
    with open_node(arguments, lambda node: full_name in full_node_names(node, hidden)) as node:
        count = full_node_names(node, hidden).count(full_name)
        if not count:
            return f"Unable to find node '{full_name}'"
        if count > 1:
            print(
                f'There are {count} nodes in the graph with the exact name "{full_name}". '
                'You are seeing information about only one of them.',
                file=sys.stderr,
            )
        namespace, _, name = full_name.rpartition('/')
        of_node = (name, namespace or '/')
        print(full_name)
        for title, endpoints in (
            ('Subscribers', node.get_subscriber_names_and_types_by_node(*of_node)),
            ('Publishers', node.get_publisher_names_and_types_by_node(*of_node)),
            ('Service Servers', node.get_service_names_and_types_by_node(*of_node)),
            ('Service Clients', node.get_client_names_and_types_by_node(*of_node)),
            (
                'Action Servers',
                rclpy.action.get_action_server_names_and_types_by_node(node, *of_node),
            ),
            (
                'Action Clients',
                rclpy.action.get_action_client_names_and_types_by_node(node, *of_node),
            ),
        ):
            print(f'  {title}:')
            shown = without_hidden(endpoints, hidden)
            print('\n'.join(f'    {endpoint}: {", ".join(types)}' for endpoint, types in shown))
    return None
