"""Node `attacker`: says what a broken or hostile node could say, in every field of every interface.

What it sends is a good message with one to three fields spoiled
(:mod:`pack_cell.hostile_fields`), some unspoiled, and what it has heard once more. The same
seed sends the same, as far as what it hears is the same.
"""

from __future__ import annotations

import copy
import random
import time
import uuid
from collections import Counter, deque
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import ListParameters, SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from std_srvs.srv import SetBool, Trigger
from unique_identifier_msgs.msg import UUID  # type: ignore[import-untyped]

from pack_cell.hostile_fields import HOSTILE, spoil
from pack_msgs.action import PlaceBox
from pack_msgs.msg import (
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    ExecutorState,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs.srv import CheckPlacements, CutOff, InsertBox, RemoveBox, SwapBin
from pack_msgs_py.cell_values import BinSnapshot, Decision, Report, Scan, ScannedBox
from pack_msgs_py.cell_values import BoxEvent as BoxEventValue
from pack_msgs_py.codes import BinStatus, BoxEventKind, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.parameter_fields import parameter_fields
from pack_msgs_py.ros import conversions as conv
from pack_msgs_py.ros import qos
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

TOPICS: dict[str, type] = {
    'box_scan': BoxScan,
    qos.TRUE_BOXES: BoxScan,
    'bin_state': BinStateArray,
    'bin_closed': BinState,
    'placements': PlacementDecision,
    'placement_report': PlacementReport,
    'box_event': BoxEvent,
    'executor_state': ExecutorState,
}
#: Services of a node, by its name; those without any field are commands that nobody can spoil.
SERVICES: dict[str, tuple[tuple[type, str], ...]] = {
    'conveyor': ((InsertBox, 'insert_box'), (RemoveBox, 'remove_box')),
    'arm_executor': (
        (CheckPlacements, '/check_placements'),
        (SwapBin, '/swap_bin'),
        (CutOff, '/cut_off'),
    ),
    'planner': (),
}
COMMANDS: dict[str, tuple[tuple[type, str], ...]] = {
    'conveyor': ((SetBool, 'pause'), (SetBool, 'drain')),
    'arm_executor': ((SetBool, 'pause'), (Trigger, 'stop'), (Trigger, 'reset')),
    'planner': (),
}
#: Messages of each topic that are kept to be played again.
_KEPT = 50
#: Of what is sent, this share is a good message and this one is played again.
_GOOD, _AGAIN = 0.1, 0.2
#: A node gets so long to answer before the next request is sent without waiting.
_PENDING = 20


class Attacker(Node):
    """See the module.

    Parameters
    ----------
    seed : of the chances.
    believed : speak as a node that does not say who it is, the only one in its domain; else as
        a stranger beside those that are there.
    context : of the node.
    """

    def __init__(
        self, seed: int, *, believed: bool = False, context: Context | None = None
    ) -> None:
        super().__init__('attacker', context=context)
        self._chance = random.Random(seed)
        self._believed = believed
        self.sent: Counter[str] = Counter()
        self._heard: dict[str, deque[bytes]] = {topic: deque(maxlen=_KEPT) for topic in TOPICS}
        self._outlets = {
            topic: self.create_publisher(kind, topic, qos.TOPICS[topic])
            for topic, kind in TOPICS.items()
        }
        for topic, kind in TOPICS.items():
            self.create_subscription(
                kind, topic, partial(self._hear, topic), qos.TOPICS[topic], raw=True
            )
        self._calls: dict[tuple[str, str], Any] = {}
        self._goals = self.create_client(
            PlaceBox.Impl.SendGoalService, 'place_box/_action/send_goal'
        )
        self._pending: deque[tuple[Any, Any]] = deque()

    def _hear(self, topic: str, msg: bytes) -> None:
        self._heard[topic].append(msg)

    def attack(self, kinds: tuple[str, ...], node: str = '') -> None:
        """Send one hostile thing of one of ``kinds``: messages, services, commands, goals,
        parameters; the last four, and messages that it does not hear, go to ``node``."""
        kind = self._chance.choice(kinds)
        if kind == 'messages':
            self._message()
        elif kind == 'goals':
            self._goal()
        elif kind == 'parameters':
            self._parameter(node)
        else:
            self._service(node, kind)
        self.sent[kind] += 1

    def beat(self) -> None:
        """Say something good of every state topic, so that who listens has something to do."""
        for topic in ('box_scan', 'bin_state', 'executor_state'):
            self._outlets[topic].publish(self._good(topic))

    # -- what is sent ------------------------------------------------------------------------------

    def _message(self) -> None:
        topic = self._chance.choice(list(TOPICS))
        heard = self._heard[topic]
        draw = self._chance.random()
        if heard and draw < _AGAIN:
            msg = deserialize_message(self._chance.choice(list(heard)), TOPICS[topic])
            self._outlets[topic].publish(msg)
            return
        if heard and self._chance.random() < 0.5:
            msg = deserialize_message(self._chance.choice(list(heard)), TOPICS[topic])
        else:
            msg = self._good(topic)
        if self._believed:
            _forget_source(msg)
        if draw < 1.0 - _GOOD:
            self._spoil(msg)
        self._outlets[topic].publish(msg)

    def _service(self, node: str, kind: str) -> None:
        services = (SERVICES if kind == 'services' else COMMANDS)[node]
        if not services:
            return
        service, name = self._chance.choice(services)
        request = self._request(service)
        if kind == 'services' or self._chance.random() < 0.5:
            self._spoil(request)
        path = name.lstrip('/') if name.startswith('/') else f'{node}/{name}'
        self._call(service, path, request)

    def _goal(self) -> None:
        placement = conv.placement_to_ros(self._decision(), 'bin_a')
        goal = PlaceBox.Goal(placement=placement)
        goal.pick_pose.header.frame_id = 'cell'
        goal.pick_pose.pose = conv.pose_to_ros(Pose((0.0, 0.65, 0.8)))
        goal.deadline = conv.time_to_ros(time.time() + 60.0)
        self._spoil(goal)
        request = PlaceBox.Impl.SendGoalService.Request(
            goal_id=UUID(uuid=list(uuid.uuid4().bytes)), goal=goal
        )
        if self._goals.service_is_ready():
            self._wait_for(self._goals, self._goals.call_async(request))

    def _parameter(self, node: str) -> None:
        names = {
            'conveyor': 'conveyor_sim',
            'planner': 'pack_planner',
            'arm_executor': 'arm_executor',
        }
        module = __import__(f'{names[node]}.parameters', fromlist=['parameters'])
        declared = next(
            value
            for name, value in vars(module).items()
            if name in ('ConveyorParameters', 'PlannerParameters', 'ExecutorParameters')
        )
        spec = self._chance.choice(parameter_fields(declared))
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
        request = SetParameters.Request(parameters=[Parameter(name=spec.name, value=value)])
        self._call(SetParameters, f'{node}/set_parameters', request)

    def _call(self, service: type, path: str, request: Any) -> None:  # noqa: ANN401 - any request
        key = (service.__name__, path)
        if key not in self._calls:
            self._calls[key] = self.create_client(service, path)
        client = self._calls[key]
        if client.service_is_ready():
            self._wait_for(client, client.call_async(request))

    def _wait_for(self, client: Any, future: Any) -> None:  # noqa: ANN401 - rclpy's
        """Forget requests that nobody answers."""
        self._pending.append((client, future))
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

    # -- what is good ------------------------------------------------------------------------------

    def _box(self, number: int | None = None) -> Box:
        number = self._chance.randrange(8) if number is None else number
        return Box(f'hostile-{number}', (300.0, 200.0, 100.0), 2.0)

    def _decision(self) -> Decision:
        bins = self._heard['bin_state']
        bin_id, serial, revision = 'LDC-1', 1, 0
        if bins:
            state = deserialize_message(bins[-1], BinStateArray)
            if state.bins:
                target = state.bins[0]
                bin_id, serial, revision = target.bin_id, target.serial, target.revision
        return Decision(
            self._box(),
            bin_id,
            serial,
            revision,
            size_mm=(310, 210, 101),
            target=Pose((0.155, 0.105, 0.05)),
            stamp_s=time.time(),
        )

    def _good(self, topic: str) -> Any:  # noqa: ANN401 - any message
        now_s = time.time()
        placed = PlacedBox(self._box(99), (0, 0, 0), (310, 210, 100), 'xyz', (155.0, 105.0, 50.0))
        in_bin = Bin('LDC-1', 1, parse_bin('LDC'), (placed,), 'A', 3)
        poses = {placed.box.id: Pose((0.155, 0.105, 0.05))}
        if topic in ('box_scan', qos.TRUE_BOXES):
            boxes = [
                ScannedBox(
                    self._box(n), Pose((0.0, 0.65 + 0.8 * n, 0.8)), now_s if n == 0 else None
                )
                for n in range(5)
            ]
            return conv.scan_to_ros(Scan(int(now_s), now_s, tuple(boxes), supplied=5, remaining=9))
        if topic == 'bin_state':
            return conv.bins_to_ros(BinSnapshot(3, now_s, (in_bin,)), poses)
        if topic == 'bin_closed':
            return conv.bin_to_ros(in_bin, poses, conv.time_to_ros(now_s), BinStatus.CLOSED)
        if topic == 'placements':
            return conv.decision_to_ros(self._decision(), 'bin_a')
        if topic == 'placement_report':
            return conv.report_to_ros(Report(self._box().id, measured=Pose(), stamp_s=now_s))
        if topic == 'box_event':
            kind = self._chance.choice(list(BoxEventKind))
            return conv.event_to_ros(BoxEventValue(self._box().id, kind, stamp_s=now_s))
        state = ExecutorState(mode=int(Mode.IDLE))
        state.header.stamp = conv.time_to_ros(now_s)
        return state

    def _request(self, service: Any) -> Any:  # noqa: ANN401 - any service and its request
        if service is InsertBox:
            return InsertBox.Request(box=conv.box_to_ros(self._box(self._chance.randrange(10**6))))
        if service is RemoveBox:
            return RemoveBox.Request(box_id=self._box().id)
        if service is CheckPlacements:
            one = conv.placement_to_ros(self._decision(), 'bin_a')
            return CheckPlacements.Request(candidates=[one])
        if service is SwapBin:
            return SwapBin.Request(bin_id=self._decision().bin_id)
        return service.Request()


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

    def answers(self, node: str, seconds: float) -> bool:
        """Whether ``node`` answers a question in so many seconds."""
        client = self._attacker.create_client(ListParameters, f'{node}/list_parameters')
        end_s, future = time.monotonic() + seconds, None
        try:
            while time.monotonic() < end_s:
                self._executor.spin_once(timeout_sec=0.05)
                if future is None and client.service_is_ready():
                    future = client.call_async(ListParameters.Request())
                if future is not None and future.done():
                    return True
            return False
        finally:
            self._attacker.destroy_client(client)

    def close(self) -> None:
        """Leave the domain."""
        self._attacker.destroy_node()
        self._executor.shutdown(timeout_sec=0.0)
        rclpy.try_shutdown(context=self._context)


def _forget_source(msg: Any) -> None:  # noqa: ANN401 - any message
    source = msg.placement.source if isinstance(msg, PlacementDecision) else msg.source
    source.session = source.number = 0
