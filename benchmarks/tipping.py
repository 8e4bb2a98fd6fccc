#!/usr/bin/env python3
"""Searches for small stacks that the rules allow and that fall in physics.

Run it in the environment of `./cell setup`; docs/benchmarks/stability.md shows what it found:

    python benchmarks/tipping.py --profile dense --seconds 600

Three to eight boxes of extreme sizes stand on each other in the middle of nothing. Each is allowed
by `violations()` and by the executor's footing, which knows where those below were measured; what
nobody knows is at its worst within the limits: edges two standard deviations off, the centre of
mass, the place and the turn. Random stacks first, then the worst are changed a little at a time
and kept when they get worse: how far a box leans, slides and sinks in physics, and how near the
true centre of mass of any box is to the edge of what truly carries it.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from physical_bin import Change, Offset, PhysicalBin

from arm_executor.goals.placement_errors import footing_errors
from pack_msgs_py.geometry.polygon import Rect, overlap
from pack_msgs_py.geometry.resting import with_poses
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.statics import Bearing, supporters
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.engine import Engine
from pack_planner.engine.placements import Spots, all_spots

#: What the stacks stand on: nothing around them holds them up.
GROUND = '60x60x200:pallet'
FEWEST, MOST = 3, 8
EDGES_MM = (60.0, 600.0)
WEIGHTS_KG = (1.0, 20.0)
#: Limits of what nobody knows: edges (two standard deviations), the centre of mass along each edge
#: as a share of it and at most in millimetres, the place and the turn about the vertical.
SIGMA_MM = 2.0
OFF_CENTRE, MOST_OFF_MM = 0.05, 10.0
PLACING_MM, PLACING_DEG = 3.0, 0.6
#: Tops this far below the highest one under a box carry nothing of it, metres.
LEVEL_M = 0.001
#: Stacks that are changed further at any time.
KEPT = 20


@dataclass(frozen=True)
class Piece:
    """One box of a stack: as scanned, where it goes, and what nobody knows of it, -1 to 1.

    ``where`` is the share of the spots, ordered from the lowest base to the highest.
    """

    size_mm: tuple[float, float, float]
    weight_kg: float
    where: float
    edges: tuple[float, float, float]
    centre: tuple[float, float, float]
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Trial:
    """A stack as it was built, and the worst that happened to a box of it.

    ``margin_mm`` is how far the true centre of mass lies inside what truly carries the box.
    """

    pieces: tuple[Piece, ...]
    built: int
    leans_deg: float
    moved_mm: float
    margin_mm: float
    fell: bool

    @property
    def badness(self) -> float:
        """What the search makes grow: degrees, and a tenth of the millimetres."""
        return self.leans_deg + (self.moved_mm - self.margin_mm) / 10


def _extreme(rng: random.Random) -> float:
    """A number from -1 to 1, every second time one of the two."""
    return rng.choice((-1.0, 1.0)) if rng.random() < 0.5 else rng.uniform(-1, 1)


def _triple(rng: random.Random) -> tuple[float, float, float]:
    return (_extreme(rng), _extreme(rng), _extreme(rng))


def _log_uniform(low: float, high: float, rng: random.Random) -> float:
    return low * float((high / low) ** rng.random())


def random_piece(rng: random.Random) -> Piece:
    """A box of any size and weight anywhere."""
    size = (
        round(_log_uniform(*EDGES_MM, rng)),
        round(_log_uniform(*EDGES_MM, rng)),
        round(_log_uniform(*EDGES_MM, rng)),
    )
    where = 1 - rng.random() ** 2
    weight = _log_uniform(*WEIGHTS_KG, rng)
    return Piece(size, weight, where, _triple(rng), _triple(rng), _triple(rng))


def changed(pieces: tuple[Piece, ...], rng: random.Random) -> tuple[Piece, ...]:
    """The stack with one thing about one box changed, one box more, or one less."""
    what = rng.random()
    if what < 0.1 and len(pieces) < MOST:
        return (*pieces, random_piece(rng))
    which = rng.randrange(len(pieces))
    if what < 0.2 and len(pieces) > FEWEST:
        return pieces[:which] + pieces[which + 1 :]
    old, other = pieces[which], random_piece(rng)
    name = rng.choice(('size_mm', 'weight_kg', 'where', 'edges', 'centre', 'place'))
    new = replace(old, **{name: getattr(other, name)})
    if name == 'size_mm' and rng.random() < 0.5:
        x, y, z = (
            round(min(EDGES_MM[1], max(EDGES_MM[0], edge * rng.uniform(0.8, 1.25))))
            for edge in old.size_mm
        )
        new = replace(old, size_mm=(x, y, z))
    return (*pieces[:which], new, *pieces[which + 1 :])


def boxes_of(piece: Piece, name: str, most_off_mm: float) -> tuple[Box, Box]:
    """What the scanner says of the box, and what it is."""
    seen = Box(name, piece.size_mm, piece.weight_kg, size_stddev_mm=(SIGMA_MM,) * 3)
    size = [edge + 2 * SIGMA_MM * off for edge, off in zip(piece.size_mm, piece.edges, strict=True)]
    offset = [
        off * min(OFF_CENTRE * edge, most_off_mm)
        for edge, off in zip(size, piece.centre, strict=True)
    ]
    true = replace(
        seen, size_mm=(size[0], size[1], size[2]), com_offset_mm=(offset[0], offset[1], offset[2])
    )
    return seen, true


def chosen(spots: Spots, where: float) -> PlacedBox:
    """The spot at a share of all, the lowest base first, along x and y within a height."""
    rows = sorted(range(len(spots)), key=lambda row: (spots.corners[row][2], row))
    return spots.placed(rows[min(len(rows) - 1, math.floor(where * len(rows)))])


class Ground:
    """Where stacks are tried, by one profile, with centres of mass so far off their middle."""

    def __init__(self, profile: Profile, most_off_mm: float) -> None:
        self.profile, self._most_off_mm = profile, most_off_mm
        self._engine = Engine(profile)
        self._physical = PhysicalBin(GROUND)
        self._count = 0

    def trial(self, pieces: tuple[Piece, ...]) -> Trial:
        """Build the stack box by box; what the rules refuse is left out."""
        self._physical.clear()
        self._count += 1
        content = Bin(f'{self._count}', 1, self._physical.spec)
        worst: list[Change] = []
        margin_mm = 1000.0
        for number, piece in enumerate(pieces):
            seen, true = boxes_of(piece, f'{number}', self._most_off_mm)
            spots = all_spots(self._engine, seen, self._engine.model(content), far_ends=True)
            if not len(spots):
                continue
            placed = chosen(spots, piece.where)
            standing = with_poses(content.boxes, self._physical.poses())
            if footing_errors(placed, standing, self.profile):
                continue
            x, y, turn = piece.place
            offset = Offset(x * PLACING_MM, y * PLACING_MM, turn * PLACING_DEG)
            worst.append(self._physical.place(placed, true, offset))
            content = replace(
                content, boxes=(*content.boxes, placed), revision=content.revision + 1
            )
            worst += self._physical.since_rest().values()
            margin_mm = min(margin_mm, self._margin_mm(placed, content.boxes))
            if any(change.fell for change in worst):
                break
        return Trial(
            pieces,
            len(content.boxes),
            max((one.leans_deg for one in worst), default=0.0),
            max((math.hypot(one.slid_mm, one.sank_mm) for one in worst), default=0.0),
            margin_mm,
            any(one.fell for one in worst),
        )

    def _margin_mm(self, placed: PlacedBox, boxes: Sequence[PlacedBox]) -> float:
        """How far the true centre of mass of ``placed`` lies inside what truly carries it."""
        if placed.corner_mm[2] == 0:
            return 1000.0
        bodies, tolerance = self._physical.world.boxes, self.profile.support_tolerance_mm

        def covers(box: PlacedBox) -> Rect:
            pose, size = self._physical.pose(box.box.id), bodies[box.box.id].size
            (x0, y0), (x1, y1) = (
                [1000 * (pose.position[i] + side * size[i] / 2) for i in (0, 1)] for side in (-1, 1)
            )
            return (x0, y0, x1, y1)

        def carry(upper: PlacedBox, others: Sequence[PlacedBox]) -> list[PlacedBox]:
            below = supporters(upper, others, tolerance)
            tops = {
                other.box.id: self._physical.pose(other.box.id).position[2]
                + bodies[other.box.id].size[2] / 2
                for other in below
                if overlap(covers(upper), covers(other))
            }
            highest = max(tops.values(), default=0.0)
            return [one for one in below if tops.get(one.box.id, 0.0) > highest - LEVEL_M]

        x0, y0, x1, y1 = covers(placed)
        off = bodies[placed.box.id].com_offset
        centre = ((x0 + x1) / 2 + 1000 * off[0], (y0 + y1) / 2 + 1000 * off[1])
        inside = Bearing(boxes, tolerance, covers, carry).stability_mm(placed, centre)
        return max(-100.0, inside)


def main(arguments: Sequence[str] | None = None) -> int:
    """Search, and say what was worst."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--profile', default='dense', choices=sorted(PROFILES))
    parser.add_argument('--orientations', default='', help='another rule than that of the profile')
    parser.add_argument('--most-off', type=float, default=MOST_OFF_MM, help='centre of mass, mm')
    parser.add_argument('--seconds', type=float, default=60.0, help='of this process')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--out', type=Path, help='where the stacks that fell are written, JSON')
    given = parser.parse_args(arguments)
    profile = PROFILES[given.profile]
    if given.orientations:
        profile = replace(profile, orientations=given.orientations)
    ground, rng = Ground(profile, given.most_off), random.Random(given.seed)
    kept: list[Trial] = []
    fallen: list[Trial] = []
    tried = boxes = leaning = moved = 0
    until = time.process_time() + given.seconds
    while time.process_time() < until:
        if len(kept) < KEPT or rng.random() < 0.3:
            pieces = tuple(random_piece(rng) for _ in range(rng.randint(FEWEST, MOST)))
        else:
            pieces = changed(rng.choice(kept).pieces, rng)
        trial = ground.trial(pieces)
        tried, boxes = tried + 1, boxes + trial.built
        leaning += trial.leans_deg > 1.0
        moved += trial.moved_mm > 5.0
        if trial.fell:
            fallen.append(trial)
        kept = sorted((*kept, trial), key=lambda one: -one.badness)[:KEPT]
    worst = kept[0]
    least_mm = min(one.margin_mm for one in kept)
    print(
        f'| {profile.name}, {profile.orientations} | {given.most_off:g} mm | {tried} | {boxes} '
        f'| {len(fallen)} | {leaning} | {moved} | {worst.leans_deg:.1f} | {worst.moved_mm:.1f} '
        f'| {least_mm:.1f} |'
    )
    if given.out:
        text = json.dumps([asdict(one) for one in fallen or kept[:3]], indent=1)
        given.out.write_text(text + '\n', encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
