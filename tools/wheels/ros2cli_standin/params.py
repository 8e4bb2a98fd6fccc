"""``ros2 param list | get | set``."""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType
from rclpy.node import Node
from rclpy.parameter import get_parameter_value
from rclpy.parameter_client import AsyncParameterClient

from ros2cli_standin.graph import (
    absolute,
    add_discovery_arguments,
    full_node_names,
    open_node,
)

#: Parameter type: its name in lists, what `get` says before the value, and the field that holds it.
_KINDS = {
    ParameterType.PARAMETER_BOOL: ('boolean', 'Boolean value is:', 'bool_value'),
    ParameterType.PARAMETER_INTEGER: ('integer', 'Integer value is:', 'integer_value'),
    ParameterType.PARAMETER_DOUBLE: ('double', 'Double value is:', 'double_value'),
    ParameterType.PARAMETER_STRING: ('string', 'String value is:', 'string_value'),
    ParameterType.PARAMETER_BYTE_ARRAY: ('byte array', 'Byte values are:', 'byte_array_value'),
    ParameterType.PARAMETER_BOOL_ARRAY: (
        'boolean array', 'Boolean values are:', 'bool_array_value',
    ),
    ParameterType.PARAMETER_INTEGER_ARRAY: (
        'integer array', 'Integer values are:', 'integer_array_value',
    ),
    ParameterType.PARAMETER_DOUBLE_ARRAY: (
        'double array', 'Double values are:', 'double_array_value',
    ),
    ParameterType.PARAMETER_STRING_ARRAY: (
        'string array', 'String values are:', 'string_array_value',
    ),
}  # fmt: skip


def _add_node_arguments(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    add_discovery_arguments(parser)
    parser.add_argument('node_name', nargs='?' if optional else None, help='Name of the ROS node')
    parser.add_argument(
        '--include-hidden-nodes', action='store_true', help='Consider hidden nodes as well'
    )


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of available parameters."""
    _add_node_arguments(parser, optional=True)
    parser.add_argument(
        '--filter', nargs=1, help='Only parameters matching the regex expression will be showed.'
    )
    parser.add_argument(
        '--param-prefixes',
        nargs='+',
        default=[],
        help='Only list parameters with the provided prefixes',
    )
    parser.add_argument(
        '--param-type', action='store_true', help='Print parameter types with parameter names'
    )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> str | None:
    hidden = arguments.include_hidden_nodes
    wanted = absolute(arguments.node_name) if arguments.node_name else ''
    until = (lambda node: wanted in full_node_names(node, hidden)) if wanted else None
    with open_node(arguments, until) as node:
        names = sorted(full_node_names(node, hidden))
        if wanted:
            if wanted not in names:
                return 'Node not found'
            names = [wanted]
        for name in names:
            try:
                client = _client(node, name)
                answer = _finish(
                    node, name, client.list_parameters(prefixes=arguments.param_prefixes)
                )
            except RuntimeError as error:
                print(error, file=sys.stderr)
                continue
            shown = sorted(answer.result.names)
            if arguments.filter:
                shown = [
                    parameter for parameter in shown if re.match(arguments.filter[0], parameter)
                ]
            if not arguments.node_name and shown:
                print(f'{name}:')
            if not arguments.param_type:
                for parameter in shown:
                    print(f'  {parameter}')
                continue
            described = _finish(node, name, client.describe_parameters(shown))
            for descriptor in described.descriptors:
                kind = _KINDS[descriptor.type][0] if descriptor.type in _KINDS else 'not set'
                print(f'  {descriptor.name} (type: {kind})')
    return None


def add_get(parser: argparse.ArgumentParser) -> None:
    """Get parameter."""
    _add_node_arguments(parser)
    parser.add_argument('parameter_name', help='Name of the parameter')
    parser.add_argument('--hide-type', action='store_true', help='Hide the type information')
    _add_timeout(parser)
    parser.set_defaults(run=_get)


def _get(arguments: argparse.Namespace) -> str | None:
    with _open_with(arguments) as node:
        name = absolute(arguments.node_name)
        if name not in full_node_names(node, arguments.include_hidden_nodes):
            return 'Node not found'
        client = _client(node, name)
        values = _finish(node, name, client.get_parameters([arguments.parameter_name])).values
        if not values:
            return 'Parameter not set'
        if values[0].type not in _KINDS:
            print('None' if arguments.hide_type else 'Parameter not set.')
            return None
        _, label, field = _KINDS[values[0].type]
        value = getattr(values[0], field)
        value = value.tolist() if hasattr(value, 'tolist') else value
        print(value) if arguments.hide_type else print(label, value)
    return None


def add_set(parser: argparse.ArgumentParser) -> None:
    """Set parameter."""
    _add_node_arguments(parser)
    parser.add_argument('parameter_name', help='Name of the parameter')
    parser.add_argument('value', help='Value of the parameter')
    _add_timeout(parser)
    parser.set_defaults(run=_set)


def _set(arguments: argparse.Namespace) -> str | None:
    with _open_with(arguments) as node:
        name = absolute(arguments.node_name)
        if name not in full_node_names(node, arguments.include_hidden_nodes):
            return 'Node not found'
        value = get_parameter_value(string_value=arguments.value)
        parameter = Parameter(name=arguments.parameter_name, value=value)
        client = _client(node, name)
        result = _finish(node, name, client.set_parameters([parameter])).results[0]
        reason = f': {result.reason}' if result.reason else ''
        if result.successful:
            print(f'Set parameter successful{reason}')
        else:
            print(f'Setting parameter failed{reason}', file=sys.stderr)
    return None


def _add_timeout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--timeout',
        metavar='N',
        type=int,
        default=1,
        help='Wait for N seconds until node becomes available (default %(default)s sec)',
    )


def _open_with(arguments: argparse.Namespace) -> Any:  # noqa: ANN401 - a context manager of a node
    """A node, as soon as the wanted one is discovered."""
    wanted = absolute(arguments.node_name)
    arguments.spin_time = max(arguments.spin_time, float(arguments.timeout))
    hidden = arguments.include_hidden_nodes
    return open_node(arguments, lambda node: wanted in full_node_names(node, hidden))


def _client(node: Node, name: str) -> AsyncParameterClient:
    client = AsyncParameterClient(node, name)
    if not client.wait_for_services(timeout_sec=5.0):
        msg = f'Wait for service timed out waiting for parameter services for node {name}'
        raise RuntimeError(msg)
    return client


def _finish(node: Node, name: str, future: Any) -> Any:  # noqa: ANN401 - the response of a service
    rclpy.spin_until_future_complete(node, future)
    if future.result() is None:
        msg = f'Exception while calling service of node {name}: {future.exception()}'
        raise RuntimeError(msg)
    return future.result()
