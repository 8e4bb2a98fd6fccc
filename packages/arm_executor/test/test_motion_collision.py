"""The planning world says the same as an independent collision library, shape by shape."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('pinocchio')
pytest.importorskip('coal')
pytest.importorskip('pybullet')

import coal
import pinocchio

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout, bin_blocks, conveyor_block
from arm_executor.model.robot_data import find_robot
from arm_executor.model.urdf import cell_urdf
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.obstacle_world import ARM_MARGIN, BOX_SKIN, WIDE_MARGIN
from arm_executor.motion.path import JointPath
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import parse_bin

pytestmark = pytest.mark.physics

ARM, LAYOUT = find_robot('ur20'), Layout()
#: Distances this near to what counts as touching are left to either library, metres.
DOUBT = 0.002
BOX = (0.4, 0.3, 0.25)
AWAY = np.array([9.0, 0.0, 0.0])


class CoalDistances:
    """Least distances by `coal`, on the shapes of the URDF that it reads itself."""

    def __init__(self, blocks):
        urdf = cell_urdf(ARM, LAYOUT)
        self.model = pinocchio.buildModelFromXML(urdf)
        kind = pinocchio.GeometryType.COLLISION
        self.shapes = pinocchio.buildGeomFromUrdfString(self.model, urdf, kind)
        self.data, self.placed = self.model.createData(), self.shapes.createData()
        self.blocks = [
            (coal.Box(*block.size), coal.Transform3s(np.eye(3), np.array(block.centre)))
            for block in blocks
        ]

    def arm(self, q):
        """Least distance of links to blocks, less what each must keep."""
        pinocchio.updateGeometryPlacements(self.model, self.data, self.shapes, self.placed, q)
        least = np.inf
        for index, shape in enumerate(self.shapes.geometryObjects):
            if shape.name.startswith('carriage'):
                continue
            pose = self.placed.oMg[index]
            where = coal.Transform3s(pose.rotation, pose.translation)
            margin = 0.0 if shape.name.startswith('tool') else ARM_MARGIN
            for block in self.blocks:
                least = min(least, distance(shape.geometry, where, *block) - margin)
        return least

    def box(self, size, centre, turn):
        """Least distance of a box to blocks."""
        pose = coal.Transform3s(turn, centre)
        return min(distance(coal.Box(*size), pose, *block) for block in self.blocks)


def distance(one, pose, other, other_pose):
    return coal.distance(
        one, pose, other, other_pose, coal.DistanceRequest(), coal.DistanceResult()
    )


@pytest.fixture(scope='module')
def worlds():
    spec = parse_bin('LDC')
    blocks = [conveyor_block(LAYOUT), *bin_blocks(LAYOUT, 'A', spec)]
    world = PlanningWorld(ARM, LAYOUT)
    for block in blocks:
        world.set_block(block)
    yield world, CoalDistances(blocks)
    world.close()


def path_at(q, tcp=None, yaw=0.0):
    tcp = CellKinematics(ARM, LAYOUT).tool(q)[0, :3, 3] if tcp is None else tcp
    return JointPath(q[None], np.array([tcp]), np.array([yaw]))


def test_arm_against_walls_and_belt(worlds):
    world, oracle = worlds
    rng = np.random.default_rng(11)
    kinematics = CellKinematics(ARM, LAYOUT)
    hits = frees = 0
    for _ in range(160):
        # Over, in and beside the bin and the belt, the mast about upright.
        tcp, rail = rng.uniform((-1.7, 0.5, 0.2), (0.3, 1.4, 1.3)), rng.uniform(-1.2, 0.0)
        q = kinematics.tool_down([rail], [tcp], [0.0])[0, rng.integers(8)]
        if np.isnan(q).any():
            continue
        q[1:] += rng.uniform(-0.15, 0.15, 6)
        hit = world.first_hit(path_at(q))
        away = oracle.arm(q)
        touches = hit is not None and hit.split(' and ')[1].startswith(('bin', 'conveyor'))
        if away < -ARM_MARGIN:
            # It may also touch itself, and say that first. Of what is nearer than the margin, and
            # does not touch, physics misses one in nine hundred, by what it looked at before.
            assert hit is not None, f'{q} is {-1000 * away:.1f} mm too near, and free'
            hits += 1
        elif away > DOUBT + 0.001:
            assert not touches, f'{q} is {1000 * away:.1f} mm clear, and {hit}'
            frees += 1
    assert hits > 20
    assert frees > 20


@pytest.mark.parametrize('wide', [False, True])
def test_carried_box_against_walls_and_belt(worlds, wide):
    world, oracle = worlds
    kinematics = CellKinematics(ARM, LAYOUT)
    rng = np.random.default_rng(5)
    grown = 2 * WIDE_MARGIN if wide else 0.0
    size = (BOX[0] + grown, BOX[1] + grown, BOX[2] + (grown if wide else -2 * BOX_SKIN))
    world.hold(BOX, 'held')
    hits = frees = 0
    try:
        for _ in range(300):
            tcp = rng.uniform((-1.6, 0.6, 0.5), (0.2, 1.2, 1.3))
            yaw = rng.uniform(-3, 3)
            q = kinematics.tool_down([-0.6], [tcp], [yaw])[0, 2]
            if np.isnan(q).any():
                continue
            path = path_at(q, tcp, yaw)
            if wide:
                # On the way between places far from everything.
                ends = [tcp + AWAY, tcp, tcp - AWAY]
                path = JointPath(np.array([q] * 3), np.array(ends), np.array([yaw] * 3))
            hit = world.first_hit(path, 0.0)
            cosine, sine = np.cos(yaw), np.sin(yaw)
            turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
            away = oracle.box(size, tcp - (0, 0, BOX[2] / 2), turn)
            if away < -DOUBT:
                assert hit is not None, f'box at {tcp} is {-1000 * away:.1f} mm deep, and free'
                hits += 1
            elif away > DOUBT + 0.001:
                assert hit is None or not hit.startswith('held'), f'{1000 * away:.1f} mm, {hit}'
                frees += 1
    finally:
        world.drop()
    assert hits > 30
    assert frees > 30


def test_obstacles_are_known_with_their_extents(worlds):
    world, _ = worlds
    half_turn = np.sqrt(0.5)
    world.set_box(
        'turned', (0.4, 0.2, 0.1), Pose((1.0, 1.0, 0.5), (0.0, 0.0, half_turn, half_turn))
    )
    try:
        spans = world.obstacles()
        names = list(world.names())
        at = names.index('turned')
        assert spans.low[at] == pytest.approx((0.9, 0.8, 0.45))
        assert spans.high[at] == pytest.approx((1.1, 1.2, 0.55))
        without = world.obstacles(without=('turned',))
        assert len(without.low) == len(names) - 1
    finally:
        world.remove('turned')


def test_an_obstacle_is_seen_whatever_its_body_number_was_used_for_before():
    # PyBullet gives out the numbers of removed bodies again, with the rules made about them.
    world, kinematics = PlanningWorld(ARM, LAYOUT), CellKinematics(ARM, LAYOUT)
    rng = np.random.default_rng(3)
    places = np.arange(-1.8, 1.9, 0.6)
    standing: set[float] = set()
    try:
        for _ in range(12):
            for x in rng.choice(places, 2, replace=False):
                name = f'obstacle at {x:.1f}'
                if x in standing:
                    world.remove(name)
                else:
                    world.set_box(name, (0.1, 0.1, 0.1), Pose((x, 0.9, 1.0)))
                standing ^= {x}
            world.hold(BOX, 'held')
            for x in places:
                above, inside = np.array([x, 0.9, 1.2]), np.array([x, 0.9, 1.0])
                q, deep = (kinematics.tool_down([x], [p], [0.0])[0, 2] for p in (above, inside))
                ends = np.array([above + AWAY, above, above - AWAY])
                across = JointPath(np.array([q] * 3), ends, np.zeros(3))
                for path, turn in ((path_at(q), 0.0), (across, 0.0), (path_at(deep), None)):
                    assert (world.first_hit(path, turn) is not None) == (x in standing)
            world.drop()
    finally:
        world.close()
