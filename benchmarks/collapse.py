#!/usr/bin/env python3
"""Which support rule builds bins that stand: box by box in physics, and then shaken.

Run it in the environment of `./cell setup`; docs/benchmarks/stability.md shows its tables:

    python benchmarks/collapse.py --each 250 --jobs 2 --out runs/collapse.jsonl

Each bin is planned by one rule from what a scanner says (size, weight and centre of mass are a
little off) and filled in the physics world of the arm with the true boxes, each let go a little
beside its place, until nothing fits. As in the cell, the executor looks at each placement by what
was measured and may refuse it (`footing_errors`). Then the bin is secured and shaken as on a cart.

One line of `--out` is one bin. What is there already is not built again, so the command may be
stopped and started as often as you like; `--table` prints what there is.
"""

from __future__ import annotations

import argparse
import functools
import json
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, delayed
from physical_bin import MOVED_MM, SHAKE_G, Offset, PhysicalBin

from arm_executor.goals.placement_errors import footing_errors
from conveyor_sim.streams import load_boxes
from pack_msgs_py.geometry.resting import with_poses
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.engine import Engine
from pack_planner.engine.placements import all_spots

#: Errors of the scanner, one standard deviation of an edge in mm, share of the weight, and how far
#: the centre of mass lies off the middle at most, as a share of each edge.
SIGMA_MM, WEIGHT_ERROR, OFF_CENTRE = 2.0, 0.05, 0.05
#: Errors of placing, one standard deviation: millimetres along x and y, degrees about z.
PLACING_MM, PLACING_DEG = 1.5, 0.3
#: What boxes weigh when they stand anywhere, kilograms, evenly by their logarithm: support by
#: mechanics must hold whatever the weights are.
LIGHTEST_KG, HEAVIEST_KG = 1.0, 20.0

#: Boxes on offer, and how many are passed over before a bin counts as full.
LOOK_AHEAD, MOST_PASSED_OVER = 5, 60

#: Upright, as the other rules are; all six faces are a rule of their own here.
DENSE = replace(PROFILES['dense'], orientations='upright')
_LOOSE = replace(DENSE, min_support_share=0.0, stability_margin_mm=None)
RULES: dict[str, Profile] = {
    'three vertices': replace(_LOOSE, min_vertices=3),
    '75 % of the base': replace(_LOOSE, min_support_share=0.75),
    'hull of raw contact, 15 mm': replace(_LOOSE, com_margin_mm=15.0),
    'cell': PROFILES['cell'],
    'dense': DENSE,
    'dense, six faces': replace(DENSE, orientations='any'),
}
#: As in the cell, and wherever the rule allows with any weights.
WAYS = ('rollout', 'anywhere')


class Case(NamedTuple):
    """One bin to build."""

    rule: str
    way: str
    kind: str
    stream: str
    seed: int


@dataclass(frozen=True)
class Outcome:
    """What became of one bin.

    Attributes
    ----------
    boxes, fill : how many it holds, and the share of its volume that they take.
    moved : boxes that came to rest more than 5 mm off, or were moved so far by later ones.
    fell : boxes that fell while it was filled; it is filled no further, and not shaken.
    refused : placements that the executor would not have made, by what was measured.
    shaken_moved, shaken_fell : the same when it was shaken; ``None`` when it was not.
    slid_mm : the farthest that a box slid then.
    """

    boxes: int
    fill: float
    moved: int
    fell: int
    refused: int = 0
    shaken_moved: int | None = None
    shaken_fell: int | None = None
    slid_mm: float = 0.0


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


def drawn(case: Case, rng: random.Random) -> Iterator[tuple[Box, Box]]:
    """Boxes of the stream in any order, 400 of them, and what the scanner says of each."""
    listed, _ = load_boxes(case.stream)
    for number in range(400):
        box = replace(rng.choice(listed), id=f'{number}')
        if case.way == 'anywhere':
            weight = LIGHTEST_KG * (HEAVIEST_KG / LIGHTEST_KG) ** rng.random()
            box = replace(box, weight_kg=weight)
        yield scanned(box, rng)


@functools.lru_cache(maxsize=2)
def engine_of(rule: str) -> Engine:
    """The engine for a rule, made once."""
    return Engine(RULES[rule])


def plan(engine: Engine, way: str, target: Bin, on_offer: Sequence[Box]) -> PlacedBox | None:
    """The next placement: by rollout, or wherever the rule allows, by turns."""
    model = engine.model(target)
    if way == 'rollout':
        choice = find_algorithm('rollout')(Problem(engine, tuple(on_offer), (model,)))
        return choice.candidate.placed if choice else None
    rng = random.Random(f'{target.id} {len(target.boxes)}')
    for box in rng.sample(list(on_offer), len(on_offer)):
        spots = all_spots(engine, box, model, far_ends=True)
        if len(spots):
            return spots.placed(rng.randrange(len(spots)))
    return None


def build(case: Case, *, secured: bool = True, strength_g: float | None = SHAKE_G) -> Outcome:
    """Fill one bin, secure it unless told otherwise, shake it unless ``None``, and look."""
    rng = random.Random(f'{case.seed} {case.kind}')
    pairs = list(drawn(case, rng))
    true = {box.id: box for box, _ in pairs}
    engine, physical = engine_of(case.rule), PhysicalBin(case.kind)
    waiting = [
        seen
        for _, seen in pairs
        if not engine.overweight(seen) and engine.fits_empty_bin(seen, physical.spec)
    ]
    content = Bin(f'{case.kind} {case.seed}', 1, physical.spec)
    askew: set[str] = set()
    fell, passed_over, refused = 0, 0, 0
    while waiting and not fell and passed_over <= MOST_PASSED_OVER:
        placed = plan(engine, case.way, content, waiting[:LOOK_AHEAD])
        standing = with_poses(content.boxes, physical.poses())
        if placed and footing_errors(placed, standing, RULES[case.rule]):
            refused += 1
            waiting.remove(placed.box)
            continue
        if placed is None:
            # the smallest boxes come last, so that the bin gets as full as it can
            passed_over += 1
            waiting.remove(max(waiting[:LOOK_AHEAD], key=lambda box: box.volume_mm3))
            continue
        offset = Offset(
            rng.gauss(0, PLACING_MM), rng.gauss(0, PLACING_MM), rng.gauss(0, PLACING_DEG)
        )
        landed = physical.place(placed, true[placed.box.id], offset)
        since = physical.since_rest()
        askew |= {name for name, change in since.items() if change.moved}
        if landed.moved:
            askew.add(placed.box.id)
        fell = sum(change.fell for change in since.values()) + landed.fell
        waiting.remove(placed.box)
        content = replace(content, boxes=(*content.boxes, placed), revision=content.revision + 1)
    outcome = Outcome(len(content.boxes), content.fill_rate, len(askew), fell, refused)
    if not fell and strength_g is not None:
        if secured:
            physical.secure()
        shaken = physical.shake(strength_g).values()
        outcome = replace(
            outcome,
            shaken_moved=sum(change.moved for change in shaken),
            shaken_fell=sum(change.fell for change in shaken),
            slid_mm=max((change.slid_mm for change in shaken), default=0.0),
        )
    physical.close()
    return outcome


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """All bins that are asked for; after any number of them every rule has had about as many."""
    streams = given.streams.split(';')
    for seed in range(given.each):
        for kind in given.bins.split(','):
            for way in given.ways.split(','):
                for rule in given.rules.split(';'):
                    yield Case(rule, way, kind, streams[seed % len(streams)], seed)


def read(path: Path) -> dict[Case, Outcome]:
    """What was built before."""
    if not path.exists():
        return {}
    known = {}
    for line in path.read_text(encoding='utf-8').splitlines():
        row: dict[str, Any] = json.loads(line)
        known[Case(**row['case'])] = Outcome(**row['outcome'])
    return known


def print_tables(results: dict[Case, Outcome]) -> None:
    """By rule and way, and what shaking did by kind of bin."""
    print('| rule, way | bins | boxes | mean fill | bins that gave way | boxes moved | refused |')
    print('|---|---|---|---|---|---|---|')
    for rule in RULES:
        for way in WAYS:
            of = [one for case, one in results.items() if case[:2] == (rule, way)]
            if of:
                boxes = sum(one.boxes for one in of)
                fill = 100 * sum(one.fill for one in of) / len(of)
                moved = sum(one.moved for one in of)
                print(
                    f'| {rule}, {way} | {len(of)} | {boxes} | {fill:.1f} % '
                    f'| {sum(one.fell > 0 for one in of)} '
                    f'| {moved} ({100 * moved / boxes:.2f} %) | {sum(one.refused for one in of)} |'
                )
    shaken = {case: one for case, one in results.items() if one.shaken_fell is not None}
    kinds = list(dict.fromkeys(case.kind for case in shaken))
    print(f'\n| shaken: rule, way | {" | ".join(kinds)} | boxes fallen | over {MOVED_MM:g} mm |')
    print('|---' * (len(kinds) + 3) + '|')
    for rule in RULES:
        for way in WAYS:
            of = [(case.kind, one) for case, one in shaken.items() if case[:2] == (rule, way)]
            if not of:
                continue
            row = []
            for kind in kinds:
                fell = [bool(one.shaken_fell) for its, one in of if its == kind]
                row.append(f'{sum(fell)} of {len(fell)}')
            boxes = sum(one.boxes for _, one in of)
            row.append(f'{100 * sum(one.shaken_fell or 0 for _, one in of) / boxes:.2f} %')
            row.append(f'{100 * sum(one.shaken_moved or 0 for _, one in of) / boxes:.1f} %')
            print(f'| {rule}, {way} | {" | ".join(row)} |')


def main(arguments: Sequence[str] | None = None) -> int:
    """Build what is missing, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bins', default='LDC,RC,EQ,SYN,PAL')
    parser.add_argument('--each', type=int, default=25, help='bins of each kind, rule and way')
    parser.add_argument('--rules', default=';'.join(RULES))
    parser.add_argument('--ways', default=','.join(WAYS))
    parser.add_argument('--streams', default='cartons;syn', help='one bin each, by turns')
    parser.add_argument(
        '--loose', action='store_true', help='no gate and no film; give another --out'
    )
    parser.add_argument('--shake-every', type=int, default=1, help='shake only every so many')
    parser.add_argument(
        '--strength', type=float, default=SHAKE_G, help='acceleration, g; give another --out'
    )
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--out', type=Path, default=Path('collapse.jsonl'))
    parser.add_argument('--table', action='store_true', help='print the tables and build nothing')
    given = parser.parse_args(arguments)
    results = read(given.out)
    missing = [] if given.table else [case for case in cases(given) if case not in results]
    built = Parallel(n_jobs=given.jobs, return_as='generator')(
        delayed(build)(case, secured=not given.loose, strength_g=given.strength) for case in missing
    )
    given.out.parent.mkdir(parents=True, exist_ok=True)
    with given.out.open('a', encoding='utf-8') as file:
        for case, outcome in zip(missing, built, strict=True):
            row = {'case': case._asdict(), 'outcome': asdict(outcome)}
            print(json.dumps(row), file=file, flush=True)
            results[case] = outcome
    print_tables(results)
    return 0


if __name__ == '__main__':
    sys.exit(main())
