"""What a node listens to, serves and asks, as the ROS graph tells it; and messages of any type."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from rclpy.node import Node

from pack_cell.ros.message_definitions import message_class

#: Topics that rclpy itself serves: what is said there concerns no node of the cell.
_OF_RCLPY = ('/parameter_events', '/rosout')
_SEQUENCE = re.compile(r'^sequence<([^,>]+)(?:, \d+)?>$')


@dataclass(frozen=True)
class Interfaces:
    """Names, without the namespace, and types of the interfaces of one node or several."""

    topics: dict[str, str] = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)
    clients: dict[str, str] = field(default_factory=dict)

    def with_those_of(self, other: Interfaces) -> Interfaces:
        """Those of both."""
        return Interfaces(
            self.topics | other.topics,
            self.services | other.services,
            self.clients | other.clients,
        )

    @property
    def types(self) -> set[str]:
        """Every type, as `pack_msgs/srv/Operate` or `pack_msgs/action/PlaceBox`."""
        names = (*self.topics.values(), *self.services.values(), *self.clients.values())
        return {re.sub(r'_(SendGoal|GetResult|FeedbackMessage)$', '', name) for name in names}


def interfaces_of(asker: Node, name: str, namespace: str = '/') -> Interfaces:
    """Interfaces of the node ``name`` as far as ``asker`` has heard of them; none of an unknown."""

    def told(what: str) -> dict[str, str]:
        find = getattr(asker, f'get_{what}_names_and_types_by_node')
        try:
            return {topic.lstrip('/'): types[0] for topic, types in find(name, namespace)}
        except RuntimeError:  # rclpy's NodeNameNonExistentError
            return {}

    topics = told('subscriber')
    for topic in _OF_RCLPY:
        topics.pop(topic.lstrip('/'), None)
    return Interfaces(topics, told('service'), told('client'))


def interface_class(type_name: str) -> Any:  # noqa: ANN401 - rclpy is not typed
    """The class of a message or service, also of those that an action consists of."""
    found = re.fullmatch(r'(.+)_(SendGoal|GetResult|FeedbackMessage)', type_name)
    if found is None:
        return message_class(type_name)
    part = found[2] if found[2] == 'FeedbackMessage' else f'{found[2]}Service'
    return getattr(message_class(found[1]).Impl, part)


def filled(kind: Any) -> Any:  # noqa: ANN401 - any message class, and its message
    """A message of ``kind`` as it is made, but with one message in each list of messages."""
    message = kind()
    for name, type_name in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, 'get_fields_and_field_types'):
            setattr(message, name, filled(type(value)))
            continue
        found = _SEQUENCE.match(type_name)
        if found is not None and '/' in found[1]:
            package, inner = found[1].split('/')
            setattr(message, name, [filled(message_class(f'{package}/msg/{inner}'))])
    return message
