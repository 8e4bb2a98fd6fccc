#!/usr/bin/env python3
"""Where the seconds of the arm go, bin type by bin type, on placements of the planner.

Run it in the environment of `./cell setup`:

    python benchmarks/arm_motion.py                              # plans only, built-in list
    python benchmarks/arm_motion.py --physics --count 200 --boxes cases.csv --seed 3

Boxes come in the order of the file, or shuffled by the seed; two bins are open, as in `./cell run`.
A placement that the arm refuses is offered no more, as the planner does it. Each is also predicted,
and a second table says how well. Without `--physics`
every box rests where it was meant to; with it, it rests where physics left it.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.arms.physics.render import Camera
from arm_executor.bins.records import placed_of
from arm_executor.goals.judging import judge
from arm_executor.model.arm_interface import MotionError, MotionHooks, MotionPlan, PlaceRequest
from arm_executor.model.layout import bin_frame, pick_pose
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.stances import GRIP_S, RELEASE_S
from arm_executor.reach.layout_file import load_layout
from conveyor_sim.streams import load_boxes
from pack_cell.options.usual import GRASP_FACES
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.tolerance import Tolerance
from pack_msgs_py.metrics import quantile
from pack_msgs_py.profiles import PROFILES, find_profile
from pack_msgs_py.values import Bin, Box, Walls, parse_bin
from pack_planner.decision.planner import (
    CloseStep,
    DecisionState,
    PlaceStep,
    Planner,
    PolicySettings,
    expected_bins,
)
from pack_planner.decision.refusals import Refusals

#: Seconds per box of the figures to reach, median and 95 %; issue of the arm.
TARGETS = {
    'EQ': (3.8, 4.8),
    'LDC': (4.0, 5.2),
    'SYN': (3.6, 4.6),
    'PAL': (4.4, 5.5),
    'RC': (5.0, 5.5),
}
LOOK_AHEAD, OPEN_BINS = 5, 2


@dataclass
class Tally:
    """What came of one bin type; seconds and metres."""

    kind: str
    placed: int = 0
    first_choices: int = 0
    first_refused: int = 0
    refusals: Counter[str] = field(default_factory=Counter)
    cycles: list[float] = field(default_factory=list)
    splits: dict[str, list[float]] = field(default_factory=dict)
    planning: list[float] = field(default_factory=list)
    refusing: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    moved: list[float] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    fills: list[float] = field(default_factory=list)
    rejected: int = 0
    wall_s: float = 0.0
    slowest: list[tuple[float, str]] = field(default_factory=list)
    predictions: list[tuple[float, float]] = field(default_factory=list)
    predicting: list[float] = field(default_factory=list)

    def add_split(self, split: dict[str, float]) -> None:
        """Count the phases of one placement."""
        for name, seconds in split.items():
            self.splits.setdefault(name, []).append(seconds)


class Rig:
    """One arm, its bins and the planner, without ROS and without a belt that moves."""

    def __init__(self, kind: str, options: argparse.Namespace) -> None:
        self.options = options
        layout = load_layout(options.layout) if options.layout else None
        self.arm = PhysicsArm(layout)
        self.spec = parse_bin(kind)
        faces = GRASP_FACES[options.grasp_faces]
        profile = replace(find_profile(options.profile), orientations=faces)
        self.planner = Planner(PolicySettings(options.algorithm, profile), time.perf_counter)
        self.refusals = Refusals()
        self.tally = Tally(kind)
        self.serial = 0
        self.bins: tuple[Bin, ...] = ()
        self.poses: dict[str, Pose] = {}
        for station in 'AB'[:OPEN_BINS]:
            self.open_bin(station)

    def open_bin(self, station: str) -> None:
        """An empty bin at ``station``."""
        self.serial += 1
        name = f'{self.spec.name}-{self.serial}'
        self.bins += (Bin(name, self.serial, self.spec, station=station),)
        self.poses = self.arm.set_bins(self.bins, self.poses)

    def close_bin(self, target: Bin) -> None:
        """Take ``target`` away and stand an empty one there."""
        if self.options.picture and target.fill_rate > max(self.tally.fills, default=0.0):
            self.picture(target)
        self.tally.fills.append(target.fill_rate)
        self.bins = tuple(other for other in self.bins if other.id != target.id)
        self.open_bin(target.station)

    def picture(self, target: Bin) -> None:
        """Save what ``target`` looks like from above the rail, the side of an open front."""
        frame = bin_frame(self.arm.layout, target.station, self.spec)
        length, breadth, height = (edge / 1000 for edge in self.spec.size_mm)
        centre = (length / 2, breadth / 2, height / 2)
        x, y, z = frame.to_cell(Pose(centre)).position
        away = 2.0 * math.hypot(length, breadth, height)
        aside = away * (-0.35 if target.station == 'A' else 0.35)
        back, up = (0.6, 0.75) if self.spec.walls is not Walls.CLOSED else (0.4, 0.85)
        camera = Camera((x + aside, y - back * away, z + up * away), (x, y, z), 34.0)
        self.arm.render(self.options.picture / f'bin_{target.spec.name}.png', 480, 400, camera)

    def run(self, boxes: Iterator[Box]) -> Tally:
        """Place ``boxes`` until there are no more."""
        begun = time.perf_counter()
        belt: list[Box] = []
        first = True
        while True:
            while len(belt) < LOOK_AHEAD and (box := next(boxes, None)) is not None:
                belt.append(box)
            if not belt:
                break
            state = DecisionState(tuple(belt), self.bins, self.refusals.snapshot())
            outcome = self.planner.decide(state)
            if isinstance(outcome, PlaceStep):
                self.tally.first_choices += first
                done = self.place(outcome.decision, first)
                first = done
                if done:
                    belt.remove(outcome.decision.box)
            elif isinstance(outcome, CloseStep):
                self.close_bin(outcome.target)
                first = True
            else:
                rejected = getattr(outcome, 'decision', None)
                self.tally.rejected += 1
                belt.remove(belt[0] if rejected is None else rejected.box)
        self.tally.wall_s = time.perf_counter() - begun
        self.arm.close()
        return self.tally

    def place(self, decision: Decision, first: bool) -> bool:
        """Plan a decision and carry it out; ``False`` when the arm refuses it."""
        target = next(target for target in self.bins if target.id == decision.bin_id)
        pick = pick_pose(self.arm.layout, decision.box.size_mm)
        request = PlaceRequest(decision.box, pick, target.station, decision.target)
        predicted = self.predicted(request)
        begun = time.thread_time()
        text, plan = '', None
        try:
            plan = self.arm.plan(request)
        except MotionError as error:
            text = f'{error.code.name}: {error}'
        seconds = time.thread_time() - begun
        self.tally.predictions.append((
            predicted, math.inf if plan is None else plan.predicted_s,
        ))  # fmt: skip
        if plan is not None and plan.predicted_s > self.options.deadline:
            text = f'DEADLINE_UNREACHABLE: {plan.predicted_s:.2f} s'
            self.note(decision, target, plan.predicted_s)
        if plan is None or text:
            self.tally.refusing.append(seconds)
            self.tally.refusals[text.split(':')[0]] += 1
            self.tally.first_refused += first
            if self.options.verbose:
                print(f'  {self.where(decision, target)} refused: {text}')
            self.refusals.learn(target, decision, ErrorCode[text.split(':')[0]], lasting=True)
            return False
        self.tally.planning.append(seconds)
        self.note(decision, target, plan.predicted_s)
        self.carry_out(plan, decision, target)
        return True

    def predicted(self, request: PlaceRequest) -> float:
        """Seconds that the arm predicts; infinite when it finds no motion."""
        begun = time.thread_time()
        try:
            seconds = self.arm.predict(request)
        except MotionError:
            seconds = math.inf
        self.tally.predicting.append(time.thread_time() - begun)
        return seconds

    def note(self, decision: Decision, target: Bin, seconds: float) -> None:
        """Keep what took longest."""
        self.tally.slowest.append((seconds, self.where(decision, target)))

    @staticmethod
    def where(decision: Decision, target: Bin) -> str:
        """One line for people."""
        size = 'x'.join(f'{edge:.0f}' for edge in decision.box.size_mm)
        x, y, z = decision.target.position
        return (
            f'{size} {decision.box.weight_kg:.1f} kg to {target.station} '
            f'({x:.2f}, {y:.2f}, {z:.2f}) {decision.orientation}'
        )

    def carry_out(self, plan: MotionPlan, decision: Decision, target: Bin) -> None:
        """Run the plan, or take its end for granted, and write the box into its bin."""
        motion: PlannedMotion = plan.detail
        tally, box_id = self.tally, decision.box.id
        pose = decision.target
        tally.placed += 1
        if self.options.physics:
            nothing = MotionHooks(lambda *_: None, *(lambda: None,) * 3)
            result = self.arm.execute(plan, nothing, threading.Event())
            tally.cycles.append(result.motion_s)
            tally.add_split({
                phase.name.lower(): seconds
                for phase, seconds in result.split_s.items()
                if phase is not Phase.SETTLING
            })  # fmt: skip
            code, text = result.code, result.message
            if code is ErrorCode.NONE:
                slack_s = self.options.deadline - result.motion_s
                code, text = judge(
                    result, placed_of(decision), decision.target, Tolerance(),
                    size_sigmas=0.0, slack_s=slack_s,
                )  # fmt: skip
            if code is not ErrorCode.NONE:
                tally.faults.append(f'{code.name}: {text}')
            if result.measured is None:
                self.poses = self.arm.set_bins(self.bins, self.poses)
                return
            tally.moved.append(result.others_moved_m)
            pose = result.measured
            apart = zip(pose.position, decision.target.position, strict=True)
            tally.errors.append(max(abs(a - b) for a, b in apart))
            self.poses.update(result.others)
        else:
            tally.cycles.append(motion.duration)
            tally.add_split({
                'approaching': motion.approach.duration,
                'grasping': GRIP_S,
                'transferring': motion.lowering_s,
                'lowering': motion.carry.duration - motion.lowering_s,
                'releasing': RELEASE_S,
                'retreating': motion.retreat.duration,
            })  # fmt: skip
            self.arm.driver.commanded = motion.retreat.q[-1]  # nothing moves
        self.poses[box_id] = pose
        measured = replace(decision, target=pose)
        self.bins = expected_bins(self.bins, measured)
        if not self.options.physics:
            self.poses = self.arm.set_bins(self.bins, self.poses)


def boxes_from(options: argparse.Namespace) -> Iterator[Box]:
    """As `./cell run` feeds them."""
    boxes, _ = load_boxes(options.boxes)
    for number in range(options.count):
        turn, index = divmod(number, len(boxes))
        if index == 0 and options.seed:
            random.Random(f'{options.seed}/{turn}').shuffle(boxes)
        box = boxes[index]
        yield replace(box, id=f'{box.id}-{number}')


def line(tally: Tally) -> str:
    """One row of the table."""
    target = TARGETS.get(tally.kind, (0.0, 0.0))
    able = 100 * (1 - tally.first_refused / max(1, tally.first_choices))
    median, high = (quantile(tally.cycles, share) for share in (0.5, 0.95))
    plan = [1000 * quantile(tally.planning, share) for share in (0.5, 0.95)]
    fill = 100 * sum(tally.fills) / len(tally.fills) if tally.fills else 0.0
    worst = 1000 * max(tally.errors, default=0.0)
    moved = 1000 * max(tally.moved, default=0.0)
    return (
        f'| {tally.kind} | {tally.placed} | {able:.1f} % | {median:.2f} / {high:.2f} / '
        f'{max(tally.cycles, default=0):.2f} [{target[0]} / {target[1]}] | '
        f'{plan[0]:.0f} / {plan[1]:.0f} | {sum(tally.refusals.values())} | {len(tally.faults)} | '
        f'{worst:.2f} / {moved:.2f} | {fill:.1f} % ({len(tally.fills)}) | '
        f'{sum(tally.cycles) / tally.wall_s:.1f} |'
    )


def prediction_line(tally: Tally, deadline_s: float) -> str:
    """One row of the table of predictions."""
    pairs = tally.predictions
    possible = [(guess < math.inf) == (known < math.inf) for guess, known in pairs]
    in_time = [(guess <= deadline_s) == (known <= deadline_s) for guess, known in pairs]
    errors = [
        100 * abs(guess / known - 1) for guess, known in pairs if max(guess, known) < math.inf
    ]
    took = [1000 * quantile(tally.predicting, share) for share in (0.5, 0.95)]
    return (
        f'| {tally.kind} | {len(pairs)} | {100 * sum(possible) / len(pairs):.1f} | '
        f'{100 * sum(in_time) / len(pairs):.1f} | {quantile(errors, 0.5):.2f} / '
        f'{quantile(errors, 0.95):.2f} | {took[0]:.0f} / {took[1]:.0f} |'
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else '')
    parser.add_argument('--bins', nargs='+', default=list(TARGETS))
    parser.add_argument('--count', type=int, default=40)
    parser.add_argument('--seed', type=int, default=0, help='0: boxes in the order of the file')
    parser.add_argument('--boxes', default='', help='box file; default: the built-in list')
    parser.add_argument('--grasp-faces', choices=tuple(GRASP_FACES), default='top')
    parser.add_argument('--deadline', type=float, default=5.5)
    parser.add_argument('--algorithm', default='mpack_lite')
    parser.add_argument('--profile', choices=tuple(PROFILES), default='cell')
    parser.add_argument('--layout', type=Path, help='another layout.yaml')
    parser.add_argument('--physics', action='store_true', help='let the arm really do it')
    parser.add_argument('--picture', type=Path, help='folder for a picture of the fullest bin')
    parser.add_argument('--json', type=Path, help='all figures')
    parser.add_argument('--verbose', action='store_true', help='print each refusal')
    options = parser.parse_args()
    print(
        '| bin | placed | first choices done | cycle median / p95 / max, s [goal] | planning '
        'median / p95, ms | refused | faults | worst error / moved, mm | closed fill | x real |'
    )
    print('|---|---|---|---|---|---|---|---|---|---|')
    tallies = []
    for kind in options.bins:
        rig = Rig(kind, options)
        tally = rig.run(boxes_from(options))
        print(line(tally), flush=True)
        tallies.append(tally)
    print(
        '\n| bin | predicted | possible or not, equal, % | in time or not, equal, % | '
        'error of time, median / p95, % | prediction median / p95, ms |\n|---|---|---|---|---|---|'
    )
    for tally in tallies:
        print(prediction_line(tally, options.deadline))
    for tally in tallies:
        split = ', '.join(
            f'{name} {quantile(values, 0.5):.2f}' for name, values in tally.splits.items()
        )
        slow = 1000 * quantile(tally.refusing, 0.5) if tally.refusing else 0.0
        print(f'\n{tally.kind}: {split}; refusals {dict(tally.refusals)}, {slow:.0f} ms each')
        print('  slowest: ' + '; '.join(f'{s:.2f} s {t}' for s, t in sorted(tally.slowest)[-3:]))
        for fault in tally.faults:
            print(f'  {fault}')
    if options.json:
        options.json.write_text(json.dumps([vars(tally) for tally in tallies], indent=1))
    return 0


if __name__ == '__main__':
    sys.exit(main())
