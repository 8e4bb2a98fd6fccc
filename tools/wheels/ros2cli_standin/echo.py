"""``ros2 topic echo``: print the messages of a topic."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import rclpy
import yaml
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.qos import (
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    QoSReliabilityPolicy,
)
from rclpy.task import Future

from ros2cli_standin.graph import add_discovery_arguments, open_node
from ros2cli_standin.interfaces import load_interface
from ros2cli_standin.message_text import Style, to_csv, to_yaml
from ros2cli_standin.topics import topic_class

DEFAULT_TRUNCATE_LENGTH = 128


def positive_float(text: str) -> float:
    """A number above zero, for argparse."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError('Expects a floating point number') from None
    if not value > 0.0:
        raise argparse.ArgumentTypeError('Value must be positive')
    return value


def _unsigned_int(text: str) -> int:
    value = int(text) if text.isdigit() else -1
    if value < 0:
        raise argparse.ArgumentTypeError('value must be a non-negative integer')
    return value


def add_echo(parser: argparse.ArgumentParser) -> None:
    """Output messages from a topic."""
    add_discovery_arguments(parser)
    add = parser.add_argument
    add('topic_name', help="Name of the ROS topic to listen to (e.g. '/chatter')")
    add('message_type', nargs='?', help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
    add(
        '--qos-profile',
        choices=QoSPresetProfiles.short_keys(),
        default='sensor_data',
        help='Quality of service preset profile to subscribe with (default: sensor_data)',
    )
    add('--qos-depth', metavar='N', type=int, help='Queue size setting to subscribe with')
    add('--qos-history', choices=QoSHistoryPolicy.short_keys(), help='History of samples')
    add(
        '--qos-reliability',
        choices=QoSReliabilityPolicy.short_keys(),
        help='Reliability (default: compatible profile with running endpoints)',
    )
    add(
        '--qos-durability',
        choices=QoSDurabilityPolicy.short_keys(),
        help='Durability (default: compatible profile with running endpoints)',
    )
    add('--qos-liveliness', choices=QoSLivelinessPolicy.short_keys(), help='Liveliness')
    add('--qos-liveliness-lease-duration-seconds', type=float, help='Liveliness lease duration')
    add('--csv', action='store_true', help='Output all recursive fields separated by commas')
    add('--field', help="Echo a selected field of a message; use '.' to select sub-fields")
    add(
        '--full-length',
        '-f',
        action='store_true',
        help='Output all elements for arrays, bytes, and string, however long they are',
    )
    add(
        '--truncate-length',
        '-l',
        type=_unsigned_int,
        default=DEFAULT_TRUNCATE_LENGTH,
        help='The length to truncate arrays, bytes, and string to (default: %(default)s)',
    )
    add('--no-arr', action='store_true', help="Don't print array fields of messages")
    add('--no-str', action='store_true', help="Don't print string fields of messages")
    add('--flow-style', action='store_true', help='Print collections in the flow style')
    add('--no-lost-messages', action='store_true', help="Don't report when a message is lost")
    add('--raw', action='store_true', help='Echo the raw binary representation')
    add(
        '--filter',
        dest='filter_expr',
        help='Python expression to filter messages that are printed; m is the message',
    )
    add('--once', action='store_true', help='Print the first message received and then exit.')
    add('--timeout', metavar='N', type=positive_float, help='Set a timeout in seconds for waiting')
    add('--include-message-info', '-i', action='store_true', help='Shows the message info.')
    parser.set_defaults(run=_echo)


def _echo(arguments: argparse.Namespace) -> None:
    if arguments.field is not None and not arguments.field.strip('.'):
        msg = f"Invalid field value '{arguments.field}'"
        raise RuntimeError(msg)
    topic = arguments.topic_name
    with open_node(arguments, lambda node: is_published(node, topic)) as node:
        profile = _choose_qos(node, arguments)
        message_type = _message_type(node, arguments)
        printer = _Printer(arguments)
        lost = None if arguments.no_lost_messages else _print_lost
        try:
            _subscribe(node, message_type, printer, profile, lost)
        except UnsupportedEventTypeError:
            _subscribe(node, message_type, printer, profile, None)
        if arguments.timeout is not None:
            node.create_timer(arguments.timeout, lambda: printer.done.set_result(True))
        if arguments.once or arguments.timeout is not None:
            rclpy.spin_until_future_complete(node, printer.done)
        else:
            rclpy.spin(node)


def is_published(node: Node, topic: str) -> bool:
    """Whether somebody sends on the topic; ``RuntimeError`` if it cannot be echoed.

    A subscriber alone tells the type, but not the quality of service that gets the last message.
    """
    return topic_class(node, topic) is not None and node.count_publishers(topic) > 0


def _message_type(node: Node, arguments: argparse.Namespace) -> type:
    if arguments.message_type is not None:
        try:
            return load_interface(arguments.message_type)
        except (AttributeError, ModuleNotFoundError, ValueError):
            raise RuntimeError('The passed message type is invalid') from None
    kind = topic_class(node, arguments.topic_name)
    if kind is None:
        print(f'WARNING: topic [{arguments.topic_name}] does not appear to be published yet')
        raise RuntimeError('Could not determine the type for the passed topic')
    return kind


def _subscribe(
    node: Node,
    message_type: type,
    printer: _Printer,
    profile: QoSProfile,
    lost: Callable[[Any], None] | None,
) -> None:
    node.create_subscription(
        message_type,
        printer.arguments.topic_name,
        printer.on_message,
        profile,
        event_callbacks=SubscriptionEventCallbacks(message_lost=lost) if lost else None,
        raw=printer.arguments.raw,
    )


def _choose_qos(node: Node, arguments: argparse.Namespace) -> QoSProfile:
    """The profile of the options; without options one that matches every publisher."""
    profile = QoSPresetProfiles.get_from_short_key(arguments.qos_profile)
    given = False
    for name, policy in (
        ('history', QoSHistoryPolicy),
        ('durability', QoSDurabilityPolicy),
        ('reliability', QoSReliabilityPolicy),
        ('liveliness', QoSLivelinessPolicy),
    ):
        value = getattr(arguments, f'qos_{name}')
        if value is not None:
            setattr(profile, name, policy.get_from_short_key(value))
            given = True
    lease = arguments.qos_liveliness_lease_duration_seconds
    if lease is not None:
        profile.liveliness_lease_duration = Duration(seconds=lease)
        given = True
    if arguments.qos_depth is not None:
        profile.depth = arguments.qos_depth
        given = True
    publishers = node.get_publishers_info_by_topic(arguments.topic_name)
    if given or not publishers:
        return profile
    for name, strong, weak in (
        ('reliability', QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT),
        ('durability', QoSDurabilityPolicy.TRANSIENT_LOCAL, QoSDurabilityPolicy.VOLATILE),
    ):
        offered = [getattr(publisher.qos_profile, name) == strong for publisher in publishers]
        if any(offered) and not all(offered):
            kind = type(strong).__name__
            print(
                f'Some, but not all, publishers are offering {kind}.{strong.name}. '
                f'Falling back to {kind}.{weak.name} as it will connect to all publishers'
            )
        setattr(profile, name, strong if all(offered) else weak)
    return profile


def _print_lost(status: Any) -> None:  # noqa: ANN401 - rclpy does not export its type
    print(
        f'A message was lost!!!\n\ttotal count change:{status.total_count_change}'
        f'\n\ttotal count: {status.total_count}',
        end='---\n',
    )


class _Printer:
    """Prints the messages that arrive, as the options say."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self.arguments = arguments
        self.done = Future()
        self._fields = [part for part in (arguments.field or '').split('.') if part]
        self._style = Style(
            truncate=None if arguments.full_length else arguments.truncate_length,
            no_arr=arguments.no_arr,
            no_str=arguments.no_str,
        )

    def on_message(self, message: Any, info: dict[str, Any]) -> None:  # noqa: ANN401 - any type
        """Print a message, unless the filter refuses it."""
        for name in self._fields:
            try:
                message = getattr(message, name)
            except AttributeError as error:
                msg = f"Invalid field '{self.arguments.field}': {error}"
                raise RuntimeError(msg) from None
        if self.arguments.filter_expr and not eval(self.arguments.filter_expr, {'m': message}):
            return
        self._print(message, info)
        if self.arguments.once and not self.done.done():
            self.done.set_result(True)

    def _print(self, message: Any, info: dict[str, Any]) -> None:  # noqa: ANN401 - any type
        show_info = self.arguments.include_message_info
        if not hasattr(message, 'get_fields_and_field_types'):
            if show_info:
                print(f'---Got new message, message info:---\n{info}\n---Message data:---')
            print(message, end='\n---\n')
        elif self.arguments.csv:
            before = [str(value) for value in info.values()] if show_info else []
            print(','.join([*before, to_csv(message, self._style)]))
        else:
            if show_info:
                print(yaml.dump(info), end='---\n')
            print(to_yaml(message, self._style, flow_style=self.arguments.flow_style), end='---\n')
