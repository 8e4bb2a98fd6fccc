"""Kinematics in closed form, and the URDF made from the same parameters."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm_executor.model.kinematics import BRANCHES, CellKinematics, forward, inverse
from arm_executor.model.layout import Layout, Rail
from arm_executor.model.robot_data import ROBOTS, find_robot
from arm_executor.model.rotations import quaternions_of
from arm_executor.model.tree import (
    BARE_FRAMES,
    CELL_JOINT_NAMES,
    LINKS,
    cell_joints,
    described_joints,
)
from arm_executor.model.urdf import cell_urdf
from pack_msgs_py.geometry.pose import rotation_matrix

ANGLES = st.lists(st.floats(-3.1, 3.1), min_size=6, max_size=6)


def wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=60, deadline=None)
@given(angles=ANGLES)
def test_every_branch_leads_back_to_the_same_pose(name, angles):
    robot = ROBOTS[name]
    pose = forward(robot, angles)
    solutions = inverse(robot, pose[None])[0]
    possible = solutions[~np.isnan(solutions).any(axis=1)]
    if abs(math.sin(angles[4])) > 0.02 and abs(math.sin(angles[2])) > 0.02:
        away = np.abs(wrapped(possible - np.array(angles))).max(axis=1)
        assert away.min() < 1e-6, 'the configuration itself is not among the solutions'
        assert np.abs(forward(robot, possible) - pose).max() < 1e-8


@pytest.mark.parametrize('name', ['ur5e', 'ur10e', 'ur16e', 'ur20', 'ur30'])
def test_agrees_with_an_independent_implementation(name):
    oracle = getattr(pytest.importorskip('ur_analytic_ik'), name)
    rng = np.random.default_rng(7)
    for angles in rng.uniform(-math.pi, math.pi, (50, 6)):
        pose = forward(ROBOTS[name], angles)
        assert np.abs(pose - oracle.forward_kinematics(*angles)).max() < 1e-9
        ours = inverse(ROBOTS[name], pose[None])[0]
        ours = ours[~np.isnan(ours).any(axis=1)]
        for solution in oracle.inverse_kinematics(pose):
            away = np.abs(wrapped(ours - np.array(solution).ravel())).max(axis=1)
            assert away.min() < 1e-6


def test_all_eight_branches_exist_in_the_middle_of_the_workspace_and_differ():
    robot = find_robot('ur20')
    pose = CellKinematics(robot, Layout()).tool_down([0.0], [(0.0, 0.9, 0.8)], [0.3])[0]
    assert not np.isnan(pose).any()
    assert len({tuple(np.round(angles, 3)) for angles in pose}) == len(BRANCHES) == 8


def test_out_of_reach_is_nan_and_not_a_guess():
    far = CellKinematics(find_robot('ur5e'), Layout()).tool_down([0.0], [(0.0, 3.0, 0.8)], [0.0])
    assert np.isnan(far[..., 1:]).all()


def test_asking_for_one_branch_gives_the_same_as_asking_for_all():
    cell = CellKinematics(find_robot('ur20'), Layout())
    everything = cell.tool_down([0.2], [(0.5, 0.9, 0.8)], [0.3])[0]
    only = cell.tool_down([0.2], [(0.5, 0.9, 0.8)], [0.3], branches=(5,))[0]
    assert only[5] == pytest.approx(everything[5])
    assert np.isnan(only[0, 1:]).all()


@settings(max_examples=40, deadline=None)
@given(x=st.floats(-0.6, 0.6), y=st.floats(0.5, 1.0), z=st.floats(0.2, 1.1), yaw=st.floats(-3, 3))
def test_tool_down_puts_the_pad_there_facing_down(x, y, z, yaw):
    cell = CellKinematics(find_robot('ur20'), Layout())
    for q in cell.tool_down([0.1], [(x, y, z)], [yaw])[0]:
        if np.isnan(q).any():
            continue
        pad = cell.tool(q)[0]
        assert pad[:3, 3] == pytest.approx((x, y, z), abs=1e-9)
        assert pad[2, 2] == pytest.approx(-1.0)
        assert wrapped(math.atan2(pad[1, 0], pad[0, 0]) - yaw) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('name', ROBOTS)
def test_urdf_and_closed_form_agree(name):
    pinocchio = pytest.importorskip('pinocchio')
    robot, layout = ROBOTS[name], Layout(rail=Rail(base_height=1.1))
    model = pinocchio.buildModelFromXML(cell_urdf(robot, layout))
    assert tuple(model.names[1:]) == CELL_JOINT_NAMES
    data, cell = model.createData(), CellKinematics(robot, layout)
    rng = np.random.default_rng(3)
    for q in rng.uniform(-2, 2, (20, 7)):
        pinocchio.framesForwardKinematics(model, data, q)
        pad = data.oMf[model.getFrameId('tcp')].homogeneous
        assert np.abs(pad - cell.tool(q)[0]).max() < 1e-9


@pytest.mark.parametrize('name', ROBOTS)
def test_urdf_carries_the_published_limits_and_masses(name):
    pinocchio = pytest.importorskip('pinocchio')
    robot = ROBOTS[name]
    model = pinocchio.buildModelFromXML(cell_urdf(robot, Layout()))
    assert model.velocityLimit[1:] == pytest.approx(robot.max_speed, abs=1e-5)
    assert model.effortLimit[1:] == pytest.approx(robot.max_torque)
    arm_mass = sum(inertia.mass for inertia in list(model.inertias)[2:])
    assert arm_mass == pytest.approx(
        sum(link.mass for link in robot.links) + Layout().tool.mass, abs=0.01
    )


@pytest.mark.physics
@pytest.mark.parametrize('name', ROBOTS)
def test_urdf_in_physics_has_the_pad_where_the_closed_form_says_and_the_published_inertias(name):
    pybullet = pytest.importorskip('pybullet')
    from arm_executor.model import bullet

    robot, layout = find_robot(name), Layout()
    client = bullet.connect()
    try:
        body = bullet.load_robot(client, cell_urdf(robot, layout))
        links = {link: number for number, link in bullet.link_names(client, body).items()}
        rng = np.random.default_rng(5)
        for q in rng.uniform(-2, 2, (10, 7)):
            for joint, value in zip(bullet.joint_indices(client, body), q, strict=True):
                pybullet.resetJointState(body, joint, value, physicsClientId=client)
            state = pybullet.getLinkState(
                body, links['tcp'], computeForwardKinematics=1, physicsClientId=client
            )
            pad = CellKinematics(robot, layout).tool(q)[0]
            assert state[4] == pytest.approx(pad[:3, 3], abs=1e-6)
            turn = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
            assert np.abs(turn - pad[:3, :3]).max() < 1e-5
        for link, inertia in zip(LINKS[1:], robot.links, strict=True):
            mass, _, principal, *_ = pybullet.getDynamicsInfo(
                body, links[link], physicsClientId=client
            )
            assert mass == pytest.approx(inertia.mass, rel=1e-5)
            assert sorted(principal) == pytest.approx(
                np.linalg.eigvalsh(matrix(inertia)), rel=1e-3, abs=1e-6
            )
    finally:
        pybullet.disconnect(physicsClientId=client)


def matrix(inertia):
    ixx, ixy, ixz, iyy, iyz, izz = inertia.tensor
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


@pytest.mark.parametrize('name', ROBOTS)
def test_every_link_could_exist(name):
    """Positive masses; tensors positive definite; no principal moment above the sum of others."""
    for inertia in ROBOTS[name].links:
        least, middle, most = np.linalg.eigvalsh(matrix(inertia))
        assert inertia.mass > 0
        assert least > 0
        assert most <= least + middle


def frames(joints, q):
    """Pose (4, 4) of every frame in `cell`."""
    poses = {'cell': np.eye(4)}
    for joint in joints:
        step = np.eye(4)
        moved = joint.transform(q)
        step[:3, :3], step[:3, 3] = rotation_matrix(moved.quaternion), moved.position
        poses[joint.child] = poses[joint.parent] @ step
    return poses


@pytest.mark.parametrize('joints', [cell_joints, described_joints])
@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=30, deadline=None)
@given(rail=st.floats(-2.4, 2.4), angles=ANGLES)
def test_transforms_of_the_tree_lead_to_the_pad(joints, name, rail, angles):
    robot, layout = ROBOTS[name], Layout(rail=Rail(base_height=1.1))
    q = [rail, *angles]
    pose = frames(joints(robot, layout), q)['tcp']
    assert np.abs(pose - CellKinematics(robot, layout).tool(q)[0]).max() < 1e-9


def test_frames_lie_as_in_the_description_of_universal_robots():
    """UR20 of ur_description: default_kinematics.yaml and ur_macro.xacro, all joints at 0."""
    seen = frames(described_joints(ROBOTS['ur20'], Layout()), np.zeros(7))
    in_base = {name: np.linalg.inv(seen['base_link']) @ pose for name, pose in seen.items()}
    # base_link and base face away from each other; base_link_inertia lies as base does
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    assert in_base['base'] == pytest.approx(half_turn, abs=1e-9)
    assert in_base['base_link_inertia'] == pytest.approx(half_turn, abs=1e-9)
    reach = 0.8620 + 0.7287
    places = {
        'shoulder_link': (0.0, 0.0, 0.2363), 'upper_arm_link': (0.0, 0.0, 0.2363),
        'forearm_link': (0.8620, 0.0, 0.2363), 'wrist_1_link': (reach, 0.2010, 0.2363),
        'wrist_2_link': (reach, 0.2010, 0.2363 - 0.1593),
        'wrist_3_link': (reach, 0.2010 + 0.1543, 0.2363 - 0.1593),
    }  # fmt: skip
    for name, place in places.items():
        assert in_base[name][:3, 3] == pytest.approx(place, abs=1e-4), name
    # tool0 is wrist_3_link, with z out of the flange, whose own x points there (REP 199)
    assert seen['tool0'] == pytest.approx(seen['wrist_3_link'], abs=1e-9)
    assert seen['flange'][:3, 0] == pytest.approx(seen['tool0'][:3, 2], abs=1e-9)
    assert in_base['tool0'][:3, 2] == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


def test_the_description_has_every_frame_of_a_ur_and_physics_only_what_has_a_shape():
    described = cell_urdf(ROBOTS['ur20'], Layout(), described=True)
    for name in (*LINKS, *BARE_FRAMES):
        assert described.count(f'<link name="{name}"') == 1
    bare = cell_urdf(ROBOTS['ur20'], Layout())
    assert not any(f'<link name="{name}"' in bare for name in BARE_FRAMES)


def test_unknown_robot_lists_the_known_ones():
    with pytest.raises(ValueError, match=r"unknown robot 'ur7': use one of ur5e, .*ur30"):
        find_robot('ur7')


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda parts: math.hypot(*parts) > 0.1))
def test_quaternions_of_rotation_matrices_turn_as_they_do(parts):
    unit = tuple(part / math.hypot(*parts) for part in parts)
    matrix = np.array(rotation_matrix(unit))
    none, again = quaternions_of(np.array([np.eye(3), matrix]))
    assert np.array(rotation_matrix(again)) == pytest.approx(matrix, abs=1e-9)
    assert np.array(rotation_matrix(none)) == pytest.approx(np.eye(3), abs=1e-9)
