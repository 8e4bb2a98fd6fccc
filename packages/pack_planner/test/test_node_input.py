"""Bad input at the planner node, and parameters that change while it runs."""

from __future__ import annotations

import math
from contextlib import contextmanager

import pytest
from planner_cases import SMALL
from planner_peers import TIMEOUT_S, Mailbox, Peers, spinning
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.ros.conversions import decision_from_ros
from pack_msgs_py.ros.testing import private_context
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, Box
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.ros.node import PlannerNode

pytestmark = pytest.mark.ros

EMPTY = Bin('bin-1', 1, SMALL)
CELL = PROFILES['cell']


@pytest.fixture(scope='module', autouse=True)
def compiled():
    """The search is compiled before any time-out counts."""
    for name in ('mpack_lite', 'o_first_fit', 'heightmap_min', 'mpack'):
        warm_up(name, CELL)


@contextmanager
def cell(domain, boxes, **options):
    """The node and its peers, spinning."""
    with private_context(domain) as context:
        peers = Peers(context, boxes, (EMPTY,), **options)
        with spinning(peers, context):
            node = PlannerNode(context=context)
            with spinning(node, context):
                yield peers, node
                node.stop()


def boxes(count):
    return [Box(f'box-{i}', (150.0 + 10 * (i % 3), 120.0, 100.0), 2.0) for i in range(count)]


def spoil_box(change):
    def spoil(msg):
        change(msg.boxes[0].box)

    return spoil


def put(where, value):
    *path, last = where.split('.')

    def change(box):
        for name in path:
            box = getattr(box, name)
        setattr(box, last, value)

    return change


@pytest.mark.parametrize('change', [
    put('size.x', math.nan), put('size.y', math.inf), put('size.z', 0.0), put('size.x', -0.2),
    put('size.x', 1e9), put('mass', math.nan), put('mass', -1.0), put('allowed_up', 0),
    put('com_offset.x', math.nan), put('id', ''), put('id', 'box-1'),
], ids=['nan', 'inf', 'zero', 'negative', 'huge', 'weight nan', 'weight negative', 'allowed_up',
        'centre nan', 'no id', 'id twice'])  # fmt: skip
def test_a_bad_box_in_a_scan_is_told_and_costs_no_other_box(domain, change, capfd):
    with cell(domain, boxes(3)) as (peers, _):
        peers.send_bins()
        peers.send_scan(spoil_box(change))
        chosen = peers.goals.wait(1)[1].box.id
    assert chosen in {'box-1', 'box-2'}
    assert 'box_scan.boxes[' in capfd.readouterr().err


def stale(msg):
    msg.header.stamp.sec -= 60


def ahead(msg):
    msg.header.stamp.sec += 3600


def elsewhere(msg):
    msg.header.frame_id = 'map'


@pytest.mark.parametrize(
    ('spoil', 'said'), [(stale, 's old'), (ahead, 's ahead'), (elsewhere, "'map'")]
)
def test_a_scan_of_long_ago_or_of_another_frame_is_not_used(domain, spoil, said):
    with cell(domain, boxes(2)) as (peers, _):
        logs = Mailbox()
        kept = QoSProfile(depth=50, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        peers.create_subscription(Log, '/rosout', lambda msg: logs.put(msg.msg), kept)
        peers.send_bins()
        peers.send_scan(spoil)
        assert logs.has(lambda line: 'box_scan ignored' in line and said in line, TIMEOUT_S), (
            f'{said!r} was not logged: {logs.items}'
        )
        # the first goal can only come from the scan that follows
        peers.belt = [Box('good', (100.0, 100.0, 100.0), 2.0)]
        peers.send_scan()
        assert peers.goals.wait(1)[1].box.id == 'good'


def test_a_flood_of_heartbeats_costs_no_decision(domain, capfd):
    with cell(domain, boxes(1)) as (peers, _):
        for _ in range(5000):
            peers.beat()
        peers.send_all()
        assert peers.goals.wait(1)[1].box.id == 'box-0'
    said = capfd.readouterr().err
    assert 'Traceback' not in said and 'Error' not in said, said


CHANGES = [
    {'algorithm': 'o_first_fit', 'sort': 'arrival', 'selection': 'nearest'},
    {'algorithm': 'mpack_lite', 'cep': True, 'selection': 'largest'},
    {'algorithm': 'heightmap_min', 'orientations': 'any', 'closing': 'least_useful'},
    {'algorithm': 'mpack', 'orientations': '', 'selection': 'large_when_empty', 'large_until': 0.3},
    {'weights': '2,1,50 RC:3,1,100', 'max_passed_over': 4, 'closing': 'oldest'},
]


@pytest.fixture
def own_algorithm(tmp_path):
    path = tmp_path / 'mine.py'
    path.write_text(
        'from pack_planner import find_algorithm\n'
        "def my_rule(problem): return find_algorithm('dbl')(problem)\n"
    )
    return f'{path}:my_rule'


def test_an_algorithm_of_ones_own_decides(domain, own_algorithm):
    with cell(domain, boxes(3), look_ahead=2) as (peers, node):
        (answer,) = node.set_parameters([Parameter('algorithm', value=own_algorithm)])
        assert answer.successful, answer.reason
        peers.send_all()
        told = [decision_from_ros(peers.announced.wait(number + 1)[0]) for number in range(3)]
        assert {decision.algorithm for decision in told} == {'mine.py:my_rule'}


def test_every_option_may_change_between_two_boxes(domain):
    stream = boxes(4 * len(CHANGES))
    algorithm = 'mpack_lite'
    with cell(domain, stream, look_ahead=3) as (peers, node):
        peers.release.clear()
        peers.send_all()
        for number, change in enumerate(CHANGES):
            # the arm waits with one box, and the next is decided already
            peers.goals.wait(2 * number + 1)
            given = [Parameter(name, value=value) for name, value in change.items()]
            assert all(answer.successful for answer in node.set_parameters(given))
            algorithm = change.get('algorithm', algorithm)
            changed_s = peers.now_s()
            peers.release.set()

            # What was decided before may still be on its way.
            def chosen(item, algorithm=algorithm, changed_s=changed_s):
                return item[1] > changed_s and item[0].algorithm == algorithm

            assert peers.announced.has(chosen, TIMEOUT_S), f'nothing is decided by {algorithm}'
        ids = {peers.goals.wait(i + 1)[1].box.id for i in range(len(stream))}
    assert ids == {box.id for box in stream}
    assert validate_bins(peers.bins, CELL) == []


BAD = {
    'algorithm': ('best_guess', 'mpack_lite'), 'sort': ('colour', 'volume'),
    'selection': ('best', 'auto, least_increase'), 'closing': ('newest', 'fullest'),
    'cep': (1, 'BOOL'), 'weights': ('1,nan,100', 'w2 is nan'), 'large_until': (2.0, '1'),
    'max_passed_over': (-1, '0'), 'budget_s': (math.nan, 'nan'), 'profile': ('soft', 'paper'),
}  # fmt: skip


def test_a_bad_value_is_refused_with_the_reason_and_the_old_one_kept(domain):
    with private_context(domain) as context:
        node = PlannerNode(context=context)
        before = node.parameters
        for name, (value, said) in BAD.items():
            answer = node.set_parameters([Parameter(name, value=value)])[0]
            assert not answer.successful and said in answer.reason, name
            assert node.get_parameter(name).value == getattr(before, name)
        assert node.parameters == before
        node.stop()
        node.destroy_node()
