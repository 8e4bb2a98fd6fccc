"""One bin in the physics world of the arm: filled box by box, shaken as on a cart, judged.

What `collapse.py` and `tipping.py` share. Bin frame, millimetres and degrees unless said otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import pybullet

from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.model.layout import Block, bin_blocks, bin_frame
from arm_executor.model.robot_data import find_robot
from arm_executor.reach.layout_file import find_layout
from pack_msgs_py.geometry.pose import NO_TURN, Pose, about_z, extent, rotated
from pack_msgs_py.orientation import oriented_size
from pack_msgs_py.values import Box, PlacedBox, Vec3, Walls, parse_bin

#: A box is let go so far above where it comes to rest.
DROP_MM = 3.0
#: Tops that carry a box lie at most so far above where they were planned.
UNEVEN_MM = 15.0
#: A box has moved when its centre lies farther than this from where it first came to rest.
MOVED_MM = 5.0
#: A box has fallen when it leans more than this, or has sunk by more than this: whoever stands
#: before the bin sees it. One that only slid until it met its neighbour has not.
FALLEN_DEG, FALLEN_MM = 10.0, 20.0

#: Shaking: along x and then along y the cart starts and stops, each with this acceleration against
#: standard gravity for half of this time, reached within the rise. EUMOS 40509 asks for a rise of
#: 0.05 s at most and 0.3 s of constant acceleration at least.
SHAKE_G, SHAKE_S, RISE_S = 0.3, 1.0, 0.05
GRAVITY = 9.81
#: Solver iterations: those of the arm's world are 300. With fewer a bin that moves as a whole is
#: shaken three times as fast. Heavy boxes on light ones creep and rock in 300, not in 2,000: so
#: what seems to give way is looked at again.
_ITERATIONS, _SHAKE_ITERATIONS, _SECOND_LOOK = 300, 100, 2000
#: What is drawn around a load lies so close to it.
_SLEEVE_MM = 3.0
_WALL_MM = 20.0


@dataclass(frozen=True)
class Change:
    """What became of one box: how far it slid, how much it sank, how far it leans."""

    slid_mm: float
    sank_mm: float
    leans_deg: float

    @property
    def moved(self) -> bool:
        """Whether it is not where it was."""
        return math.hypot(self.slid_mm, self.sank_mm) > MOVED_MM

    @property
    def fell(self) -> bool:
        """Whether it fell from its stack, over, or visibly leans."""
        return self.leans_deg > FALLEN_DEG or self.sank_mm > FALLEN_MM


def change(before: Pose, after: Pose) -> Change:
    """What happened between two poses (metres)."""
    x, y, z = (1000 * (b - a) for a, b in zip(before.position, after.position, strict=True))
    up, still_up = (rotated(pose.quaternion, (0.0, 0.0, 1.0)) for pose in (before, after))
    cosine = sum(a * b for a, b in zip(up, still_up, strict=True))
    return Change(math.hypot(x, y), -z, math.degrees(math.acos(max(-1.0, min(1.0, cosine)))))


def changes(before: Mapping[str, Pose], after: Mapping[str, Pose]) -> dict[str, Change]:
    """What happened to each box of ``before``."""
    return {name: change(pose, after[name]) for name, pose in before.items()}


@dataclass(frozen=True)
class Offset:
    """How far from its place a box is let go: along x and y, millimetres, and about z, degrees."""

    x_mm: float = 0.0
    y_mm: float = 0.0
    turn_deg: float = 0.0


class PhysicalBin:
    """One bin in the physics world, and where each box first came to rest."""

    def __init__(self, kind: str) -> None:
        self.spec = parse_bin(kind)
        self._layout = find_layout('', 'ur20')
        self.world = PhysicsWorld(find_robot('ur20'), self._layout)
        self.frame = bin_frame(self._layout, 'A', self.spec)
        self.world.add_part('bin', bin_blocks(self._layout, 'A', self.spec))
        self.rested: dict[str, Pose] = {}

    def place(self, placed: PlacedBox, true: Box, offset: Offset) -> Change:
        """Let the true box go beside its place, and wait until all is at rest."""
        (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
        size = oriented_size(true.size_mm, placed.orientation)
        centre = (x + dx / 2 + offset.x_mm, y + dy / 2 + offset.y_mm)
        # A top far above the plan belongs to a neighbour that the box only just touches.
        highest = placed.corner_mm[2] + UNEVEN_MM
        base = max([0.0, *(top for top in self._tops_under(centre, size) if top < highest)])
        # The body lies along the axes of the bin, and so does what is off its middle.
        com = oriented_size(true.com_offset_mm, placed.orientation)
        turn = about_z(math.radians(offset.turn_deg))
        let_go = Pose(
            (centre[0] / 1000, centre[1] / 1000, (base + size[2] / 2 + DROP_MM) / 1000), turn
        )
        body = replace(true, size_mm=size, com_offset_mm=com)
        start = {**self.poses(), true.id: let_go}
        self.world.add_box(body, self.frame.to_cell(let_go))
        self.world.settle(self.world.boxes, 3.0)
        if any(one.moved for one in changes(start, self.poses()).values()):
            self._look_again(start)
        self.rested[true.id] = self.pose(true.id)
        x_m, y_m, z_m = let_go.position
        return change(Pose((x_m, y_m, z_m - DROP_MM / 1000), turn), self.rested[true.id])

    def _look_again(self, start: Mapping[str, Pose]) -> None:
        for name, pose in start.items():
            self.world.move_box(name, self.frame.to_cell(pose))
        self._solve_in(_SECOND_LOOK)
        self._wake()
        self.world.settle(self.world.boxes, 3.0)
        self._solve_in(_ITERATIONS)

    def _solve_in(self, iterations: int) -> None:
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=iterations, physicsClientId=self.world.client
        )

    def _tops_under(self, centre: tuple[float, float], size: Vec3) -> Iterator[float]:
        for name, body in self.world.boxes.items():
            at = self.pose(name).position
            if all(
                abs(1000 * at[i] - centre[i]) < (1000 * body.size[i] + size[i]) / 2 for i in (0, 1)
            ):
                yield 1000 * (at[2] + body.size[2] / 2)

    def pose(self, name: str) -> Pose:
        """Where the middle of a box is, bin frame, metres."""
        return self.frame.from_cell(self.world.pose(name))

    def poses(self) -> dict[str, Pose]:
        """Where every box is."""
        return {name: self.pose(name) for name in self.world.boxes}

    def since_rest(self) -> dict[str, Change]:
        """What happened to each box since it first came to rest."""
        return changes(self.rested, self.poses())

    def secure(self) -> None:
        """What a bin gets before it is moved: a gate before a cage, film around a pallet.

        The film is a stiff sleeve around the outermost boxes; real film gives way a little.
        """
        if self.spec.walls is Walls.OPEN_FRONT:
            length, breadth, height = map(float, self.spec.size_mm)
            low = (-_WALL_MM, breadth, 0.0)
            self._add_wall('gate', low, (length + _WALL_MM, breadth + _WALL_MM, height))
        if self.spec.walls is Walls.NONE and self.world.boxes:
            spans = [extent(self.pose(name), body.size) for name, body in self.world.boxes.items()]
            x0, y0 = (1000 * min(low[i] for low, _ in spans) - _SLEEVE_MM for i in (0, 1))
            x1, y1 = (1000 * max(high[i] for _, high in spans) + _SLEEVE_MM for i in (0, 1))
            top = 1000 * max(high[2] for _, high in spans)
            for low, high in (
                ((x0 - _WALL_MM, y0, 0.0), (x0, y1, top)),
                ((x1, y0, 0.0), (x1 + _WALL_MM, y1, top)),
                ((x0 - _WALL_MM, y0 - _WALL_MM, 0.0), (x1 + _WALL_MM, y0, top)),
                ((x0 - _WALL_MM, y1, 0.0), (x1 + _WALL_MM, y1 + _WALL_MM, top)),
            ):
                self._add_wall('film', low, high)

    def _add_wall(self, name: str, low_mm: Vec3, high_mm: Vec3) -> None:
        ends = [
            self.frame.to_cell(Pose((x / 1000, y / 1000, z / 1000), NO_TURN)).position
            for x, y, z in (low_mm, high_mm)
        ]
        low, high = (tuple(side(pair) for pair in zip(*ends, strict=True)) for side in (min, max))
        self.world.add_part(name, (Block(name, low, high),))

    def shake(self, strength_g: float = SHAKE_G) -> dict[str, Change]:
        """A start and a stop along x, the same along y; what happened to each box once at rest."""
        before, client = self.poses(), self.world.client
        self._solve_in(_SHAKE_ITERATIONS)
        self._wake()
        for axis in (0, 1):
            for step in range(round(SHAKE_S / STEP_S)):
                push = [0.0, 0.0, -GRAVITY]
                push[axis] = strength_g * GRAVITY * _level(step * STEP_S)
                pybullet.setGravity(*push, physicsClientId=client)
                self.world.step()
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=client)
        self.world.settle(self.world.boxes, 2.0)
        self._solve_in(_ITERATIONS)
        return changes(before, self.poses())

    def _wake(self) -> None:
        for body in self.world.boxes.values():
            pybullet.changeDynamics(
                body.number, -1, activationState=pybullet.ACTIVATION_STATE_WAKE_UP,
                physicsClientId=self.world.client,
            )  # fmt: skip

    def clear(self) -> None:
        """Take all boxes out."""
        for name in list(self.world.boxes):
            self.world.remove_box(name)
        self.rested.clear()

    def close(self) -> None:
        """End the world."""
        self.world.close()


def _level(time_s: float) -> float:
    """Acceleration of the cart at a time, -1 to 1: up within the rise, held, down, and back."""
    half = SHAKE_S / 2
    sign, within = (1.0, time_s) if time_s < half else (-1.0, time_s - half)
    return sign * max(0.0, min(1.0, within / RISE_S, (half - within) / RISE_S))
