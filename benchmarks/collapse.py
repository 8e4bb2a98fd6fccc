#!/usr/bin/env python3
"""Which support rule builds bins that stand: box by box in physics, and then shaken.

Run it in the environment of `./cell setup`; docs/benchmarks/stability.md shows the table it prints:

    python benchmarks/collapse.py --bins LDC,RC,EQ,PAL --each 25

Each bin is planned by one rule from what a scanner says (size, weight and centre of mass are a
little off) and filled in the physics world of the arm with the true boxes, each let go a little
beside its place, until nothing fits. Then it is shaken as on a cart. Plans know nothing of what
physics did: a rule has to be right in advance.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import pybullet
from joblib import Parallel, delayed

from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.model.layout import bin_blocks, bin_frame
from arm_executor.model.robot_data import find_robot
from arm_executor.reach.layout_file import find_layout
from conveyor_sim.streams import load_boxes
from pack_msgs_py.geometry.footprint import true_size
from pack_msgs_py.geometry.pose import Pose, about_z, turn_between
from pack_msgs_py.orientation import oriented_size
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.engine import Engine
from pack_planner.engine.placements import all_spots

#: Errors of the scanner, one standard deviation of an edge in mm, share of the weight, and how far
#: the centre of mass lies off the middle at most, as a share of each edge.
SIGMA_MM, WEIGHT_ERROR, OFF_CENTRE = 2.0, 0.05, 0.05
#: Errors of placing, one standard deviation: millimetres along x and y, degrees about z.
PLACING_MM, PLACING_DEG = 1.5, 0.3
#: A box is let go so far above where it comes to rest, metres.
DROP_M = 0.003
#: Shaking: greatest acceleration against standard gravity, to and fro so often a second, for so
#: many seconds along x and then along y.
SHAKE_G, SHAKE_HZ, SHAKE_S = 0.3, 2.0, 1.0
#: What counts as moved, and what as collapsed: millimetres and degrees.
MOVED_MM, FALLEN_MM, FALLEN_DEG = 5.0, 30.0, 10.0

#: Boxes on offer, and how many are passed over before a bin counts as full.
LOOK_AHEAD, MOST_PASSED_OVER = 5, 60

DENSE = PROFILES['dense']
_LOOSE = replace(DENSE, min_support_share=0.0, stability_margin_mm=None)
RULES: dict[str, Profile] = {
    'three vertices': replace(_LOOSE, min_vertices=3),
    '75 % of the base': replace(_LOOSE, min_support_share=0.75),
    'hull of raw contact, 15 mm': replace(_LOOSE, com_margin_mm=15.0),
    'cell': PROFILES['cell'],
    'dense': DENSE,
}


@dataclass(frozen=True)
class Outcome:
    """What became of one bin: boxes in it, fill, and what gave way while it was filled and shaken.

    ``moved`` are boxes that were moved more than 5 mm by what was placed later.
    """

    boxes: int
    fill: float
    moved: int
    collapsed: bool
    shaken_moved: int
    shaken_collapsed: bool


def scanned(box: Box, rng: random.Random) -> tuple[Box, Box]:
    """The true box, with a centre of mass nobody knows, and what the scanner says of it."""
    offset = tuple(edge * rng.uniform(-OFF_CENTRE, OFF_CENTRE) for edge in box.size_mm)
    true = replace(box, com_offset_mm=offset)
    size = tuple(max(20.0, edge + rng.gauss(0, SIGMA_MM)) for edge in box.size_mm)
    seen = replace(
        box,
        size_mm=size,
        weight_kg=box.weight_kg * (1 + rng.uniform(-WEIGHT_ERROR, WEIGHT_ERROR)),
        size_stddev_mm=(SIGMA_MM,) * 3,
    )
    return true, seen


def plan(engine: Engine, rule: str, target: Bin, on_offer: Sequence[Box]) -> PlacedBox | None:
    """The next placement: by rollout, or wherever the rule allows, by turns."""
    model = engine.model(target)
    if rule == 'rollout':
        choice = find_algorithm('rollout')(Problem(engine, tuple(on_offer), (model,)))
        return choice.candidate.placed if choice else None
    rng = random.Random(f'{target.id} {len(target.boxes)}')
    for box in rng.sample(list(on_offer), len(on_offer)):
        spots = all_spots(engine, box, model, far_ends=True)
        if len(spots):
            return spots.placed(rng.randrange(len(spots)))
    return None


class PhysicalBin:
    """One bin in the physics world, and where each box came to rest."""

    def __init__(self, kind: str) -> None:
        self.spec = parse_bin(kind)
        layout = find_layout('', 'ur20')
        self.world = PhysicsWorld(find_robot('ur20'), layout)
        self.world.add_part('bin', bin_blocks(layout, 'A', self.spec))
        self.frame = bin_frame(layout, 'A', self.spec)
        self.rested: dict[str, Pose] = {}

    def place(self, placed: PlacedBox, true: Box, rng: random.Random) -> None:
        """Let the true box go a little beside its place, and wait until all is at rest."""
        (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
        length, breadth, height = oriented_size(true.size_mm, placed.orientation)
        centre = (
            (x + dx / 2 + rng.gauss(0, PLACING_MM)) / 1000,
            (y + dy / 2 + rng.gauss(0, PLACING_MM)) / 1000,
        )
        base = max([0.0, *self._tops_under(centre, (length / 1000, breadth / 1000))], default=0.0)
        body = replace(
            true,
            size_mm=(length, breadth, height),
            com_offset_mm=tuple(
                true.com_offset_mm['xyz'.index(axis)] for axis in placed.orientation
            ),
        )
        turn = about_z(math.radians(rng.gauss(0, PLACING_DEG)))
        pose = Pose((*centre, base + height / 2000 + DROP_M), turn)
        self.world.add_box(body, self.frame.to_cell(pose))
        self.world.settle(self.world.boxes, 3.0)

    def _tops_under(
        self, centre: tuple[float, float], size: tuple[float, float]
    ) -> Iterator[float]:
        for name, body in self.world.boxes.items():
            at = self.frame.from_cell(self.world.pose(name)).position
            if all(abs(at[i] - centre[i]) < (body.size[i] + size[i]) / 2 for i in (0, 1)):
                yield at[2] + body.size[2] / 2

    def shake(self) -> None:
        """Push everything to and fro along x and y, and wait until it is at rest again."""
        client = self.world.client
        for body in self.world.boxes.values():
            pybullet.changeDynamics(
                body.number, -1, activationState=pybullet.ACTIVATION_STATE_WAKE_UP,
                physicsClientId=client,
            )  # fmt: skip
        for axis in (0, 1):
            for step in range(round(SHAKE_S / STEP_S)):
                push = [0.0, 0.0, -9.81]
                phase = 2 * math.pi * SHAKE_HZ * step * STEP_S
                push[axis] = SHAKE_G * 9.81 * math.sin(phase)
                pybullet.setGravity(*push, physicsClientId=client)
                self.world.step()
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        self.world.settle(self.world.boxes, 3.0)

    def poses(self) -> dict[str, Pose]:
        """Where every box is."""
        return {name: self.world.pose(name) for name in self.world.boxes}


def changes(before: dict[str, Pose], after: dict[str, Pose]) -> tuple[int, bool]:
    """How many boxes moved, and whether one fell."""
    moved, fell = 0, False
    for name, old in before.items():
        new = after[name]
        distance = 1000 * math.dist(old.position, new.position)
        moved += distance > MOVED_MM
        fell |= distance > FALLEN_MM or math.degrees(turn_between(old, new)) > FALLEN_DEG
    return moved, fell


def build(rule: str, way: str, kind: str, seed: int, boxes: str) -> Outcome:
    """Fill one bin of ``kind`` by ``rule``, shake it, and look."""
    rng = random.Random(f'{seed} {kind}')
    listed, _ = load_boxes(boxes)
    pairs = [scanned(replace(rng.choice(listed), id=f'{number}'), rng) for number in range(400)]
    true = {box.id: box for box, _ in pairs}
    waiting = [
        seen
        for _, seen in pairs
        if RULES[rule].max_payload_kg is None or seen.weight_kg <= RULES[rule].max_payload_kg
    ]
    engine = Engine(RULES[rule])
    physical = PhysicalBin(kind)
    content = Bin(f'{seed}', 1, physical.spec)
    moved: set[str] = set()
    fell, passed_over = False, 0
    while waiting:
        placed = plan(engine, way, content, waiting[:LOOK_AHEAD])
        if placed is None:
            # the smallest boxes come last, so that the bin gets as full as it can
            passed_over += 1
            if passed_over > MOST_PASSED_OVER:
                break
            waiting.remove(max(waiting[:LOOK_AHEAD], key=lambda box: box.volume_mm3))
            continue
        before = physical.poses()
        physical.place(placed, true[placed.box.id], rng)
        after = physical.poses()
        moved |= {
            n
            for n, old in before.items()
            if 1000 * math.dist(old.position, after[n].position) > MOVED_MM
        }
        fell |= changes(before, after)[1] or _off(placed, physical)
        waiting.remove(placed.box)
        content = replace(content, boxes=(*content.boxes, placed), revision=content.revision + 1)
        if fell:
            break
    filled = physical.poses()
    physical.shake()
    shaken, shaken_fell = changes(filled, physical.poses())
    physical.world.close()
    return Outcome(len(content.boxes), content.fill_rate, len(moved), fell, shaken, shaken_fell)


def _off(placed: PlacedBox, physical: PhysicalBin) -> bool:
    """Whether the box that was just placed fell over or off."""
    pose = physical.frame.from_cell(physical.world.pose(placed.box.id))
    height = true_size(placed)[2]
    wanted = (placed.corner_mm[2] + height / 2) / 1000
    tilt = math.degrees(turn_between(pose, Pose(pose.position)))
    return abs(pose.position[2] - wanted) > FALLEN_MM / 1000 or tilt > FALLEN_DEG


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', default='LDC,RC,EQ,PAL')
    parser.add_argument('--each', type=int, default=25, help='bins of each kind, rule and way')
    parser.add_argument('--rules', default=';'.join(RULES))
    parser.add_argument('--boxes', default='cartons')
    parser.add_argument('--jobs', type=int, default=2)
    given = parser.parse_args(arguments)
    print('| rule | bins | boxes | fill | collapsed | boxes moved | shaken: collapsed | moved |')
    print('|---|---|---|---|---|---|---|---|')
    for rule in given.rules.split(';'):
        for way in ('rollout', 'anywhere'):
            results = Parallel(n_jobs=given.jobs)(
                delayed(build)(rule, way, kind, seed, given.boxes)
                for kind in given.bins.split(',')
                for seed in range(given.each)
            )
            boxes = sum(one.boxes for one in results)
            fill = 100 * sum(one.fill for one in results) / len(results)
            print(
                f'| {rule}, {way} | {len(results)} | {boxes} | {fill:.1f} % '
                f'| {sum(one.collapsed for one in results)} '
                f'| {sum(one.moved for one in results)} '
                f'| {sum(one.shaken_collapsed for one in results)} '
                f'| {sum(one.shaken_moved for one in results)} |',
                flush=True,
            )
    return 0


if __name__ == '__main__':
    sys.exit(main())
