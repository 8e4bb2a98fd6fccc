#!/usr/bin/env python3
"""What a rule would refuse that asks every stack to stand free when it is pushed sideways.

Run it in the environment of `./cell setup`; docs/benchmarks/stability.md shows the table it prints:

    python benchmarks/free_standing.py --each 4

A push of so many g moves the force that a box passes down by that share of its height. So a box
stands free, without walls and neighbours, when its centre of mass is by half its height times the
push inside its bearing polygon, and what it carries must lie inside that polygon less its height
times the push. Bins are planned by `dense`, and their boxes are counted that fail this.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections.abc import Sequence
from dataclasses import replace

from collapse import LOOK_AHEAD, Case, drawn, engine_of, plan

from pack_msgs_py.geometry.footprint import true_size
from pack_msgs_py.geometry.polygon import (
    Polygon,
    area,
    beyond,
    clipped,
    convex_hull,
    distance_inside,
)
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import centre_of_mass
from pack_msgs_py.statics import DECIMALS, LEAST_AREA_MM2, supporters, sure_footprint
from pack_msgs_py.values import Bin, PlacedBox, parse_bin

PUSHES_G = (0.02, 0.05, 0.1, 0.2, 0.3)
MOST_PASSED_OVER = 20


def inset(polygon: Polygon, distance: float) -> Polygon:
    """The part of a convex polygon that lies at least so far inside all its edges."""
    kept = list(polygon)
    for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        length = math.dist((x0, y0), (x1, y1))
        nx, ny = (y0 - y1) / length, (x1 - x0) / length
        kept = beyond(kept, (nx, ny), nx * x0 + ny * y0 + distance)
    return kept


def not_free(boxes: Sequence[PlacedBox], profile: Profile, push_g: float) -> int:
    """How many of ``boxes``, in the order they were placed, do not stand free."""
    loadable: dict[str, Polygon] = {}
    count = 0
    for placed in boxes:
        base, hull = sure_footprint(placed, profile.bearing_inset_mm), []
        if base and placed.corner_mm[2] == 0:
            x0, y0, x1, y1 = base
            hull = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        elif base:
            parts = [
                clipped(loadable[other.box.id], base)
                for other in supporters(placed, boxes, profile.support_tolerance_mm)
            ]
            hull = convex_hull(
                (round(x, DECIMALS), round(y, DECIMALS))
                for part in parts
                if area(part) >= LEAST_AREA_MM2
                for x, y in part
            )
        height = true_size(placed)[2]
        if len(hull) < 3:
            hull = []
        stands = hull and distance_inside(hull, centre_of_mass(placed)) >= push_g * height / 2
        count += not stands
        loadable[placed.box.id] = inset(hull, push_g * height) if hull else []
    return count


def filled(kind: str, stream: str, seed: int) -> Bin:
    """A bin filled by plan, as `collapse.py` does."""
    case, rng = Case('dense', 'rollout', kind, stream, seed), random.Random(f'{seed} {kind}')
    engine = engine_of(case.rule)
    waiting = [seen for _, seen in drawn(case, rng) if not engine.overweight(seen)]
    content = Bin(f'{kind} {seed}', 1, parse_bin(kind))
    passed_over = 0
    while waiting and passed_over <= MOST_PASSED_OVER:
        placed = plan(engine, case.way, content, waiting[:LOOK_AHEAD])
        if placed is None:
            passed_over += 1
            waiting.remove(max(waiting[:LOOK_AHEAD], key=lambda box: box.volume_mm3))
            continue
        waiting.remove(placed.box)
        content = replace(content, boxes=(*content.boxes, placed), revision=content.revision + 1)
    return content


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', default='LDC,EQ,RC')
    parser.add_argument('--each', type=int, default=4)
    parser.add_argument('--boxes', default='cartons')
    given = parser.parse_args(arguments)
    print(f'| bin | boxes | {" | ".join(f"{push:g} g" for push in PUSHES_G)} |')
    print('|---' * (2 + len(PUSHES_G)) + '|')
    for kind in given.bins.split(','):
        bins = [filled(kind, given.boxes, seed).boxes for seed in range(given.each)]
        boxes, profile = sum(map(len, bins)), engine_of('dense').profile
        row = [
            f'{100 * sum(not_free(one, profile, push) for one in bins) / boxes:.0f} %'
            for push in PUSHES_G
        ]
        print(f'| {kind} | {boxes} | {" | ".join(row)} |', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
