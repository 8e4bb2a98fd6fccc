#!/usr/bin/env python3
"""How the time of an MPackLite decision grows with look-ahead, boxes in the bin, and resolution.

Run it in the environment of `./cell setup`:

    python benchmarks/growth.py --figure docs/images/growth.svg

Times are computing time of the deciding thread, the least of three decisions on the same state, so
that what else the machine does counts little. An exponent is the slope of log time over log size.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean

from conveyor_sim.streams import load_boxes
from pack_cell.bench.streams import cut_collection
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, BinSpec, Box, parse_bin
from pack_planner.algorithms import Problem
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.engine import Engine

PROFILE = replace(PROFILES['paper'], orientations='any')
LOOK_AHEAD = 5
LOOK_AHEADS = (1, 2, 3, 4, 5, 6)
RESOLUTIONS_MM = (1, 2, 5, 10)

#: A bin for far more boxes than any real one holds.
LARGE = parse_bin('300x240x220')

#: Below so many boxes in the bin most of the time does not depend on them: left out of the fit.
FEW_BOXES = 25


@dataclass(frozen=True)
class State:
    """A moment of a run: boxes of the look-ahead and open bins."""

    boxes: tuple[Box, ...]
    bins: tuple[Bin, ...]


@dataclass(frozen=True)
class Series:
    """Milliseconds per decision against a size, and the fitted exponent."""

    name: str
    sizes: tuple[float, ...]
    milliseconds: tuple[float, ...]
    fitted_from: float = 0.0

    @property
    def exponent(self) -> float:
        """Slope of log time over log size, least squares, from ``fitted_from`` on."""
        points = [
            (math.log(size), math.log(value))
            for size, value in zip(self.sizes, self.milliseconds, strict=True)
            if size >= self.fitted_from
        ]
        mean_x, mean_y = fmean(x for x, _ in points), fmean(y for _, y in points)
        slope = sum((x - mean_x) * (y - mean_y) for x, y in points)
        return round(slope / sum((x - mean_x) ** 2 for x, _ in points), 2) + 0.0


def decision_ms(engine: Engine, state: State) -> float:
    """Least milliseconds of three decisions."""
    models = tuple(engine.model(target) for target in state.bins)
    problem = Problem(engine, state.boxes, models)
    least_s = math.inf
    for _ in range(3):
        started = time.thread_time()
        mpack_lite(problem)
        least_s = min(least_s, time.thread_time() - started)
    return 1e3 * least_s


def filled(engine: Engine, spec: BinSpec, boxes: Sequence[Box], open_bins: int) -> list[State]:
    """The states of a run of ``boxes`` until nothing of the look-ahead fits."""
    bins = [Bin(f'bin-{i}', i, spec) for i in range(1, open_bins + 1)]
    belt, states = list(boxes), []
    while len(belt) >= max(LOOK_AHEADS):
        states.append(State(tuple(belt[: max(LOOK_AHEADS)]), tuple(bins)))
        models = tuple(engine.model(target) for target in bins)
        choice = mpack_lite(Problem(engine, tuple(belt[:LOOK_AHEAD]), models))
        if choice is None:
            break
        index, placed = choice.candidate.bin_index, choice.candidate.placed
        bins[index] = with_box(bins[index], placed)
        belt.remove(placed.box)
    return states


def boxes_for(spec: BinSpec, bins: int, rng: random.Random, file: Path | str = '') -> list[Box]:
    """Boxes of the volume of ``bins`` bins: cut from them (SYN), or drawn from a file's."""
    if spec.name == 'SYN':
        boxes: list[Box] = []
        while len(boxes) < 23 * bins:
            cut = cut_collection(spec, 23, rng)
            boxes += [replace(box, id=f'{box.id}-{len(boxes)}') for box in cut]
        return boxes
    cartons, _ = load_boxes(file)
    boxes, volume = [], 0.0
    while volume < bins * spec.volume_mm3:
        box = rng.choice(cartons)
        boxes.append(replace(box, id=f'{box.id}/{len(boxes)}'))
        volume += box.volume_mm3
    return boxes


def runs(engine: Engine, spec: BinSpec, seeds: int) -> list[State]:
    """The states of ``seeds`` runs into three open bins."""
    return [
        state
        for seed in range(seeds)
        for state in filled(engine, spec, boxes_for(spec, 5, random.Random(seed)), 3)
    ]


def five(state: State) -> State:
    """The state as a look-ahead of five sees it."""
    return replace(state, boxes=state.boxes[:LOOK_AHEAD])


def against_look_ahead(name: str, seeds: int) -> Series:
    """Mean over the states of whole runs into three open bins."""
    engine, spec = Engine(PROFILE), parse_bin(name)
    times: list[list[float]] = [[] for _ in LOOK_AHEADS]
    for state in runs(engine, spec, seeds):
        for count, milliseconds in zip(LOOK_AHEADS, times, strict=True):
            milliseconds.append(decision_ms(engine, replace(state, boxes=state.boxes[:count])))
    return Series(name, tuple(map(float, LOOK_AHEADS)), tuple(map(fmean, times)))


def against_boxes(spec: BinSpec, seeds: int, step: int) -> Series:
    """Mean over ``seeds`` runs into one bin, by the number of boxes in it."""
    engine = Engine(PROFILE)
    by_count: dict[int, list[float]] = {}
    for seed in range(seeds):
        states = filled(engine, spec, boxes_for(spec, 2, random.Random(seed)), 1)
        for state in states[::step]:
            count = len(state.bins[0].boxes)
            by_count.setdefault(count, []).append(decision_ms(engine, five(state)))
    counts = sorted(count for count in by_count if count and len(by_count[count]) == seeds)
    size = 'x'.join(f'{edge / 1000:g}' for edge in spec.size_mm)
    return Series(
        f'one bin of {size} m', tuple(map(float, counts)),
        tuple(fmean(by_count[count]) for count in counts), FEW_BOXES,
    )  # fmt: skip


def against_resolution(name: str, seeds: int, *, same_bins: bool) -> Series:
    """Mean over runs with the same boxes.

    Either the bins are packed at each resolution, or the states of a run at 10 mm are decided at
    all of them. Sizes in whole centimetres (SYN) make these the same.
    """
    spec = parse_bin(name)
    engines = [
        Engine(replace(PROFILE, resolution_mm=step, resolution_z_mm=step))
        for step in RESOLUTIONS_MM
    ]
    if same_bins:
        states = runs(engines[-1], spec, seeds)
        rows = [[decision_ms(engine, five(state)) for engine in engines] for state in states]
        times = [fmean(column) for column in zip(*rows, strict=True)]
    else:
        times = [
            fmean(decision_ms(engine, five(state)) for state in runs(engine, spec, seeds))
            for engine in engines
        ]
    text = f'{name}, same bins' if same_bins else f'{name}, packed at it'
    return Series(text, tuple(map(float, RESOLUTIONS_MM)), tuple(times))


def draw(panels: dict[str, list[Series]], path: Path) -> None:
    """Three panels side by side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.2, 3.6), layout='constrained')
    axes = figure.subplots(1, len(panels))
    for axis, (label, curves) in zip(axes, panels.items(), strict=True):
        for curve, colour, marker in zip(
            curves, ('#0072B2', '#D55E00', '#009E73'), 'os^', strict=False
        ):
            dense = len(curve.sizes) > 10
            axis.plot(
                curve.sizes, curve.milliseconds, color=colour, marker='' if dense else marker,
                label=f'{curve.name}: exponent {curve.exponent:.2f}',
            )  # fmt: skip
        axis.set_xlabel(label)
        # room above the lines for the legend
        axis.set_ylim(0, 1.3 * max(value for curve in curves for value in curve.milliseconds))
        if len(curves[0].sizes) <= 10:
            axis.set_xticks(curves[0].sizes)
        axis.grid(visible=True, alpha=0.3)
        axis.spines[['top', 'right']].set_visible(False)
        axis.legend(frameon=False, fontsize=8, loc='upper left')
    axes[0].set_ylabel('mean time of a decision, ms')
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={'Date': None} if path.suffix == '.svg' else None)


def main() -> None:
    """Print a table for each kind of growth, and draw them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeds', type=int, default=3, help='runs per figure (default 3)')
    parser.add_argument('--figure', type=Path, help='.svg, .png or .pdf')
    options = parser.parse_args()
    panels = {
        'look-ahead, boxes': [against_look_ahead(name, options.seeds) for name in ('SYN', 'PAL')],
        'boxes in the bin': [against_boxes(LARGE, options.seeds, 5)],
        'resolution, mm': [
            against_resolution(name, options.seeds, same_bins=same)
            for name, same in (('SYN', True), ('PAL', True), ('PAL', False))
        ],
    }
    for label, curves in panels.items():
        for curve in curves:
            chosen = range(0, len(curve.sizes), max(1, len(curve.sizes) // 8))
            cells = ', '.join(f'{curve.sizes[i]:g}: {curve.milliseconds[i]:.2f}' for i in chosen)
            sys.stdout.write(f'{label}, {curve.name}: ms {cells}; exponent {curve.exponent:.2f}\n')
            sys.stdout.flush()
    if options.figure is not None:
        draw(panels, options.figure)


if __name__ == '__main__':
    main()
