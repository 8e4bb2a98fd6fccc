"""``ros2 service list | type | call``."""

from __future__ import annotations

import argparse
import sys
import time

import rclpy
import yaml

from ros2cli_standin.graph import (
    add_discovery_arguments,
    open_node,
    print_names,
    without_hidden,
)
from ros2cli_standin.interfaces import load_interface
from ros2cli_standin.message_text import set_fields


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of available services."""
    add_discovery_arguments(parser)
    parser.add_argument(
        '-t', '--show-types', action='store_true', help='Additionally show the service type'
    )
    parser.add_argument(
        '-c',
        '--count-services',
        action='store_true',
        help='Only display the number of services discovered',
    )
    parser.add_argument(
        '--include-hidden-services', action='store_true', help='Consider hidden services as well'
    )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> None:
    with open_node(arguments) as node:
        services = node.get_service_names_and_types()
    shown = without_hidden(services, arguments.include_hidden_services)
    print_names(shown, arguments.show_types, arguments.count_services)


def add_type(parser: argparse.ArgumentParser) -> None:
    """Output a service's type."""
    add_discovery_arguments(parser)
    parser.add_argument('service_name', help="Name of the ROS service (e.g. '/add_two_ints')")
    parser.set_defaults(run=_type)


def _type(arguments: argparse.Namespace) -> int:
    name = arguments.service_name
    with open_node(
        arguments, lambda node: name in dict(node.get_service_names_and_types())
    ) as node:
        types = dict(node.get_service_names_and_types()).get(name)
    for kind in types or ():
        print(kind)
    return 0 if types else 1


def add_call(parser: argparse.ArgumentParser) -> None:
    """Call a service."""
    parser.add_argument(
        'service_name', help="Name of the ROS service to call to (e.g. '/add_two_ints')"
    )
    parser.add_argument('service_type', help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
    values = parser.add_mutually_exclusive_group()
    values.add_argument(
        'values',
        nargs='?',
        default='{}',
        help="Values to fill the service request with in YAML format (e.g. '{a: 1, b: 2}'), "
        'otherwise the service request will be published with default values',
    )
    values.add_argument('--stdin', action='store_true', help='Read values from standard input')
    parser.add_argument(
        '-r', '--rate', metavar='N', type=float, help='Repeat the call at a specific rate in Hz'
    )
    parser.set_defaults(run=_call, use_sim_time=False, spin_time=0.0)


def _call(arguments: argparse.Namespace) -> str | None:
    if arguments.rate is not None and arguments.rate <= 0:
        raise RuntimeError('rate must be greater than zero')
    name = arguments.service_type
    if name.count('/') == 1:
        name = name.replace('/', '/srv/')
    try:
        service_type = load_interface(name)
    except (AttributeError, ModuleNotFoundError, ValueError):
        raise RuntimeError('The passed service type is invalid') from None
    if not hasattr(service_type, 'Request'):
        raise RuntimeError('The passed type is not a service')
    request = service_type.Request()
    try:
        text = sys.stdin.read() if arguments.stdin else arguments.values
        set_fields(request, yaml.safe_load(text))
    except Exception as error:
        return f'Failed to populate field: {error}'

    with open_node(arguments) as node:
        client = node.create_client(service_type, arguments.service_name)
        if not client.service_is_ready():
            print('waiting for service to become available...')
            client.wait_for_service()
        while True:
            print(f'requester: making request: {request!r}\n')
            began = time.monotonic()
            future = client.call_async(request)
            rclpy.spin_until_future_complete(node, future)
            if future.result() is None:
                msg = f'Exception while calling service: {future.exception()!r}'
                raise RuntimeError(msg)
            print(f'response:\n{future.result()!r}\n')
            if arguments.rate is None or not rclpy.ok():
                return None
            time.sleep(max(0.0, began + 1.0 / arguments.rate - time.monotonic()))
