"""Boxes that rest sleep, and only those: what tips over or is hit goes on moving."""

from __future__ import annotations

import math

import pytest

pytest.importorskip('pybullet')

import pybullet

from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.model.layout import Block, Layout
from arm_executor.model.robot_data import find_robot
from pack_msgs_py.geometry.pose import Pose, turn_between
from pack_msgs_py.values import Box

pytestmark = pytest.mark.physics

#: A table of 40 x 40 cm, its top 1 m high, away from the arm.
X, Y, TOP = 3.0, 3.0, 1.0
SIZE_MM = (300.0, 200.0, 200.0)


@pytest.fixture
def world():
    world = PhysicsWorld(find_robot('ur20'), Layout())
    world.add_part('table', (Block('table', (X - 0.2, Y - 0.2, 0.5), (X + 0.2, Y + 0.2, TOP)),))
    yield world
    world.close()


def stand(world, name, aside=0.0, com=(0.0, 0.0, 0.0), above=0.0):
    """Put a box on the table, ``aside`` along x, ``above`` it."""
    world.add_box(Box(name, SIZE_MM, 5.0, com), Pose((X + aside, Y, TOP + 0.1 + above)))
    return name


def sleeps(world, box_id):
    """Whether the box takes no notice of gravity that pulls sideways."""
    world.step(3)
    was = world.pose(box_id)
    pybullet.setGravity(9.81, 0, -9.81, physicsClientId=world.client)
    world.step(24)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=world.client)
    return math.dist(was.position, world.pose(box_id).position) < 1e-6


def test_box_that_has_rested_for_half_a_second_sleeps_while_others_move(world):
    box_id = stand(world, 'still', above=0.0005)
    world.doze([box_id])
    world.step(round(0.3 / STEP_S))
    assert not sleeps(world, box_id)
    world.doze([box_id])
    world.step(round(1.2 / STEP_S))
    assert sleeps(world, box_id)


def test_boxes_that_settled_sleep(world):
    box_id = stand(world, 'settled', above=0.0005)
    assert world.settle([box_id], 3.0) < 1.0
    assert sleeps(world, box_id)


@pytest.mark.parametrize('over_mm', [1.0, 5.0])
def test_box_that_tips_over_the_edge_slowly_is_not_put_to_sleep(world, over_mm):
    # Its centre of mass is that far beyond the edge of the table.
    box_id = stand(world, 'tipping', aside=0.14, com=(60.0 + over_mm, 0.0, 0.0))
    was = world.pose(box_id)
    world.doze([box_id])
    world.step(round(2.0 / STEP_S))
    assert turn_between(was, world.pose(box_id)) > math.radians(20)


def test_box_that_sleeps_gives_way_to_one_that_hits_it(world):
    box_id = stand(world, 'asleep')
    world.settle([box_id], 3.0)
    was = world.pose(box_id)
    flying = stand(world, 'flying', aside=0.4, above=0.02)
    pybullet.resetBaseVelocity(
        world.boxes[flying].number, (-2.0, 0.0, 0.0), physicsClientId=world.client
    )
    world.step(round(0.5 / STEP_S))
    assert math.dist(was.position, world.pose(box_id).position) > 0.01


def test_what_waited_to_sleep_is_forgotten_when_a_box_is_removed(world):
    box_id = stand(world, 'first')
    world.doze([box_id])
    world.remove_box(box_id)
    again = stand(world, 'second', above=0.2)
    world.step(round(1.0 / STEP_S))
    assert world.pose(again).position[2] == pytest.approx(TOP + 0.1, abs=0.003)


def test_box_that_comes_down_beside_a_sleeping_one_does_not_wake_it(world):
    still = stand(world, 'still', aside=-0.1525)
    world.settle([still], 3.0)
    # 5 mm apart, as boxes on the grid of profile `cell` mostly are at least.
    stand(world, 'beside', aside=0.1525, above=0.1)
    world.step(round(0.1 / STEP_S))
    assert sleeps(world, still)
