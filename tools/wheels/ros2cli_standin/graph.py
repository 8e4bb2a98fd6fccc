"""A short-lived node that looks at the ROS graph."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

#: ros2cli asks a daemon that knows the graph already. Without one, discovery takes this long.
DISCOVERY = 1.0
#: What is asked for by name is waited for a little longer than Fast DDS repeats an announcement.
PATIENCE = 3.2


def add_discovery_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that every verb has that looks at the graph."""
    parser.add_argument(
        '--spin-time',
        type=float,
        default=DISCOVERY,
        help='Spin time in seconds to wait for discovery',
    )
    parser.add_argument(
        '-s', '--use-sim-time', action='store_true', help='Enable ROS simulation time'
    )
    parser.add_argument(
        '--no-daemon', action='store_true', help='Accepted as by ros2cli; there is no daemon here'
    )


@contextmanager
def open_node(
    arguments: argparse.Namespace, until: Callable[[Node], bool] | None = None
) -> Iterator[Node]:
    """Give a hidden node after discovery: the whole spin time, or as soon as ``until`` holds.

    Endpoints are found one after another, so a little time is added once ``until`` holds.
    """
    rclpy.init(args=[])
    node = rclpy.create_node(
        f'_ros2cli_{os.getpid()}',
        start_parameter_services=False,
        parameter_overrides=[Parameter('use_sim_time', value=arguments.use_sim_time)],
    )
    longest = arguments.spin_time if until is None else max(arguments.spin_time, PATIENCE)
    end = time.monotonic() + longest
    try:
        while (left := end - time.monotonic()) > 0:
            rclpy.spin_once(node, timeout_sec=min(left, 0.05))
            if until is not None and until(node):
                end, until = min(end, time.monotonic() + 0.2), None
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def without_hidden(
    names_and_types: Iterable[tuple[str, list[str]]], include_hidden: bool
) -> list[tuple[str, list[str]]]:
    """Leave out names that have a part starting with an underscore, unless they are wanted."""
    return [
        (name, types)
        for name, types in names_and_types
        if include_hidden or not any(part.startswith('_') for part in name.split('/'))
    ]


def full_node_names(node: Node, include_hidden: bool = False) -> list[str]:
    """Names of all nodes, with their namespaces."""
    return [
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in node.get_node_names_and_namespaces()
        if include_hidden or (name and not name.startswith('_'))
    ]


def absolute(name: str) -> str:
    """The name with a leading slash."""
    return name if name.startswith('/') else f'/{name}'


def print_names(
    names_and_types: list[tuple[str, list[str]]], show_types: bool, count_only: bool
) -> None:
    """Print one name per line, with its types in brackets if wanted, or only how many."""
    if count_only:
        print(len(names_and_types))
        return
    for name, types in names_and_types:
        print(f'{name} [{", ".join(types)}]' if show_types else name)
