"""``ros2 topic list | info | type``, and how a topic's type is found."""

from __future__ import annotations

import argparse

from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
from rclpy.validate_full_topic_name import validate_full_topic_name

from ros2cli_standin.graph import (
    add_discovery_arguments,
    open_node,
    print_names,
    without_hidden,
)
from ros2cli_standin.interfaces import load_interface


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of available topics."""
    add_discovery_arguments(parser)
    parser.add_argument(
        '-t', '--show-types', action='store_true', help='Additionally show the topic type'
    )
    parser.add_argument(
        '-c',
        '--count-topics',
        action='store_true',
        help='Only display the number of topics discovered',
    )
    parser.add_argument(
        '--include-hidden-topics', action='store_true', help='Consider hidden topics as well'
    )
    parser.add_argument(
        '-v', '--verbose', action='store_true', help='List full details about each topic'
    )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> None:
    with open_node(arguments) as node:
        topics = without_hidden(node.get_topic_names_and_types(), arguments.include_hidden_topics)
        if not arguments.verbose or arguments.count_topics:
            print_names(topics, arguments.show_types, arguments.count_topics)
            return
        for title, noun, count in (
            ('Published', 'publisher', node.count_publishers),
            ('Subscribed', 'subscriber', node.count_subscribers),
        ):
            print(f'{title} topics:')
            for name, types in topics:
                number = count(name)
                if number:
                    plural = 's' if number > 1 else ''
                    print(f' * {name} [{", ".join(types)}] {number} {noun}{plural}')
            print()


def add_info(parser: argparse.ArgumentParser) -> None:
    """Print information about a topic."""
    add_discovery_arguments(parser)
    parser.add_argument('topic_name', help="Name of the ROS topic to get info (e.g. '/chatter')")
    parser.add_argument(
        '--verbose',
        '-v',
        action='store_true',
        help='Prints detailed information like the node name, node namespace, topic type, '
        'topic type hash, GUID, and QoS Profile of the publishers and subscribers to this topic',
    )
    parser.set_defaults(run=_info)


def _info(arguments: argparse.Namespace) -> str | None:
    topic = arguments.topic_name
    with open_node(arguments, lambda node: topic in dict(node.get_topic_names_and_types())) as node:
        types = dict(node.get_topic_names_and_types()).get(topic)
        if types is None:
            return f"Unknown topic '{topic}'"
        end = '\n\n' if arguments.verbose else '\n'
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        for noun, count, details in (
            ('Publisher', node.count_publishers, node.get_publishers_info_by_topic),
            ('Subscription', node.count_subscribers, node.get_subscriptions_info_by_topic),
        ):
            print(f'{noun} count: {count(topic)}', end=end)
            if arguments.verbose:
                for endpoint in details(topic):
                    print(endpoint, end=end)
    return None


def add_type(parser: argparse.ArgumentParser) -> None:
    """Print a topic's type."""
    add_discovery_arguments(parser)
    parser.add_argument('topic_name', help="Name of the ROS topic to get type (e.g. '/chatter')")
    parser.add_argument(
        '--include-hidden-topics', action='store_true', help='Consider hidden topics as well'
    )
    parser.set_defaults(run=_type)


def _type(arguments: argparse.Namespace) -> int:
    topic = arguments.topic_name
    with open_node(arguments, lambda node: topic in dict(node.get_topic_names_and_types())) as node:
        topics = without_hidden(node.get_topic_names_and_types(), arguments.include_hidden_topics)
    types = dict(topics).get(topic)
    for kind in types or ():
        print(kind)
    return 0 if types else 1


def full_topic_name(node: Node, topic: str) -> str:
    """The name as a full one; ``RuntimeError`` if it cannot be the name of a topic."""
    try:
        expanded: str = expand_topic_name(topic, node.get_name(), node.get_namespace())
        validate_full_topic_name(expanded)
    except (ValueError, InvalidTopicNameException) as error:
        raise RuntimeError(error) from error
    return expanded


def topic_class(node: Node, topic: str) -> type | None:
    """The message class of a topic, or ``None`` while nobody offers the topic.

    Raises
    ------
    RuntimeError
        The name cannot be one, the topic has several types, or its type is not installed here.
    """
    types = dict(node.get_topic_names_and_types()).get(full_topic_name(node, topic))
    if types is None:
        return None
    if len(types) > 1:
        msg = (
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
        raise RuntimeError(msg)
    try:
        return load_interface(types[0])
    except (AttributeError, ModuleNotFoundError, ValueError):
        msg = f"The message type '{types[0]}' is invalid"
        raise RuntimeError(msg) from None
