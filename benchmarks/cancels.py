#!/usr/bin/env python3
"""Motions that are cancelled at any moment, in physics: where is the box afterwards?

    ./cell python benchmarks/cancels.py --count 200

Sizes, weights up to what the pad and the robot carry, bins, places and the moment of the stop are
drawn at random; a box that cannot be carried or placed is drawn again. Every motion ends with the
box where it was on the belt, or in its bin; else it is lost, and its row says how.
"""

from __future__ import annotations

import argparse
import itertools
import random
import sys
import threading
from collections import Counter
from dataclasses import dataclass

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.model.arm_interface import MotionError, MotionHooks, MotionPlan, PlaceRequest
from arm_executor.model.layout import lifting_limit, pick_pose
from pack_msgs_py.codes import Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.values import Bin, Box, parse_bin

_BIN = parse_bin('LDC')
_STATIONS = ('A', 'B', 'C')
_HEAVY = (2.0, 5.0, 10.0, 15.0)
_FIRST = Box('first carton', (595.0, 395.0, 300.0), 14.5)


class StopAt(threading.Event):
    """Set once the world has run for so long, seconds of robot time."""

    def __init__(self, arm: PhysicsArm, after_s: float) -> None:
        super().__init__()
        self._arm, self._until = arm, arm.world.elapsed_s + after_s

    def is_set(self) -> bool:
        """Whether it is time."""
        return self._arm.world.elapsed_s >= self._until


@dataclass(frozen=True)
class Ended:
    """How a cancelled motion ended: in which phase it was, where the box is, and what was said."""

    weight_kg: float
    phase: Phase
    where: str
    text: str


def drawn(arm: PhysicsArm, rng: random.Random, number: int) -> tuple[PlaceRequest, MotionPlan]:
    """A placement that the arm can do; every fifth is of the same heavy carton."""
    most = lifting_limit(arm.layout)
    while True:
        box = _FIRST
        if number % 5:
            x, y, z = (float(rng.randrange(120, 600, 5)) for _ in range(3))
            box = Box(f'box {number}', (x, min(y, 400.0), min(z, 450.0)), rng.uniform(0.5, most))
        lies = rng.choice(('xyz', 'xyz', 'yxz', 'xzy', 'zyx'))
        dx, dy, dz = (edge / 1000 for edge in oriented_size(box.size_mm, lies))
        length, breadth, _ = (edge / 1000 for edge in _BIN.size_mm)
        if dx > length or dy > breadth:
            continue
        at = (rng.uniform(dx / 2, length - dx / 2), rng.uniform(dy / 2, breadth - dy / 2), dz / 2)
        request = PlaceRequest(
            box,
            pick_pose(arm.layout, box.size_mm),
            rng.choice(_STATIONS),
            Pose(at, QUATERNIONS[lies]),
        )
        try:
            return request, arm.plan(request)
        except MotionError:
            continue


def cancelled(arm: PhysicsArm, request: PlaceRequest, plan: MotionPlan, after_s: float) -> Ended:
    """Run ``plan``, stop it after ``after_s`` of robot time, and go back."""
    phases = [Phase.APPROACHING]
    hooks = MotionHooks(lambda phase, _: phases.append(phase), *[lambda: None] * 3)
    result = arm.execute(plan, hooks, StopAt(arm, after_s))
    where, text = 'in the bin', result.message
    if result.measured is None:
        where = 'on the belt' if result.on_belt else 'not picked'
        if arm.holds() is not None:
            try:
                where = 'back on the belt' if arm.return_to_belt() else 'lost'
            except MotionError as error:
                where, text = 'lost', f'{text}; {error}'
        elif Phase.TRANSFERRING in phases and not result.on_belt:
            where = 'lost'
    if not arm.withdraw():
        where, text = 'lost', f'{text}; the arm did not come back to where it waits'
    phase = next((phase for phase in reversed(phases) if phase is not Phase.SETTLING), phases[0])
    return Ended(request.box.weight_kg, phase, where, text)


def table(ended: list[Ended]) -> str:
    """Markdown: one row for each phase in which motions were stopped."""
    bands = [0.0, *_HEAVY, float('inf')]
    names = [
        f'{low:g} to {high:g} kg' if high < 1e9 else f'from {low:g} kg'
        for low, high in itertools.pairwise(bands)
    ]
    lines = [
        '| stopped while | ' + ' | '.join(names) + ' | back on the belt | in the bin | lost |',
        '|' + '---|' * (len(names) + 4),
    ]
    for phase in Phase:
        rows = [one for one in ended if one.phase is phase]
        if not rows:
            continue
        counts = [
            sum(low <= one.weight_kg < high for one in rows)
            for low, high in itertools.pairwise(bands)
        ]
        where = Counter(one.where for one in rows)
        cells = [
            *counts,
            where['back on the belt'] + where['on the belt'] + where['not picked'],
            where['in the bin'],
            where['lost'],
        ]
        lines.append(f'| {phase.name.lower()} | ' + ' | '.join(map(str, cells)) + ' |')
    return '\n'.join(lines)


def main() -> int:
    """Print the table; 1 when a box was lost."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else '')
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    arm = PhysicsArm()
    ended: list[Ended] = []
    for number in range(options.count):
        bins = [Bin(f'{at}-{number}', number + 1, _BIN, station=at) for at in _STATIONS]
        arm.set_bins(bins, {})
        request, plan = drawn(arm, rng, number)
        one = cancelled(arm, request, plan, rng.uniform(0.0, plan.predicted_s))
        ended.append(one)
        if one.where == 'lost':
            print(f'lost: {request} after {one.phase.name}: {one.text}', file=sys.stderr)
    arm.close()
    print(table(ended))
    return int(any(one.where == 'lost' for one in ended))


if __name__ == '__main__':
    sys.exit(main())
