"""The robot as its driver describes it, against the model; and what a driver says only once."""

from __future__ import annotations

import math
import re

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('control_msgs')
pytest.importorskip('ur_msgs')
pytest.importorskip('ur_dashboard_msgs')

from fake_robot import FakeRobot, described
from rclpy.node import Node

from arm_executor.arms.trajectory.description import judged, model_error
from arm_executor.arms.trajectory.parameters import TrajectoryParameters
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.robot_data import JOINT_NAMES, ROBOTS, find_robot
from arm_executor.ros import robot_link
from arm_executor.ros.robot_link import RosRobotLink
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros

UR20 = find_robot('ur20')


def calibrated(name, along_mm=0.0, roll_deg=0.0):
    """The UR20 with one joint moved along its x, and tilted about it."""
    urdf = described()
    joint = re.search(rf'<joint name="{name}".*?</joint>', urdf, re.DOTALL).group()
    xyz = [float(word) for word in re.search(r'xyz="([^"]*)"', joint).group(1).split()]
    found = re.search(r'rpy="([^"]*)"', joint)
    rpy = [float(word) for word in found.group(1).split()] if found else [0.0, 0.0, 0.0]
    xyz[0] += along_mm / 1000
    rpy[0] += math.radians(roll_deg)
    numbers = [' '.join(map(repr, values)) for values in (xyz, rpy)]
    moved = re.sub(r'<origin[^>]*>', '<origin xyz="{}" rpy="{}"/>'.format(*numbers), joint, count=1)
    assert moved != joint
    return urdf.replace(joint, moved)


@pytest.mark.parametrize('name', ROBOTS)
def test_every_model_is_what_it_is_described_as(name):
    error = model_error(described(name), find_robot(name))
    assert error.shift_m < 1e-6 and error.turn_rad < 1e-6
    for other in set(ROBOTS) - {name}:
        assert model_error(described(name), find_robot(other)).shift_m > 0.005


def test_a_calibration_is_told_in_millimetres_and_degrees():
    error = model_error(calibrated('elbow_joint', along_mm=4.0), UR20)
    assert error.shift_m == pytest.approx(0.004, abs=1e-6) and error.turn_rad < 1e-6
    error = model_error(calibrated('wrist_3_joint', roll_deg=0.5), UR20)
    assert math.degrees(error.turn_rad) == pytest.approx(0.5, abs=0.001)
    text, well = judged(calibrated('elbow_joint', along_mm=4.0), UR20, '', 0.03)
    assert '4.0 mm and 0.00 degrees' in text and '--clearance' in text and not well
    assert judged(described(), UR20, '', 0.03)[1]


def test_another_robot_is_refused_with_the_numbers():
    with pytest.raises(
        MotionError, match=r'30 mm are allowed: is the robot of the layout \(ur20\)'
    ):
        judged(described('ur10e'), UR20, '', 0.03)


@pytest.mark.parametrize(
    ('urdf', 'text'),
    [
        ('joints: 6', 'no URDF'),
        ('<robot/>', 'no way from link base_link to link tool0'),
        (described().replace('"elbow_joint"', '"knee_joint"'), 'no joint elbow_joint'),
    ],
)
def test_what_is_no_description_of_it_is_said_and_does_no_harm(urdf, text):
    said, well = judged(urdf, UR20, '', 0.03)
    assert text in said and not well


def test_the_names_of_a_second_robot_have_its_prefix():
    urdf = described()
    for name in (*JOINT_NAMES, 'base_link', 'tool0'):
        urdf = urdf.replace(f'"{name}"', f'"left_{name}"')
    assert model_error(urdf, UR20, 'left_').shift_m < 1e-6


def test_what_a_driver_says_only_once_is_heard_though_it_was_lost(domain, monkeypatch):
    monkeypatch.setattr(robot_link, '_AGAIN_S', 0.5)
    with Spinner(domain=domain) as spinner:
        robot = FakeRobot([0.0] * 6, context=spinner.context)
        servers = [controller.server for controller in robot.controllers]
        spinner.add(robot, lambda: [server.destroy() for server in servers])
        node = Node('executor', context=spinner.context)
        link = RosRobotLink(node, TrajectoryParameters(connect_timeout_s=20.0), 0.0, 1.0, UR20)
        for kept in link._hearing:
            if kept.topic_name.rsplit('/', 1)[-1] != 'joint_states':
                node.destroy_subscription(kept)
        spinner.add(node, link.close)
        link.connect()
        assert link.trouble() == ''
