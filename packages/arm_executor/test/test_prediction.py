"""Predictions against what they predict: the planning world, and the planner in it."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from arm_executor.arms.known_bins import BinContent
from arm_executor.arms.prediction import PredictedCell
from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout, bin_blocks, bin_frame, conveyor_block, pick_pose
from arm_executor.model.robot_data import find_robot
from arm_executor.motion import planner
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.path import JointPath
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.task import Site, StandingBox
from arm_executor.motion.timing import MotionLimits
from pack_msgs_py.geometry.pose import Pose, extent, metres
from pack_msgs_py.values import Box, parse_bin

pytestmark = pytest.mark.physics

ARM, LAYOUT = find_robot('ur20'), Layout()
SIZE = (0.4, 0.3, 0.25)


def columns(spec, seed):
    """Boxes (size, pose in the bin frame) that stand in columns of different heights."""
    rng, boxes = random.Random(seed), {}
    length, breadth, height = metres(spec.size_mm)
    for column in range(int(length / 0.32)):
        for row in range(int(breadth / 0.34)):
            top = 0.0
            while rng.random() < 0.6 and top + 0.3 < height:
                size = (0.29, 0.31, rng.choice((0.15, 0.2, 0.3)))
                at = (0.16 + 0.32 * column, 0.17 + 0.34 * row, top + size[2] / 2)
                boxes[f'{column}-{row}-{len(boxes)}'] = (size, Pose(at))
                top += size[2] + 0.0005
    return boxes


def free_places(spec, boxes):
    """Centres of a box of 28 x 30 x 20 cm on top of each column."""
    tops = {}
    length, breadth, height = metres(spec.size_mm)
    for column in range(int(length / 0.32)):
        for row in range(int(breadth / 0.34)):
            tops[0.16 + 0.32 * column, 0.17 + 0.34 * row] = 0.0
    for size, pose in boxes.values():
        x, y, z = pose.position
        tops[x, y] = max(tops[x, y], z + size[2] / 2)
    return [Pose((x, y, top + 0.1)) for (x, y), top in tops.items() if top + 0.2 <= height]


class Planned:
    """The planner in its world, with the same bins as a :class:`PredictedCell` is given."""

    def __init__(self, spec, contents, limits=None):
        self.world, self.spec, self.contents = PlanningWorld(ARM, LAYOUT), spec, contents
        self.world.set_block(conveyor_block(LAYOUT))
        for station, boxes in contents.items():
            frame = bin_frame(LAYOUT, station, spec)
            for block in bin_blocks(LAYOUT, station, spec):
                self.world.set_block(block)
            for box_id, (size, pose) in boxes.items():
                self.world.set_box(f'placed box {box_id}', size, frame.to_cell(pose))
        self.motions = MotionPlanner(ARM, LAYOUT, limits or MotionLimits(), self.world, 1 / 60)

    def motion(self, request, start):
        frame = bin_frame(LAYOUT, request.station, self.spec)
        boxes = [
            StandingBox(box_id, *extent(frame.to_cell(pose), size))
            for box_id, (size, pose) in self.contents[request.station].items()
        ]
        return self.motions.plan(request, start, Site(request.station, self.spec, frame, boxes))


def seconds(motion, *arguments):
    try:
        return motion(*arguments).duration
    except MotionError:
        return np.nan


def test_the_quick_world_touches_what_the_planning_world_touches():
    spec = parse_bin('RC')
    boxes = columns(spec, 1)
    worlds = PlanningWorld(ARM, LAYOUT), QuickWorld(ARM, LAYOUT)
    frame = bin_frame(LAYOUT, 'A', spec)
    for world in worlds:
        world.set_block(conveyor_block(LAYOUT))
        for block in bin_blocks(LAYOUT, 'A', spec):
            world.set_block(block)
        for name, (size, pose) in boxes.items():
            world.set_box(name, size, frame.to_cell(pose))
        world.hold(SIZE, 'held')
    assert set(worlds[0].names()) == set(worlds[1].names())
    rng = np.random.default_rng(3)
    count = 400
    points = rng.uniform((-1.7, 0.5, 0.4), (0.4, 1.6, 2.0), (count, 3))
    rails, yaws = points[:, 0] + rng.uniform(-1, 1, count), rng.uniform(-3, 3, count)
    ways = CellKinematics(ARM, LAYOUT).tool_down(rails, points, yaws)
    said = []
    for number in range(count):
        known = [q for q in ways[number] if not np.isnan(q).any()]
        for q in known[:2]:
            path = JointPath(q[None], points[number][None], yaws[number : number + 1])
            turn = None if number % 3 == 0 else 0.4
            said.append([world.first_hit(path, turn) is None for world in worlds])
    agreed = [first == other for first, other in said]
    assert 0.1 < np.mean(said) < 0.9 and len(said) > 300
    assert np.mean(agreed) > 0.985


@pytest.mark.parametrize('name', ['LDC', 'RC', 'PAL'])
def test_verdict_and_seconds_are_mostly_those_of_the_planner(name, monkeypatch):
    # However slow the machine is, and with it the one of the two that counts its seconds.
    monkeypatch.setattr(planner, '_BUDGET_S', math.inf)
    spec = parse_bin(name)
    contents = {station: columns(spec, seed) for seed, station in enumerate('AB', 2)}
    cell, planned = PredictedCell(LAYOUT), Planned(spec, contents)
    bins = {station: BinContent(spec, boxes) for station, boxes in contents.items()}
    box = Box('new', (280.0, 300.0, 200.0), 4.0)
    pick = pick_pose(LAYOUT, box.size_mm)
    rows = []
    for station, boxes in contents.items():
        for target in free_places(spec, boxes)[:7]:
            request = PlaceRequest(box, pick, station, target)
            rows.append((
                seconds(planned.motion, request, cell.home),
                seconds(cell.motion, request, cell.home, bins),
            ))  # fmt: skip
    known, predicted = np.array(rows).T
    assert np.mean(np.isnan(known) == np.isnan(predicted)) > 0.8
    error = np.abs(predicted / known - 1)
    assert np.nanmedian(error) < 0.03 and np.nanquantile(error, 0.75) < 0.1


def test_a_bin_that_has_gone_and_a_box_that_has_moved_are_forgotten():
    spec = parse_bin('LDC')
    cell, box = PredictedCell(LAYOUT), Box('new', (280.0, 300.0, 200.0), 4.0)
    place = Pose((0.6, 0.4, 0.1))
    request = PlaceRequest(box, pick_pose(LAYOUT, box.size_mm), 'A', place)
    taken = {'A': BinContent(spec, {'other': (SIZE, Pose((0.6, 0.4, 0.125)))})}
    with pytest.raises(MotionError, match='other'):
        cell.motion(request, cell.home, taken)
    aside = {'A': BinContent(spec, {'other': (SIZE, Pose((0.2, 0.4, 0.125)))})}
    free = cell.motion(request, cell.home, aside).duration
    both = {**aside, 'B': BinContent(spec)}
    assert cell.motion(replace(request, station='B'), cell.home, both).duration > 3.0
    assert cell.motion(request, cell.home, aside).duration == free


def test_an_arm_that_stands_still_reaches_its_places_without_a_rail():
    fixed = replace(LAYOUT, rail=replace(LAYOUT.rail, x_min=-0.2, x_max=-0.2))
    box, bins = Box('new', (280.0, 300.0, 200.0), 4.0), {'A': BinContent(parse_bin('EQ'))}
    pick = pick_pose(fixed, box.size_mm)
    for cell in (PredictedCell(fixed), PredictedCell(fixed, MotionLimits(joint_jerk=500.0))):
        motion = cell.motion(PlaceRequest(box, pick, 'A', Pose((0.5, 0.4, 0.1))), cell.home, bins)
        for leg in (motion.approach, motion.carry, motion.retreat):
            assert np.abs(leg.q[:, 0] + 0.2).max() < 1e-9


def test_a_limit_to_jerk_is_predicted_too():
    spec, limits = parse_bin('LDC'), MotionLimits(joint_jerk=200.0)
    cell, planned = PredictedCell(LAYOUT, limits), Planned(spec, {'A': {}}, limits)
    box, bins = Box('new', (280.0, 300.0, 200.0), 4.0), {'A': BinContent(spec)}
    pick = pick_pose(LAYOUT, box.size_mm)
    for target in free_places(spec, {})[:6]:
        request = PlaceRequest(box, pick, 'A', target)
        known = planned.motion(request, cell.home).duration
        assert cell.motion(request, cell.home, bins).duration == pytest.approx(known, rel=0.05)


def test_the_physics_arm_predicts_what_it_plans(arm):
    box = Box('new', (280.0, 300.0, 200.0), 4.0)
    request = PlaceRequest(box, pick_pose(arm.layout, box.size_mm), 'B', Pose((0.3, 0.3, 0.1)))
    assert arm.predict(request) == pytest.approx(arm.plan(request).predicted_s, rel=0.05)
    with pytest.raises(MotionError):
        arm.predict(replace(request, target=Pose((0.3, 0.3, 3.0))))
