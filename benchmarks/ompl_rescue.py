#!/usr/bin/env python3
"""How many placements without a drawn path a search (RRTConnect of OMPL) finds in time.

OMPL is no part of the cell; run this in the environment of `./cell setup` after

    pip install ompl==2.0.1
    python benchmarks/ompl_rescue.py --bins RC PAL --count 200 --seed 1

Boxes and placements are those of `arm_motion.py` without physics. Whenever the arm refuses one with
PATH_IN_COLLISION, the search tries stances whose pick and place are free, in the coordinates of
the drawn paths (rail, direction, distance, height, turn); the mast stays upright. What it finds is
rounded, checked and timed like a drawn path. A rescue is only counted: the box goes elsewhere.
"""

# ruff: noqa: ANN401, SLF001 - it looks into the planner, and OMPL has no types

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from typing import Any

import numpy as np
from arm_motion import Rig, boxes_from

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.kinematics import BRANCHES
from arm_executor.model.layout import pick_pose
from arm_executor.motion.path import (
    JointPath,
    Waypoint,
    joint_path,
    positions,
    rounded,
    starting_at,
    waypoint,
)
from arm_executor.motion.planner import _BOLD, PATH_STEP, _Paths
from arm_executor.motion.stances import find_stances
from arm_executor.motion.task import make_task
from arm_executor.motion.template import find_way
from arm_executor.motion.timing import Load
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import metres

#: Weights of a waypoint's coordinates as metres, and the least and most of each.
_SCALE = np.array([1.0, 1.0, 1.0, 1.0, 0.3])
_LOW, _HIGH = np.array([-2.4, -1.2, 0.35, 0.2, -7.0]), np.array([2.4, 4.3, 1.75, 2.4, 7.0])
_STANCES, _CORNERS = 4, (0.15, 0.06, 0.03)


class Search:
    """Searches legs for one arm, each within ``seconds`` of the wall clock."""

    def __init__(self, rig: Rig, seconds: float) -> None:
        from ompl import base, geometric, util  # not a dependency of the cell

        util.setLogLevel(util.LogLevel.LOG_NONE)
        self._base, self._geometric = base, geometric
        self._planner, self._world = rig.arm.planning.motions, rig.arm.obstacles
        self._seconds = seconds

    def leg(
        self, start: Waypoint, end: Waypoint, branch: int, at: Any, hit: Any
    ) -> JointPath | None:
        """A free path of one leg from ``at`` (7,); ``hit`` says what a path touches."""
        base = self._base
        space = base.RealVectorStateSpace(5)
        bounds = base.RealVectorBounds(5)
        for axis in range(5):
            bounds.setLow(axis, float(_LOW[axis] * _SCALE[axis]))
            bounds.setHigh(axis, float(_HIGH[axis] * _SCALE[axis]))
        space.setBounds(bounds)
        setup = self._geometric.SimpleSetup(space)
        ends = np.array([start, end])
        kinematics = self._planner.kinematics

        def free(state: Any) -> bool:
            here = np.array([state[axis] for axis in range(5)]) / _SCALE
            pair = joint_path(kinematics, np.array([here, here]), branch)
            if pair is None:
                return False
            path = JointPath(pair.q[:1], pair.tcp[:1], pair.yaw[:1])
            # Its ends say where a box is checked closely.
            ways = positions(np.vstack([ends[:1], here, ends[1:]]))
            near = np.hypot(*(ways[[0, 2], :2] - ways[1, :2]).T).min()
            return hit(path, near) is None

        setup.setStateValidityChecker(free)
        states = []
        for point in (start, end):
            state = space.allocState()
            for axis in range(5):
                state[axis] = float(point[axis] * _SCALE[axis])
            states.append(state)
        setup.setStartAndGoalStates(*states)
        information = setup.getSpaceInformation()
        information.setStateValidityCheckingResolution(0.002)
        setup.setPlanner(self._geometric.RRTConnect(information))
        setup.solve(self._seconds)
        if not setup.haveExactSolutionPath():
            return None
        setup.simplifySolution(self._seconds / 2)
        waypoints = setup.getSolutionPath().getStates()
        points = [tuple(np.array([s[a] for a in range(5)]) / _SCALE) for s in waypoints]
        for corner in _CORNERS:
            path = joint_path(kinematics, rounded(points, corner, PATH_STEP), branch)
            path = None if path is None else starting_at(path, at)
            if path is not None and hit(path, None) is None:
                return path
        return None


class RescueRig(Rig):
    """:class:`Rig` that counts what a search finds where no drawn path is free."""

    def __init__(self, kind: str, options: argparse.Namespace) -> None:
        super().__init__(kind, options)
        self.search = Search(self, options.search)
        self.searches: Counter[str] = Counter()
        self.times: list[float] = []
        self.took: list[float] = []

    def place(self, decision: Decision, first: bool) -> bool:
        """As without the search; a refusal for a collision is searched on the way."""
        target = next(target for target in self.bins if target.id == decision.bin_id)
        pick = pick_pose(self.arm.layout, decision.box.size_mm)
        request = PlaceRequest(decision.box, pick, target.station, decision.target)
        try:
            self.arm.plan(request)
        except MotionError as error:
            if error.code is ErrorCode.PATH_IN_COLLISION:
                begun = time.perf_counter()
                seconds = self.rescue(request)
                self.took.append(time.perf_counter() - begun)
                self.searches['asked'] += 1
                self.searches['first'] += first
                if isinstance(seconds, str):
                    self.searches[seconds] += 1
                else:
                    self.times.append(seconds)
                    late = seconds > self.options.deadline
                    self.searches['too slow' if late else 'in time'] += 1
                    self.searches['first in time'] += first and not late
        return super().place(decision, first)

    def rescue(self, request: PlaceRequest) -> float | str:
        """Seconds of the quickest motion that the search finds, or why there is none."""
        arm = self.arm
        planner, world = arm.planning.motions, arm.obstacles
        target = arm.bins.find(request.station)
        assert target is not None
        site = arm.bins.site(target)
        try:
            task = make_task(request, site, arm.layout)
        except MotionError:
            return 'no room'
        start = planner._start(arm.driver.commanded)
        stances = find_stances(planner.kinematics, planner.timing, task, start.q, start.branch)
        world.hold(task.size, 'held')
        best, why = math.inf, 'pick or place not free'
        try:
            same = [stance for stance in stances if stance.branch == start.branch]
            able = [stance for stance in same if planner._ends_hit(task, stance) is None]
            for stance in able[:_STANCES]:
                motion = self.searched(task, stance, start, request)
                if isinstance(motion, str):
                    why = motion
                else:
                    best = min(best, motion)
        finally:
            world.drop()
        return best if math.isfinite(best) else why

    def searched(self, task: Any, stance: Any, start: Any, request: PlaceRequest) -> float | str:
        """Seconds of a motion in one stance, legs searched where the drawn ones are not free."""
        planner = self.arm.planning.motions
        begin = waypoint(float(start.q[0]), start.tool[:3, 3], start.yaw, math.pi / 2)
        d4 = BRANCHES[stance.branch][0] * planner.kinematics.robot.d4
        way = find_way(task, stance, begin, float(start.q[6]), d4)
        turned = task.pick_yaw + task.turn
        turn = task.pick_yaw - way.grip[4]

        def bare(name: str, top: Any, yaw: float) -> Any:
            return lambda path, _near: planner._bare_hit(task, path, name, top, yaw)

        def carried(path: JointPath, near: float | None) -> str | None:
            if near is None:
                return planner._carry_hit(task, path)
            if near > 0.02:
                far = np.array([[9.0, 0.0, 0.0]])
                tcp = np.vstack([path.tcp + far, path.tcp, path.tcp - far])
                path = JointPath(np.repeat(path.q, 3, 0), tcp, np.repeat(path.yaw, 3))
            return self.arm.obstacles.first_hit(path, turn)

        legs = (
            (way.approach, begin, way.grip, bare('pick box', task.pick, task.pick_yaw)),
            (way.carry, way.grip, way.place, carried),
            (way.retreat, way.place, way.hover, bare('placed box', task.place, turned)),
        )
        at, paths = start.q, []
        for draw, one, other, hit in legs:
            drawn = planner._first_free(
                task, stance, _BOLD, at, draw, lambda path, hit=hit: hit(path, None)
            )
            path = drawn
            if isinstance(path, str):
                path = self.search.leg(one, other, stance.branch, at, hit)
            if path is None:
                return 'nothing found'
            paths.append(path)
            at = path.q[-1]
        box = request.box
        load = Load(box.weight_kg, task.size, metres(box.com_offset_mm))
        motion = planner._timed(task, _Paths(None, *paths), load)
        return 'not timed' if isinstance(motion, str) else motion.duration


def main() -> int:
    """Print one line for each kind of bin."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else '')
    parser.add_argument('--bins', nargs='+', default=['RC', 'PAL'])
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--boxes', default='')
    parser.add_argument('--search', type=float, default=2.0, help='seconds for each leg')
    given = parser.parse_args()
    options = argparse.Namespace(
        **vars(given),
        grasp_faces='top',
        deadline=5.5,
        algorithm='mpack_lite',
        layout=None,
        physics=False,
        picture=None,
        json=None,
        verbose=False,
    )
    for kind in options.bins:
        rig = RescueRig(kind, options)
        tally = rig.run(boxes_from(options))
        times = ', '.join(f'{seconds:.1f}' for seconds in sorted(rig.times)) or 'none'
        mean = sum(rig.took) / max(1, len(rig.took))
        print(
            f'{kind}: {tally.placed} placed, {tally.first_choices} first choices, '
            f'{tally.first_refused} refused; collisions {dict(rig.searches)}; '
            f'motions found: {times} s; search {mean:.1f} s each',
            flush=True,
        )
    return 0


if __name__ == '__main__':
    sys.exit(main())
