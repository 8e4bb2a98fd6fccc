"""Node `attacker`: says what a broken or hostile node could say, in every field of every interface.

What there is to be said it takes from the ROS graph: every topic that the attacked nodes listen to,
every service and action that they have, and, as the only other node of a domain, every answer that
they wait for. What it sends is a good message with one to three fields spoiled
(:mod:`pack_cell.hostile_fields`), some unspoiled, and what it has heard once more. The same
seed sends the same, as far as what it hears is the same.
"""

from __future__ import annotations

import copy
import random
import time
from collections import Counter, deque
from collections.abc import Iterable
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import ListParameters, SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.serialization import deserialize_message, serialize_message

from pack_cell.hostile_fields import HOSTILE, spoil
from pack_cell.ros.good_messages import GoodMessages
from pack_cell.ros.interfaces_of_node import Interfaces, interface_class, interfaces_of
from pack_msgs.msg import PlacementDecision
from pack_msgs_py.ros import qos

#: Messages of each topic that are kept to be played again.
_KEPT = 50
#: Of what is sent, this share is a good message and this one is played again.
_GOOD, _AGAIN = 0.1, 0.2
#: So many requests wait for an answer before the oldest is forgotten.
_PENDING = 20
#: How long the graph is asked for the interfaces of a node, and how long they must be the same.
_PATIENCE_S, _STEADY_S = 20.0, 1.0


class Attacker(Node):
    """See the module.

    Parameters
    ----------
    seed : of the chances.
    believed : speak as a node that does not say who it is, the only one in its domain, and answer
        what it asks; else as a stranger beside those that are there.
    context : of the node.
    """

    def __init__(
        self, seed: int, *, believed: bool = False, context: Context | None = None
    ) -> None:
        super().__init__('attacker', context=context)
        self._chance = random.Random(seed)
        self._good = GoodMessages(self._chance)
        self._believed = believed
        self.sent: Counter[str] = Counter()
        self.known: dict[str, Interfaces] = {}
        self._heard: dict[str, deque[bytes]] = {}
        self._outlets: dict[str, tuple[type, Any]] = {}
        self._calls: dict[str, Any] = {}
        self._pending: deque[tuple[Any, Any]] = deque()
        self._parameter_names: dict[str, list[str]] = {}

    def get_to_know(self, name: str, found: Interfaces) -> None:
        """Attack the node ``name`` from now on in what was ``found`` of it."""
        self.known[name] = found
        for topic, type_name in found.topics.items():
            if topic not in self._outlets:
                # Offered is what every subscriber takes, and asked for what every publisher offers.
                kind, offered = interface_class(type_name), qos.TOPICS.get(topic, qos.EVENTS)
                self._outlets[topic] = (kind, self.create_publisher(kind, topic, offered))
                self._heard[topic] = deque(maxlen=_KEPT)
                asked = qos.TOPICS.get(topic, qos_profile_sensor_data)
                self.create_subscription(kind, topic, partial(self._hear, topic), asked, raw=True)
        for path, type_name in found.services.items():
            if path not in self._calls:
                self._calls[path] = self.create_client(interface_class(type_name), path)
        for path, type_name in found.clients.items() if self._believed else ():
            service = interface_class(type_name)
            self.create_service(service, path, partial(self._answer, service))

    def knows_parameters(self, node: str, names: Iterable[str]) -> None:
        """These are the parameters of ``node``."""
        self._parameter_names[node] = list(names)

    def _hear(self, topic: str, msg: bytes) -> None:
        self._heard[topic].append(msg)
        if topic == 'bin_state':
            self._good.bins = msg

    def attack(self, kinds: tuple[str, ...], node: str = '') -> None:
        """Send one hostile thing of one of ``kinds``: messages, services, goals, parameters.

        To ``node``, or to any that is known.
        """
        node = node or self._chance.choice(list(self.known))
        kind = self._chance.choice(kinds)
        known = self.known[node]
        goals = [path for path in known.services if path.endswith('/_action/send_goal')]
        services = [path for path in known.services if path not in goals]
        if kind == 'goals' and goals:
            self._service(self._chance.choice(goals))
        elif kind == 'services' and services:
            self._service(self._chance.choice(services))
        elif kind == 'parameters' and self._parameter_names.get(node):
            self._parameter(node)
        elif known.topics:
            kind = 'messages'
            self._message(self._chance.choice(list(known.topics)))
        self.sent[kind] += 1

    def beat(self) -> None:
        """Say something good of every state topic, so that who listens has something to do."""
        for topic in ('box_scan', 'bin_state', 'executor_state'):
            if topic in self._outlets:
                kind, outlet = self._outlets[topic]
                outlet.publish(self._good.of(kind))

    # -- what is sent ------------------------------------------------------------------------------

    def _message(self, topic: str) -> None:
        kind, outlet = self._outlets[topic]
        heard = self._heard[topic]
        draw = self._chance.random()
        if heard and draw < _AGAIN:
            outlet.publish(deserialize_message(self._chance.choice(list(heard)), kind))
            return
        if heard and self._chance.random() < 0.5:
            msg = deserialize_message(self._chance.choice(list(heard)), kind)
        else:
            msg = self._good.of(kind)
        if self._believed:
            _forget_source(msg)
        if draw < 1.0 - _GOOD:
            self._spoil(msg)
        outlet.publish(msg)

    def _service(self, path: str) -> None:
        client = self._calls[path]
        request = self._good.of(client.srv_type.Request)
        if self._chance.random() < 1.0 - _GOOD:
            self._spoil(request)
        self._call(client, request)

    def _answer(self, service: Any, request: Any, response: Any) -> Any:  # noqa: ANN401 - of any service
        """Answer a node that asks, mostly with something spoiled."""
        answer = self._good.of(service.Response)
        if self._chance.random() < 1.0 - _GOOD:
            self._spoil(answer)
        self.sent['answers'] += 1
        return answer

    def _parameter(self, node: str) -> None:
        kind, field, values = self._chance.choice(
            (
                (ParameterType.PARAMETER_DOUBLE, 'double_value', HOSTILE['double']),
                (ParameterType.PARAMETER_INTEGER, 'integer_value', HOSTILE['int64']),
                (ParameterType.PARAMETER_STRING, 'string_value', HOSTILE['string']),
                (ParameterType.PARAMETER_BOOL, 'bool_value', HOSTILE['boolean']),
                (ParameterType.PARAMETER_NOT_SET, 'bool_value', (False,)),
            )
        )
        value = ParameterValue(type=kind, **{field: self._chance.choice(values)})
        name = self._chance.choice(self._parameter_names[node])
        request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        path = next(path for path in self._calls if path.endswith(f'{node}/set_parameters'))
        self._call(self._calls[path], request)

    def _call(self, client: Any, request: Any) -> None:  # noqa: ANN401 - any service
        """Ask, and forget requests that nobody answers."""
        if not client.service_is_ready():
            return
        self._pending.append((client, client.call_async(request)))
        while len(self._pending) > _PENDING:
            late_client, late = self._pending.popleft()
            if not late.done():
                late_client.remove_pending_request(late)

    def _spoil(self, msg: Any) -> None:  # noqa: ANN401 - any message
        """Spoil ``msg``, again when the result cannot be sent at all."""
        spoiled = copy.deepcopy(msg)
        spoil(spoiled, self._chance)
        try:
            serialize_message(spoiled)
        except Exception:  # what no sender can send
            return
        for name in msg.get_fields_and_field_types():
            setattr(msg, name, getattr(spoiled, name))


class SteppedAttacker:
    """An attacker that is spun by its owner, step by step, in ROS domain ``domain``."""

    def __init__(self, seed: int, domain: int, *, believed: bool = False) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._attacker = Attacker(seed, believed=believed, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._attacker)

    @property
    def sent(self) -> Counter[str]:
        """How many things of each kind were sent."""
        return self._attacker.sent

    @property
    def known(self) -> dict[str, Interfaces]:
        """What each attacked node has."""
        return self._attacker.known

    def get_to_know(self, node: str) -> bool:
        """Learn from the graph and from the node itself what there is to attack; whether it has
        told."""
        end_s = time.monotonic() + _PATIENCE_S
        found, since_s = Interfaces(), time.monotonic()
        while time.monotonic() < end_s:
            self.listen(0.1)
            now = interfaces_of(self._attacker, node)
            if now != found:
                found, since_s = now, time.monotonic()
            if found.topics and time.monotonic() - since_s > _STEADY_S:
                break
        self._attacker.get_to_know(node, found)
        names = self.parameters_of(node, _PATIENCE_S)
        self._attacker.knows_parameters(node, names or ())
        return bool(found.topics) and names is not None

    def attack(self, count: int, kinds: tuple[str, ...], node: str = '') -> None:
        """Send ``count`` hostile things; see :meth:`Attacker.attack`."""
        for _ in range(count):
            self._attacker.attack(kinds, node)
            self._executor.spin_once(timeout_sec=0.0)

    def beat(self) -> None:
        """Say something good of every state topic."""
        self._attacker.beat()

    def listen(self, seconds: float) -> None:
        """Hear what is said, for so long."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left_s)

    def parameters_of(self, node: str, seconds: float) -> list[str] | None:
        """Names of the parameters of ``node``; ``None`` when it does not answer in time."""
        client = self._attacker.create_client(ListParameters, f'{node}/list_parameters')
        end_s, future = time.monotonic() + seconds, None
        try:
            while time.monotonic() < end_s:
                self._executor.spin_once(timeout_sec=0.05)
                if future is None and client.service_is_ready():
                    future = client.call_async(ListParameters.Request())
                if future is not None and future.done():
                    return list(future.result().result.names)
            return None
        finally:
            self._attacker.destroy_client(client)

    def close(self) -> None:
        """Leave the domain."""
        self._attacker.destroy_node()
        self._executor.shutdown(timeout_sec=0.0)
        rclpy.try_shutdown(context=self._context)


def _forget_source(msg: Any) -> None:  # noqa: ANN401 - any message
    source = getattr(msg.placement if isinstance(msg, PlacementDecision) else msg, 'source', None)
    if source is not None:
        source.session = source.number = 0
