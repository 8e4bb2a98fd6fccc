"""What viewers see: transforms, joints, the robot's description, markers."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from executor_bench import TIMEOUT_S, ExecutorBench, ExecutorProcess
from executor_cases import make_box, make_decision
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import bin_frame
from arm_executor.model.robot_data import ROBOTS
from arm_executor.reach.layout_file import default_layout
from arm_executor.ros.markers import MarkerNumbers
from arm_executor.ros.node import ArmExecutor
from arm_executor.ros.robot_time import RobotTime
from arm_executor.ros.views import REST_PERIOD_S, coarse, velocities
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, rotation_matrix
from pack_msgs_py.ros import qos
from pack_msgs_py.values import parse_bin

pytestmark = [pytest.mark.ros, pytest.mark.physics]


@pytest.fixture
def start(spinners):
    """Start the executor with the physics arm; returns a bench that talks to it."""

    def run(**parameters):
        values = {'speed': 0.0, 'open_bins': 1, **parameters}
        node = ArmExecutor(
            context=spinners[0].context,
            parameter_overrides=[Parameter(key, value=value) for key, value in values.items()],
        )
        spinners[0].add(node, node.stop_motion)
        bench = ExecutorBench(spinners[1].context)
        spinners[1].add(bench.node, bench.client.destroy)
        bench.executor_node = node
        return bench.ready()

    return run


class Heard:
    """Messages of one topic, for a late listener."""

    def __init__(self, bench, kind, topic, profile):
        self.messages, self._news = [], threading.Condition()
        bench.node.create_subscription(kind, topic, self._hear, profile)

    def _hear(self, msg):
        with self._news:
            self.messages.append(msg)
            self._news.notify_all()

    def wait(self, condition=bool):
        with self._news:
            assert self._news.wait_for(lambda: condition(self.messages), TIMEOUT_S)
        return self.messages


def matrix(transform):
    turn, shift = transform.rotation, transform.translation
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrix((turn.x, turn.y, turn.z, turn.w))
    pose[:3, 3] = shift.x, shift.y, shift.z
    return pose


def follow(transforms, child):
    """Pose of frame ``child`` in `cell`."""
    parents = {transform.child_frame_id: transform for transform in transforms}
    pose = np.eye(4)
    while child != 'cell':
        pose = matrix(parents[child].transform) @ pose
        child = parents[child].header.frame_id
    return pose


@pytest.mark.parametrize('robot', ['ur20', 'ur10e'])
def test_transforms_lead_to_the_pad_and_to_the_bins(start, robot):
    bench = start(robot=robot, speed=2.0)  # at full speed all is over between two messages
    fixed = Heard(bench, TFMessage, '/tf_static', qos.STATE).wait()[0].transforms
    moving = Heard(bench, TFMessage, '/tf', QoSProfile(depth=100))
    states = Heard(bench, JointState, 'joint_states', QoSProfile(depth=100))
    box = make_box()
    bench.show(box, presented=box.id)
    _, result = bench.place(make_decision(box))
    assert result.error_code == ErrorCode.NONE, result.error_msg
    layout = default_layout(robot)
    kinematics = CellKinematics(ROBOTS[robot], layout)
    states.wait(lambda messages: len(messages) > 3)
    places = set()
    for state in states.messages:
        stamp = state.header.stamp
        together = [
            message for message in moving.messages if message.transforms[0].header.stamp == stamp
        ]
        if not together:
            continue
        pad = follow([*fixed, *together[0].transforms], 'tcp')
        assert np.abs(pad - kinematics.tool(list(state.position))[0]).max() < 2e-5
        places.add(tuple(np.round(pad[:3, 3], 3)))
    assert len(places) > 1, 'the arm was not seen moving'
    for station in 'ABC':
        expected = bin_frame(layout, station, parse_bin('LDC')).to_cell(Pose((0.1, 0.2, 0.3)))
        got = follow(fixed, f'bin_{station.lower()}') @ [0.1, 0.2, 0.3, 1.0]
        assert got[:3] == pytest.approx(expected.position, abs=5e-6)
    assert follow(fixed, 'belt')[:3, 3] == pytest.approx((0.0, 0.55, 0.75), abs=1e-6)
    assert len({transform.child_frame_id for transform in fixed}) == len(fixed)


def test_late_listener_gets_the_description_of_the_robot(start):
    pinocchio = pytest.importorskip('pinocchio')
    bench = start(robot='ur30')
    text = Heard(bench, String, 'robot_description', qos.STATE).wait()[0].data
    model = pinocchio.buildModelFromXML(text)
    assert 'ur30' in text
    assert model.nq == 7


def test_box_is_seen_on_the_belt_then_in_the_gripper_then_in_the_bin(start):
    bench = start(speed=3.0)
    shown = Heard(bench, MarkerArray, 'arm_executor/markers', qos.STATE)
    box = make_box()
    bench.show(box, presented=box.id)

    def boxes(name):
        return [
            marker
            for message in list(shown.messages)
            for marker in message.markers
            if marker.ns == name and marker.type == Marker.CUBE
        ]

    shown.wait(lambda _: boxes('belt'))
    _, result = bench.place(make_decision(box))
    assert result.error_code == ErrorCode.NONE, result.error_msg
    shown.wait(lambda _: boxes('boxes'))
    held, placed = boxes('gripper')[-1], boxes('boxes')[-1]
    assert held.header.frame_id == 'tcp'
    assert held.pose.position.z == pytest.approx(box.size_mm[2] / 2000, abs=1e-6)
    assert abs(held.pose.orientation.x) + abs(held.pose.orientation.y) == pytest.approx(
        1.0, abs=0.5
    )
    assert placed.header.frame_id == 'bin_a'
    where, measured = placed.pose.position, result.report.measured.position
    assert (where.x, where.y, where.z) == coarse((measured.x, measured.y, measured.z))
    assert [placed.scale.x, placed.scale.y, placed.scale.z] == pytest.approx(
        [edge / 1000 for edge in box.size_mm]
    )
    last = shown.messages[-1].markers
    assert {marker.ns for marker in last} >= {'cell', 'bins', 'boxes'}
    assert {marker.action for marker in last if marker.ns == 'gripper'} == {Marker.DELETE}
    assert not [marker for marker in last if marker.action == Marker.DELETEALL]
    assert len({(marker.ns, marker.id) for marker in last}) == len(last)


def test_nothing_is_drawn_for_nobody(start, monkeypatch):
    from arm_executor.ros import views

    drawn = []
    monkeypatch.setattr(views, 'markers', lambda *_: drawn.append(1))
    bench = start()
    box = make_box()
    bench.show(box, presented=box.id)
    assert bench.place(make_decision(box))[1].error_code == ErrorCode.NONE
    assert drawn == []


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'robot': 'ur5e', 'bin_type': 'PAL'}, 'ur5e (reach 0.85 m) reaches'),
        ({'layout': 'near.yaml'}, 'layout: rail and pedestal'),
    ],
)
def test_layout_that_cannot_work_ends_the_start_with_code_2_and_the_reason(
    ros_domain, tmp_path, values, message
):
    (tmp_path / 'near.yaml').write_text('stations: {near_y: 0.1}')
    if 'layout' in values:
        values = {'layout': str(tmp_path / values['layout'])}
    process = ExecutorProcess(tmp_path, **values)
    try:
        assert process.wait() == 2
    finally:
        process.close()
    assert '[FATAL]' in process.text()
    assert message in process.text()


@given(st.lists(st.sets(st.sampled_from('abcdefgh'), max_size=6), min_size=1, max_size=12))
def test_markers_keep_their_ids_and_each_message_ends_all_that_is_gone(contents):
    numbers, shown, before = MarkerNumbers(), {}, {}
    for keys in contents:
        given_ids = numbers.number('belt', keys)
        assert all(given_ids[key] == before[key] for key in before.keys() & keys)
        assert len(set(given_ids.values())) == len(keys)
        for _, number in numbers.free():
            shown.pop(number, None)
        shown.update({number: key for key, number in given_ids.items()})
        assert sorted(shown.values()) == sorted(keys), 'a viewer shows what is there, and no more'
        before = given_ids


def test_velocities_are_by_how_much_the_joints_have_moved_since():
    names = ('rail', 'elbow')
    before, now = (names, (0.0, 1.0)), (names, (0.1, 0.95))
    assert velocities(before, now, 0.05) == pytest.approx([2.0, -1.0])
    assert velocities(((), ()), now, 0.05) == [0.0, 0.0]
    assert velocities(before, now, 0.0) == [0.0, 0.0]


@given(st.lists(st.floats(-1e3, 1e3), max_size=8))
def test_what_is_told_of_positions_is_less_than_a_millionth_off_and_short(values):
    told = coarse(values)
    assert told == pytest.approx(values, abs=5e-7)
    assert all((value * 2**20).is_integer() for value in told)
    assert coarse(told) == told
    assert np.isnan(coarse((float('nan'),))).all(), 'what is not known stays so'


@pytest.mark.parametrize(
    ('paced', 'as_clock', 'told'), [(False, False, 8), (True, False, 4), (True, True, 8)]
)
def test_robot_time_is_told_half_as_often_where_it_passes_as_on_the_wall(paced, as_clock, told):
    class Speaker:
        def __init__(self):
            self.said = {}

        def create_publisher(self, kind, topic, depth):
            said = self.said[topic] = []
            return SimpleNamespace(publish=said.append)

    speaker, now_s = Speaker(), [0.0]
    robot_time = RobotTime(speaker, lambda: now_s[0], as_clock=as_clock, paced=paced)
    for tick in range(8):
        now_s[0] = 0.05 * tick
        assert robot_time.tell() == now_s[0]
    assert {len(said) for said in speaker.said.values()} == {told}
    for _ in range(100):
        robot_time.tell()
    still = {len(said) - told for said in speaker.said.values()}
    assert still <= {5, 6}, 'while it stands still it is told now and then'


def test_an_arm_at_rest_goes_on_to_say_where_it_is(start):
    bench = start()
    moving = Heard(bench, TFMessage, '/tf', QoSProfile(depth=100))
    states = Heard(bench, JointState, 'joint_states', QoSProfile(depth=100))
    states.wait(lambda messages: len(messages) >= 3)
    moving.wait(lambda messages: len(messages) >= 3)
    assert {tuple(message.velocity) for message in states.messages} == {(0.0,) * 7}
    assert REST_PERIOD_S <= 0.1, 'a look-up of now finds no transform'
