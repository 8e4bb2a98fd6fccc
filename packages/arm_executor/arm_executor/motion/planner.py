"""Plans a whole placement: approach, carry, retreat.

Stances differ in the posture of the arm, in where it stands on the rail, and in the height and the
side of the swing. All get a cheap estimate and a check of pick and place alone; only the quickest
of the rest are tried as whole paths, and few of those are timed, so that a refusal is cheap too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.kinematics import BRANCHES, HOME_POSTURE, CellKinematics
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.motion.front import FrontPlanner
from arm_executor.motion.grasp import as_lying
from arm_executor.motion.obstacle_world import BOX_SKIN, ObstacleWorld
from arm_executor.motion.path import (
    JointPath,
    Waypoint,
    joint_path,
    rounded,
    starting_at,
    waypoint,
    within_limits,
)
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.slide_in import STRAIGHT, beside, slid_in
from arm_executor.motion.stances import Stance, find_stances
from arm_executor.motion.swing import Obstacles
from arm_executor.motion.task import Site, Task, hover_point, largest, make_task
from arm_executor.motion.template import PathStyle, find_way, nearest
from arm_executor.motion.timing import Load, MotionLimits, Timing, Trajectory, joined
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, metres, stands_upright
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Spacing of path samples, and of the check of the timed trajectory; metres and seconds.
PATH_STEP, CHECK_PERIOD = 0.015, 0.015
#: How a leg is drawn: boldly first, then otherwise where that collides; and what is left when no
#: stance is free that way.
_BOLD = (PathStyle(0.30), PathStyle(0.15), PathStyle(0.12, slant=False))
_LAST = (PathStyle(0.06, lift=0.05, slant=False), PathStyle(0.12, lift=0.30, slant=False))
_MAX_TRIED, _MAX_TIMED, _BUDGET_S = 30, 4, 0.5
#: A motion this quick is taken as it comes; a slower one is compared with one more; seconds.
_QUICK_S = 4.0
#: The box is being lowered once it is this far below the top of its way, metres.
_LEVEL = 0.01


@dataclass(frozen=True)
class _Start:
    """Where the arm is: configuration (7,), pad pose (4, 4), yaw of the pad, posture."""

    q: Array
    tool: Array
    yaw: float
    branch: int


@dataclass(frozen=True)
class _Paths:
    """Joint paths of one stance; ``switch`` changes the posture first."""

    switch: JointPath | None
    approach: JointPath
    carry: JointPath
    retreat: JointPath


class MotionPlanner:
    """Plans for one arm in one cell against one :class:`ObstacleWorld`.

    Parameters
    ----------
    robot, layout : which robot it is, and where everything stands.
    limits : assumed limits of motion.
    world : says what would be touched.
    period : of the samples of a trajectory, seconds.
    timing : says how fast a path can be travelled; exactly by default.
    step : spacing of the samples of a path, metres.
    scout : finds much faster where a motion is likely, and what it finds is tried first.
    """

    def __init__(
        self,
        robot: RobotModel,
        layout: Layout,
        limits: MotionLimits,
        world: ObstacleWorld,
        period: float,
        *,
        timing: Timing | None = None,
        step: float = PATH_STEP,
        scout: MotionPlanner | None = None,
    ) -> None:
        self.kinematics = CellKinematics(robot, layout)
        self.timing = timing or Timing(robot, layout, limits)
        self._layout = layout
        self._world = world
        self._period = period
        self._step = step
        self._scout = scout
        self._front = FrontPlanner(self.kinematics, self.timing, layout, world, period)

    def home(self) -> Array:
        """Configuration (7,) above the pick point, elbow up, for the first motion."""
        rail = self._layout.rail.nearest(0.0)
        solutions = self.kinematics.tool_down([rail], [hover_point(self._layout)], [0.0])[0]
        home: Array = solutions[BRANCHES.index(HOME_POSTURE)]
        if np.isnan(home).any():
            robot, point = self.kinematics.robot.name, hover_point(self._layout)
            msg = (
                f'{robot} cannot reach the waiting point {point} above the belt: change the layout'
            )
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        return home

    def plan(self, request: PlaceRequest, q: Array, site: Site) -> PlannedMotion:
        """The quickest of a few collision-free motions from ``q`` (7,), at rest.

        Raises
        ------
        MotionError
            ``LIMITS_EXCEEDED``, ``NO_IK_SOLUTION``, ``PATH_IN_COLLISION`` or
            ``START_STATE_INVALID``, with what was in the way.
        """
        request = as_lying(request)
        self._check_load(request)
        if not stands_upright(request.target.quaternion):
            self._start(q)
            return self._front.plan(request, q, site)
        task = make_task(request, site, self._layout)
        task = replace(task, aside=beside(site, task))
        start = self._start(q)
        stances = find_stances(self.kinematics, self.timing, task, start.q, start.branch)
        if not stances:
            x, y, z = request.target.position
            msg = (
                f'box {request.box.id}: nowhere on its rail can {self.kinematics.robot.name} reach '
                f'({x:.3f}, {y:.3f}, {z:.3f}) m in bin {site.station}'
            )
            raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
        likely, world = self._likely(request, q, site), self._world
        belt = {f'box {box.id} on the belt': (box, pose) for box, pose in request.belt}
        try:
            for name, (box, pose) in belt.items():
                world.set_box(name, metres(box.size_mm), pose)
            world.hold(largest(request.box, task.size), f'box {request.box.id}')
            return self._quickest(request, task, start, stances, likely)
        finally:
            world.drop()
            for name in belt:
                world.remove(name)

    def _check_load(self, request: PlaceRequest) -> None:
        robot, tool = self.kinematics.robot, self._layout.tool
        allowed = robot.payload_tool_down - tool.mass
        if request.box.weight_kg > allowed:
            msg = (
                f'box {request.box.id} weighs {request.box.weight_kg:g} kg; {robot.name} lifts '
                f'{allowed:g} kg with its {tool.mass:g} kg mast'
            )
            raise MotionError(ErrorCode.LIMITS_EXCEEDED, msg)

    def _start(self, q: Array) -> _Start:
        tool = self.kinematics.tool(q)[0]
        if tool[2, 2] > -0.99:
            tilt = math.degrees(math.acos(float(np.clip(-tool[2, 2], -1, 1))))
            msg = f'the mast leans by {tilt:.0f} degrees at the start; move the arm upright first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        yaw = math.atan2(tool[1, 0], tool[0, 0])
        solutions = self.kinematics.tool_down([q[0]], [tool[:3, 3]], [yaw])[0]
        away = np.abs((solutions - q + math.pi) % (2 * math.pi) - math.pi).max(axis=1)
        if np.isnan(away).all() or np.nanmin(away) > 0.1:
            msg = 'the arm stands in no posture that its kinematics know; move it by hand first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        return _Start(q, tool, yaw, int(np.nanargmin(away)))

    def _likely(self, request: PlaceRequest, q: Array, site: Site) -> Stance | None:
        """The stance in which a motion is likely, if that is known."""
        if self._scout is None:
            return None
        try:
            return self._scout.plan(request, q, site).stance
        except MotionError:
            return None

    def _quickest(
        self,
        request: PlaceRequest,
        task: Task,
        start: _Start,
        stances: list[Stance],
        likely: Stance | None,
    ) -> PlannedMotion:
        begun = time.thread_time()
        load = Load(request.box.weight_kg, task.size, metres(request.box.com_offset_mm))
        best: PlannedMotion | None = None
        hit, timed = '', 0
        for stance, styles in self._tries(task, stances, likely):
            late = time.thread_time() - begun > _BUDGET_S
            if late or timed >= _MAX_TIMED or (best and best.duration < stance.estimate):
                break
            paths = self._paths(task, stance, styles, start)
            if isinstance(paths, str):
                hit = hit or paths
                continue
            timed += 1
            motion = self._timed(task, stance, paths, load)
            if isinstance(motion, str):
                hit = hit or motion
            elif best is not None:
                return min(best, motion, key=lambda candidate: candidate.duration)
            elif motion.duration < _QUICK_S:
                return motion
            else:
                best = motion
        if best is None:
            hit = hit or self._why_unable(task, stances)
            seconds = time.thread_time() - begun
            msg = f'box {request.box.id}: no free path found in {seconds:.2f} s; {hit} would touch'
            raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
        return best

    def _tries(
        self, task: Task, stances: list[Stance], likely: Stance | None
    ) -> Iterator[tuple[Stance, tuple[PathStyle, ...]]]:
        """Stances whose pick and place are free, ``likely``, then the quickest; styles to try."""
        if likely is not None and self._ends_hit(task, likely) is None:
            yield likely, (*_BOLD, *_LAST)
        able: list[Stance] = []
        for stance in stances:
            if len(able) >= _MAX_TRIED:
                break
            if stance != likely and self._ends_hit(task, stance) is None:
                able.append(stance)
                yield stance, _BOLD
        behind = task.pick[1] * task.place[1] < 0
        for around in (0.0, 2 * math.pi, -2 * math.pi) if behind else (0.0,):
            for stance in able[:3]:
                yield replace(stance, around=around), (*(_BOLD if around else ()), *_LAST)

    def _ends_hit(self, task: Task, stance: Stance) -> str | None:
        """What touches at pick or place, the box in the gripper."""
        for rail, point, yaw in (
            (stance.place_rail, task.place, task.pick_yaw + task.turn),
            (stance.pick_rail, task.pick, task.pick_yaw),
        ):
            branch = stance.branch
            q = self.kinematics.tool_down([rail], [point], [0.0], (branch,))[:, branch]
            hit = self._world.first_hit(JointPath(q, np.array([point]), np.array([yaw])), 0.0)
            if hit is not None:
                return hit
        return None

    def _why_unable(self, task: Task, stances: list[Stance]) -> str:
        hits = (self._ends_hit(task, stance) for stance in stances)
        return next((hit for hit in hits if hit is not None), 'a joint limit')

    def _paths(
        self, task: Task, stance: Stance, styles: Sequence[PathStyle], start: _Start
    ) -> _Paths | str:
        """Free joint paths of a stance, or what is in the way of it."""
        at, tool, yaw, switch = start.q, start.tool[:3, 3], start.yaw, None
        turned = task.pick_yaw + task.turn
        waiting = ('the box at the pick point', task.pick, task.pick_yaw)
        if stance.branch != start.branch:
            switch = self._switch(task, stance, start)
            if switch is None:
                return 'a joint limit'
            hit = self._bare_hit(task, switch, *waiting)
            if hit is not None:
                return hit
            at, tool, yaw = switch.q[-1], switch.tcp[-1], float(switch.yaw[-1])
        begin = waypoint(float(at[0]), tool, yaw, math.pi / 2)
        d4 = BRANCHES[stance.branch][0] * self.kinematics.robot.d4
        way = find_way(task, stance, begin, float(at[6]), d4)
        placed = ('the box in place', task.place, turned)
        checked: list[JointPath] = []
        legs = (
            (way.approach, STRAIGHT, lambda path: self._bare_hit(task, path, *waiting)),
            (way.carry, task.aside, lambda path: self._carry_hit(task, path)),
            (way.retreat, STRAIGHT, lambda path: self._bare_hit(task, path, *placed)),
        )
        for leg, aside, check in legs:
            path = self._first_free(task, stance, styles, at, leg, aside, check)
            if isinstance(path, str):
                return path
            checked.append(path)
            at = path.q[-1]
        return _Paths(switch, *checked)

    def _first_free(
        self,
        task: Task,
        stance: Stance,
        styles: Sequence[PathStyle],
        at: Array,
        leg: Callable[[PathStyle, Obstacles], list[Waypoint]],
        aside: tuple[float, float],
        check: Callable[[JointPath], str | None],
    ) -> JointPath | str:
        """The boldest free path of one leg from ``at`` (7,), or what is in its way."""
        walls = () if task.front is None else task.front.walls
        obstacles = self._world.obstacles(without=walls)
        first = ''
        for style in styles:
            samples = rounded(leg(style, obstacles), style.corner, self._step)
            samples = slid_in(samples, aside if style.slant else STRAIGHT)
            path = joint_path(self.kinematics, samples, stance.branch)
            follows = None if path is None else starting_at(path, at)
            hit = 'a joint limit' if follows is None else check(follows)
            if follows is not None and hit is None:
                return follows
            first = first or hit or ''
        return first

    def _switch(self, task: Task, stance: Stance, start: _Start) -> JointPath | None:
        """Joint by joint from the start to the stance's posture above the pick point."""
        point = (task.hover[0], task.hover[1], max(task.hover[2], float(start.tool[2, 3])))
        options = self.kinematics.tool_down([stance.pick_rail], [point], [task.pick_yaw])
        q = options[0, stance.branch]
        if np.isnan(q).any():
            return None
        for joint in range(1, 6):
            q[joint] = nearest(float(q[joint]), float(start.q[joint]), 2 * math.pi)
        q[6] = nearest(float(q[6]), 0.0, math.pi / 2)
        count = math.ceil(float(np.abs(q - start.q).max()) / 0.04) + 2
        share = np.linspace(0.0, 1.0, count)[:, None]
        way = start.q + (q - start.q) * share
        return self._seen(way) if within_limits(way) else None

    def _seen(self, q: Array) -> JointPath:
        tool = self.kinematics.tool(q)
        return JointPath(q, tool[:, :3, 3], np.arctan2(tool[:, 1, 0], tool[:, 0, 0]))

    def _carry_hit(self, task: Task, path: JointPath) -> str | None:
        """What the box in the gripper or the arm touches first on its way."""
        return self._world.first_hit(path, task.pick_yaw - float(path.yaw[0]))

    def _bare_hit(
        self, task: Task, path: JointPath, name: str, top: Vec3, yaw: float
    ) -> str | None:
        """What the arm without the box touches first; the box stands with its top at ``top``."""
        centre = (top[0], top[1], top[2] - task.size[2] / 2 - BOX_SKIN)
        turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
        self._world.set_box(name, task.size, Pose(centre, turn))
        hit = self._world.first_hit(path)
        self._world.remove(name)
        return hit

    def _timed(self, task: Task, stance: Stance, paths: _Paths, load: Load) -> PlannedMotion | str:
        """The motion along ``paths``, its samples checked again; else what is wrong with it."""
        pieces: list[Trajectory] = []
        for path, carried in (
            (paths.switch, None),
            (paths.approach, None),
            (paths.carry, load),
            (paths.retreat, None),
        ):
            if path is None:
                continue
            timed = self.timing.trajectory(path.q, carried, self._period)
            if timed is None:
                return 'a torque limit'
            pieces.append(timed)
        carry, retreat = pieces[-2:]
        approach = joined(pieces[:-2])
        hit = self._motion_hit(task, approach, carry, retreat)
        if hit is not None:
            return hit
        height = self.kinematics.tool(carry.q)[:, 2, 3]
        lowering_s = float(carry.times[np.nonzero(height > height.max() - _LEVEL)[0].max()])
        return PlannedMotion(approach, carry, retreat, lowering_s, paths.carry, stance)

    def _motion_hit(
        self, task: Task, approach: Trajectory, carry: Trajectory, retreat: Trajectory
    ) -> str | None:
        """What touches first along the timed trajectories, which their paths are only near."""
        before, on_way, after = (self._seen(self._every(leg)) for leg in (approach, carry, retreat))
        turned = task.pick_yaw + task.turn
        return (
            self._carry_hit(task, on_way)
            or self._bare_hit(task, before, 'the box at the pick point', task.pick, task.pick_yaw)
            or self._bare_hit(task, after, 'the box in place', task.place, turned)
        )

    def _every(self, trajectory: Trajectory) -> Array:
        every = max(1, int(CHECK_PERIOD / self._period))
        return np.vstack([trajectory.q[::every], trajectory.q[-1:]])
