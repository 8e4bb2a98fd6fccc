"""The planner node against a scripted belt and arm, over real ROS in a private domain."""

from __future__ import annotations

import itertools
import math
import os
import random
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from planner_cases import SMALL, random_bin
from planner_peers import TIMEOUT_S, Mailbox, Peers, spinning
from rclpy.parameter import Parameter

from pack_msgs.msg import PlacementDecision
from pack_msgs_py.codes import ErrorCode, Mode, Reason
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.ros.conversions import decision_from_ros, duration_from_ros, placement_from_ros
from pack_msgs_py.ros.testing import private_context
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, Box
from pack_planner.decision.refusals import TRIES_IN_EMPTY_BIN
from pack_planner.engine import Engine
from pack_planner.engine.engine import REFUSED_RADIUS_MM
from pack_planner.ros.node import PlannerNode

pytestmark = pytest.mark.ros

EMPTY = Bin('bin-1', 1, SMALL)
CELL = PROFILES['cell']


@pytest.fixture(scope='module', autouse=True)
def compiled():
    """The search is compiled before any time-out counts."""
    Engine(CELL)


@contextmanager
def cell(domain, boxes, bins=(EMPTY,), parameters=None, **options):
    """The node and its peers, spinning."""
    given = [Parameter(name, value=value) for name, value in (parameters or {}).items()]
    with private_context(domain) as context:
        peers = Peers(context, boxes, bins, **options)
        with spinning(peers, context):
            node = PlannerNode(context=context, parameter_overrides=given)
            with spinning(node, context):
                if peers.answers is not None:
                    assert node._asker._client.wait_for_service(TIMEOUT_S)
                yield peers
                node.stop()


def boxes(count, size=(150.0, 120.0, 100.0)):
    return [Box(f'box-{i}', (size[0] + 10 * (i % 3), size[1], size[2]), 2.0) for i in range(count)]


def decision(entry):
    return decision_from_ros(entry[0])


@pytest.mark.parametrize('order', list(itertools.permutations(['scan', 'bins', 'heartbeat'])))
def test_it_decides_once_it_has_scan_bins_and_heartbeat_in_any_order(domain, order):
    with private_context(domain) as context:
        peers = Peers(context, boxes(3), (EMPTY,))
        peers.beating = False
        with spinning(peers, context):
            node = PlannerNode(context=context)
            with spinning(node, context):
                send = {
                    'scan': peers.send_scan,
                    'bins': peers.send_bins,
                    'heartbeat': lambda: setattr(peers, 'beating', True),
                }
                for name in order[:2]:
                    send[name]()
                assert peers.goals.items == []
                send[order[2]]()
                goal, chosen = peers.goals.wait(1)
                node.stop()
    assert chosen.bin_id == 'bin-1' and chosen.corner_mm == (0, 0, 0)
    assert goal.placement.header.frame_id == 'bin_a'
    assert goal.pick_pose.header.frame_id == 'cell'
    assert goal.pick_pose.pose.position.x == 0.0


def test_it_packs_the_whole_stream_and_breaks_no_rule(domain):
    stream = boxes(14)
    with cell(domain, stream) as peers:
        peers.send_all()
        placed = [peers.goals.wait(i + 1)[1].box.id for i in range(len(stream))]
    assert sorted(placed) == sorted(box.id for box in stream)
    assert validate_bins(peers.bins, CELL) == []


def test_the_next_box_is_announced_while_the_arm_still_moves(domain):
    with cell(domain, boxes(8)) as peers:
        peers.release.clear()
        peers.send_all()
        peers.announced.wait(2)
        first, second = (decision(entry) for entry in peers.announced.items[:2])
        assert len(peers.goals.items) == 1
        assert (second.bin_revision, second.sequence) == (first.bin_revision + 1, 2)
        peers.release.set()
        goal, sent = peers.goals.wait(2)
    assert (sent.box, sent.corner_mm, sent.sequence) == (second.box, second.corner_mm, 2)
    given = goal.deadline.sec + 1e-9 * goal.deadline.nanosec - sent.stamp_s
    assert given >= 5.5, 'planning that the motion hid does not count'


def test_a_stale_revision_is_decided_again_with_the_new_bins(domain):
    with cell(domain, boxes(3), script=[ErrorCode.STALE_BIN_REVISION]) as peers:
        peers.send_all()
        peers.goals.wait(1)
        peers.bins = (replace(EMPTY, revision=5),)
        peers.send_bins()
        assert peers.goals.wait(2)[1].bin_revision == 5


def test_a_refused_placement_is_followed_by_another_one(domain):
    script = [ErrorCode.NO_IK_SOLUTION, ErrorCode.PATH_IN_COLLISION]
    with cell(domain, boxes(1), script=script) as peers:
        peers.send_all()
        peers.goals.wait(3)
        tried = [
            (decision.orientation, decision.corner_mm) for _, decision in peers.goals.items[:3]
        ]
    for (turn, corner), (other_turn, other) in itertools.combinations(tried, 2):
        apart = max(abs(a - b) for a, b in zip(corner, other, strict=True))
        assert turn != other_turn or apart >= REFUSED_RADIUS_MM


def test_what_the_arm_says_it_cannot_do_never_becomes_a_goal(domain):
    answers = [ErrorCode.NO_IK_SOLUTION, ErrorCode.PATH_IN_COLLISION]
    with cell(domain, boxes(3), answers=answers) as peers:
        peers.send_all()
        _, sent = peers.goals.wait(1)
        first, others = peers.asked.wait(1), peers.asked.wait(2)
        told = decision(peers.announced.wait(1))  # on another topic than the goal
    assert len(first.candidates) == 1 and 5.0 < duration_from_ros(first.enough) < 5.4
    assert 2 <= len(others.candidates) <= 12
    corners = [placement_from_ros(candidate).corner_mm for candidate in others.candidates]
    assert sent.corner_mm == corners[1]
    assert (told.sequence, told.corner_mm) == (sent.sequence, sent.corner_mm)
    assert (told.candidates_checked, told.first_refusal) == (
        1 + len(others.candidates), ErrorCode.NO_IK_SOLUTION
    )  # fmt: skip
    assert len(peers.goals.items) == 1


def test_it_says_once_a_second_how_it_is(domain):
    with cell(domain, boxes(3), answers=[]) as peers:
        told = Mailbox()
        peers.create_subscription(DiagnosticArray, '/diagnostics', told.put, 10)
        peers.send_all()
        peers.goals.wait(1)
        said = told.wait(len(told.items) + 2).status[0]
    values = {pair.key: pair.value for pair in said.values}
    assert said.name == 'planner'
    assert values['algorithm'] == 'mpack_lite'
    assert float(values['last_decision_ms']) > 0
    assert values['first_choices_possible'] == '100.0%'


def test_a_box_refused_everywhere_in_an_empty_bin_is_rejected_as_unreachable(domain):
    with cell(domain, boxes(1), script=[ErrorCode.NO_IK_SOLUTION] * TRIES_IN_EMPTY_BIN) as peers:
        peers.send_all()
        peers.announced.wait(TRIES_IN_EMPTY_BIN + 1)
        last = decision(peers.announced.items[TRIES_IN_EMPTY_BIN])
    assert last.reject_reason is Reason.UNREACHABLE and 'box-0' in last.reason
    assert peers.swapped.items == []


def test_nothing_fits_closes_the_fullest_bin(domain):
    engine = Engine(CELL)
    rng = random.Random(4)
    half = random_bin(engine, rng, 4, 'bin-1')
    full = replace(random_bin(engine, rng, 30, 'bin-2'), serial=2)
    assert full.fill_rate > half.fill_rate
    large = Box('large', (570.0, 370.0, 390.0), 5.0)
    with cell(domain, [large], (half, full)) as peers:
        peers.send_all()
        peers.goals.wait(1)
    assert peers.swapped.items == ['bin-2']
    assert peers.goals.items[0][1].bin_id == 'bin-3'


@pytest.mark.parametrize(
    ('bad', 'reason'),
    [
        (Box('bad', (700.0, 100.0, 100.0)), Reason.OVERSIZE),
        (Box('bad', (100.0, 100.0, 100.0), 25.0), Reason.OVERWEIGHT),
    ],
)
def test_a_box_that_can_go_nowhere_is_rejected_and_the_others_are_placed(domain, bad, reason):
    with cell(domain, [bad, *boxes(2)]) as peers:
        peers.send_all()
        peers.goals.wait(2)
        rejected = decision(peers.announced.wait(1))
    assert peers.announced.items[0][0].status == PlacementDecision.STATUS_REJECT
    assert (rejected.box.id, rejected.reject_reason, rejected.bin_id) == ('bad', reason, '')


def test_a_silent_arm_is_forgotten_and_gets_a_new_goal_when_it_is_back(domain):
    with cell(domain, boxes(3), script=[None]) as peers:
        peers.send_all()
        peers.goals.wait(1)
        peers.beating = False
        peers.announced.wait(1)
        # longer than the lease of the heartbeat: the planner must have noticed
        with pytest.raises(AssertionError):
            peers.goals.wait(2, timeout=2.5)
        peers.mode, peers.active, peers.beating = Mode.IDLE, '', True
        assert peers.goals.wait(2)[1].bin_id == 'bin-1', 'it asked for the bins by itself'


def test_a_box_with_a_size_that_is_not_a_number_costs_no_other_box(domain):
    def spoil(msg):
        msg.boxes[0].box.size.x = math.nan

    with cell(domain, boxes(3), remaining=50, look_ahead=3, parameters={'look_ahead': 3}) as peers:
        peers.send_bins()
        peers.send_scan(spoil)
        assert peers.goals.wait(1)[1].box.id in {'box-1', 'box-2'}


def test_a_failed_grasp_is_tried_again(domain):
    with cell(domain, boxes(1), script=[ErrorCode.GRASP_FAILED]) as peers:
        peers.send_all()
        assert peers.goals.wait(2)[1].box.id == 'box-0'


def test_profile_and_algorithm_change_between_two_boxes(domain):
    with private_context(domain) as context:
        peers = Peers(context, boxes(2, (151.0, 121.0, 101.0)), (EMPTY,))
        with spinning(peers, context):
            node = PlannerNode(context=context)
            refused = node.set_parameters([Parameter('algorithm', value='best_guess')])[0]
            assert not refused.successful and 'mpack_lite' in refused.reason
            assert node.set_parameters([Parameter('profile', value='paper')])[0].successful
            with spinning(node, context):
                peers.send_all()
                assert decision(peers.announced.wait(1)).profile == 'paper'
                node.stop()


@pytest.mark.parametrize('name', [signal.SIGINT, signal.SIGTERM])
def test_the_process_ends_with_code_0_on_a_signal(domain, name):
    command = [sys.executable, '-c', 'from pack_planner.ros.node import main; main()']
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    assert 'waiting for the belt' in process.stderr.readline()
    process.send_signal(name)
    assert process.wait(TIMEOUT_S) == 0


@pytest.mark.parametrize(
    ('override', 'said'),
    [
        ('weights:=1,-1,100', 'w2'),
        ('algorithm:=guess', 'mpack_lite'),
        ('look_behind:=3', 'look_behind'),
    ],
)
def test_bad_parameters_end_with_code_2_and_one_line(domain, override, said):
    command = [
        sys.executable, '-c', 'from pack_planner.ros.node import main; main()',
        '--ros-args', '-p', override,
    ]  # fmt: skip
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    ended = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    assert ended.returncode == 2
    assert said in ended.stderr and len(ended.stderr.splitlines()) == 1
