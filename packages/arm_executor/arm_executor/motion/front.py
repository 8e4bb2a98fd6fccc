"""Plans a placement of a box that is taken by its front: tool level at the pick, down at the place.

The arm stands aside of the belt's head, so that the mast points past its pedestal. Between the
level tool and the tool that points down the joints go straight, which no singular posture of the
wrist can bar; what is near the belt and near the bin is straight in space. Joint paths are rounded
at their corners, and each is checked as it will be travelled. Metres and radians, frame `cell`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.kinematics import BRANCHES, CellKinematics
from arm_executor.model.layout import Layout
from arm_executor.model.suction import check_grip
from arm_executor.motion.blend import blended
from arm_executor.motion.front_stances import QUARTER, FrontStance, find_front_stances, unwind
from arm_executor.motion.grasp import front_point, turned_down
from arm_executor.motion.obstacle_world import BOX_SKIN, ObstacleWorld
from arm_executor.motion.path import (
    JointPath,
    joint_path,
    rounded,
    starting_at,
    waypoint,
    within_limits,
)
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.stances import Stance
from arm_executor.motion.task import Site, Task, make_task
from arm_executor.motion.template import PathStyle, find_way
from arm_executor.motion.timing import Load, Timing
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, metres, yaw_of
from pack_msgs_py.values import Vec3, Walls

Array = NDArray[np.float64]

#: The pad comes to the front from this far off, and how far the box is lifted first; metres.
_AWAY = 0.06
#: The box is lifted by this first, m, and corners rounded within this distance of the path; boldly
#: first.
_CARRIES = ((0.25, 0.6), (0.40, 0.7), (0.40, 0.4), (0.55, 0.6), (0.55, 0.3))
#: Spacing of samples in space, metres.
PATH_STEP = 0.015
#: How deep the box is, the scanner knows only to a standard deviation; it is let go this many above
#: what it is to stand on. From above its base is where the belt was.
_SIGMAS = 3.0
_MAX_TIMED, _BUDGET_S = 2, 0.35
#: A motion this quick is taken as it comes, seconds.
_QUICK_S = 5.2
_STYLES = (PathStyle(0.30), PathStyle(0.15), PathStyle(0.06, lift=0.05, slant=False))


class FrontPlanner:
    """Plans front grasps for one arm in one cell against one :class:`ObstacleWorld`.

    Parameters
    ----------
    kinematics, timing : of the robot in its cell.
    layout : where everything stands.
    world : says what would be touched.
    period : of the samples of a trajectory, seconds.
    """

    def __init__(
        self,
        kinematics: CellKinematics,
        timing: Timing,
        layout: Layout,
        world: ObstacleWorld,
        period: float,
    ) -> None:
        self._kinematics = kinematics
        self._timing = timing
        self._layout = layout
        self._world = world
        self._period = period

    def plan(self, request: PlaceRequest, q: Array, site: Site) -> PlannedMotion:
        """The first of a few free motions from ``q`` (7,), at rest with the tool down.

        Raises
        ------
        MotionError
            ``LIMITS_EXCEEDED``, ``NO_IK_SOLUTION`` or ``PATH_IN_COLLISION``, with the reason.
        """
        begun = time.thread_time()
        lying = turned_down(request)
        check_grip(self._layout.tool, lying.box, tilts=True)
        name = request.box.id
        if site.spec.walls is Walls.OPEN_FRONT:
            msg = f'box {name}: taken by its front it does not go through the front of a cage'
            raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
        # The tool may come by any quarter turn, so the half turn that a box may gain is no help.
        task = make_task(lying, site, self._layout)
        place_yaw = task.turn + task.pick_yaw
        x, y, z = task.place
        fall = _SIGMAS * request.box.size_stddev_mm[1] / 1000
        task = replace(
            task,
            symmetric=False,
            place=(x, y, z + fall),
            turn=place_yaw,
            pick_yaw=yaw_of(request.pick.quaternion),
        )
        pick = front_point(request)
        options = find_front_stances(self._kinematics, self._timing, task, pick, q)
        if not options:
            msg = f'box {name}: {self._kinematics.robot.name} does not reach front and place'
            raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
        world = self._world
        belt = {f'box {box.id} on the belt': (box, pose) for box, pose in request.belt}
        try:
            for obstacle, (box, pose) in belt.items():
                world.set_box(obstacle, metres(box.size_mm), pose)
            world.hold(task.size, f'box {name}')
            return self._first(request, lying, task, pick, q, options, begun)
        finally:
            world.drop()
            for obstacle in belt:
                world.remove(obstacle)

    def _first(
        self,
        request: PlaceRequest,
        lying: PlaceRequest,
        task: Task,
        pick: Vec3,
        q: Array,
        options: Sequence[FrontStance],
        begun: float,
    ) -> PlannedMotion:
        load = Load(request.box.weight_kg, task.size, metres(lying.box.com_offset_mm), tilts=True)
        hit, best, timed = '', None, 0
        approaches: dict[int, Array | str] = {}
        for option in options:
            if time.thread_time() - begun > _BUDGET_S or timed >= _MAX_TIMED:
                break
            paths = self._paths(request, task, pick, q, option, approaches)
            if isinstance(paths, str):
                hit = hit or paths
                continue
            timed += 1
            motion = self._timed(request, task, paths, load)
            if isinstance(motion, str):
                hit = hit or motion
            elif best is None or motion.duration < best.duration:
                best = motion
            if best is not None and best.duration < _QUICK_S:
                break
        if best is None:
            msg = f'box {request.box.id}: no free path by its front; {hit} would touch'
            raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
        return best

    def _paths(
        self,
        request: PlaceRequest,
        task: Task,
        pick: Vec3,
        q: Array,
        option: FrontStance,
        approaches: dict[int, Array | str],
    ) -> tuple[Array, Array, JointPath] | str:
        """Joint paths to the box, with it, and back; or what is in the way."""
        grip = option.key[0]
        if grip not in approaches:
            approaches[grip] = self._approach(request, task, pick, q, option)
        approach = approaches[grip]
        if isinstance(approach, str):
            return approach
        reached = self._carry_hit(np.array([option.pick, option.above, option.place])[1:], True)
        if reached is not None:
            return reached
        carry = self._carry(task, pick, option)
        if isinstance(carry, str):
            return carry
        retreat = self._retreat(request, task, option)
        if isinstance(retreat, str):
            return retreat
        return approach, carry, retreat

    def _approach(
        self, request: PlaceRequest, task: Task, pick: Vec3, q: Array, option: FrontStance
    ) -> Array | str:
        reached = self._bare_hit(request, task, option.pick[None], at_pick=True)
        if reached is not None:
            return reached
        x, y, z = pick
        before = self._level(task, (x, y - _AWAY, z), option.pick)
        if before is None:
            return 'a joint limit'
        hit = ''
        up = self._level(task, (x, y - 3 * _AWAY, z + 3 * _AWAY), option.pick)
        for corner, rise in ((0.8, False), (0.4, False), (0.8, True), (0.4, True)):
            points = [q, before, option.pick]
            if rise and up is not None:
                points = [q, up, before, option.pick]
            way = blended(points, corner, range(1, len(points) - 1))
            touched = self._bare_hit(request, task, way, at_pick=True)
            if touched is None:
                return way
            hit = hit or touched
        return hit

    def _carry(self, task: Task, pick: Vec3, option: FrontStance) -> Array | str:
        x, y, z = pick
        down = self._down(task, option)
        if down is None:
            return 'a joint limit'
        hit = ''
        for lift, corner in _CARRIES:
            lifted = self._level(task, (x, y - lift / 3, z + lift), option.pick)
            if lifted is None:
                hit = hit or 'a joint limit'
                continue
            way = blended([option.pick, lifted, *down], corner, (1, 2))
            touched = self._carry_hit(way)
            if touched is None:
                return way
            hit = hit or touched
        return hit

    def _retreat(self, request: PlaceRequest, task: Task, option: FrontStance) -> JointPath | str:
        """Back over the pick point, as after any other placement."""
        tool = self._kinematics.tool(option.place)[0]
        yaw = math.atan2(tool[1, 0], tool[0, 0])
        place = waypoint(float(option.place[0]), task.place, yaw, math.pi / 2)
        d4 = BRANCHES[option.branch][0] * self._kinematics.robot.d4
        rail = self._layout.rail.nearest(max(-0.5, min(0.5, place[0])))
        stance = Stance(0.0, option.branch, rail, place[0])
        lying = replace(task, pick_yaw=0.0)
        way = find_way(lying, stance, place, float(option.place[6]), d4)
        way = replace(way, place=place)
        obstacles, hit = self._world.obstacles(), ''
        for style in _STYLES:
            samples = rounded(way.retreat(style, obstacles), style.corner, PATH_STEP)
            path = joint_path(self._kinematics, samples, option.branch)
            follows = None if path is None else starting_at(path, option.place)
            touched = (
                'a joint limit'
                if follows is None
                else self._bare_hit(request, task, follows.q, at_pick=False)
            )
            if follows is not None and touched is None:
                return follows
            hit = hit or touched or ''
        return hit

    def _level(self, task: Task, point: Vec3, near: Array) -> Array | None:
        """Configuration (7,) with the tool level at ``point`` next to ``near``."""
        solutions = self._kinematics.tool_ahead([near[0]], [point], task.pick_yaw)[0]
        solutions = solutions[~np.isnan(solutions).any(axis=1)]
        if not len(solutions):
            return None
        for q in solutions:
            q[6] += QUARTER * round((near[6] - q[6]) / QUARTER)
            unwind(q, near)
        best: Array = solutions[int(np.abs(solutions - near).max(axis=1).argmin())]
        return best if np.abs(best - near).max() < 1.2 else None

    def _down(self, task: Task, option: FrontStance) -> Array | None:
        """Straight down (n, 7) from above the place into it."""
        high = float(self._kinematics.tool(option.above)[0, 2, 3])
        heights = np.arange(high, task.place[2], -PATH_STEP)
        heights = np.r_[heights, task.place[2]]
        points = np.column_stack([np.tile(task.place[:2], (len(heights), 1)), heights])
        rails = np.full(len(heights), option.place[0])
        branch = option.branch
        q = self._kinematics.tool_down(rails, points, np.full(len(rails), task.turn), (branch,))
        q = q[:, branch]
        if np.isnan(q).any():
            return None
        q[:, 1:] = np.unwrap(q[:, 1:], axis=0)
        turns = np.round((option.above[1:6] - q[0, 1:6]) / (2 * math.pi)) * 2 * math.pi
        q[:, 1:6] += turns
        q[:, 6] += option.above[6] - q[0, 6]
        return q if within_limits(q) else None

    def _carry_hit(self, q: Array, ends: bool = False) -> str | None:
        tool = self._kinematics.tool(q)
        low = self._lowest(tool)
        if not ends and (low[: max(2, len(low) // 3)] < low[0] - 0.0005).any():
            return 'the box and the belt'
        if ends:
            # Neither is near the pick: a first sample elsewhere has both checked.
            q, tool = np.vstack([q[:1], q]), np.concatenate([tool[:1] * 1.0, tool])
            tool[0, :3, 3] += 1.0
        return self._world.first_hit_tilted(q, tool)

    def _lowest(self, tool: Array) -> Array:
        """Height (n,) of the lowest corner of the held box."""
        length, breadth, depth = self._world.held_size
        axes = np.abs(tool[:, 2, :2]) @ np.array([length, breadth]) / 2
        along = tool[:, 2, 2] * depth
        lowest: Array = tool[:, 2, 3] - axes + np.minimum(along, 0.0)
        return lowest

    def _bare_hit(
        self, request: PlaceRequest, task: Task, q: Array, *, at_pick: bool
    ) -> str | None:
        """What the arm without the box touches first; the box stands where it is by then."""
        if at_pick:
            name, size = 'the box at the pick point', metres(request.box.size_mm)
            x, y, z = request.pick.position
            pose = Pose((x, y + BOX_SKIN, z), request.pick.quaternion)
        else:
            name, size, yaw = 'the box in place', task.size, task.turn
            x, y, z = task.place
            turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
            pose = Pose((x, y, z - task.size[2] / 2 - BOX_SKIN), turn)
        self._world.set_box(name, size, pose)
        try:
            tool = self._kinematics.tool(q)
            return self._world.first_hit(JointPath(q, tool[:, :3, 3], np.zeros(len(q))))
        finally:
            self._world.remove(name)

    def _timed(
        self,
        request: PlaceRequest,
        task: Task,
        paths: tuple[Array, Array, JointPath],
        load: Load,
    ) -> PlannedMotion | str:
        approach = self._timing.trajectory(paths[0], None, self._period)
        carry = self._timing.trajectory(paths[1], load, self._period)
        retreat = self._timing.trajectory(paths[2].q, None, self._period)
        if approach is None or carry is None or retreat is None:
            return 'a torque limit'
        hit = (
            self._carry_hit(carry.q[::4])
            or self._bare_hit(request, task, approach.q[::4], at_pick=True)
            or self._bare_hit(request, task, retreat.q[::4], at_pick=False)
        )
        if hit is not None:
            return hit
        tool = self._kinematics.tool(carry.q)
        height = tool[:, 2, 3]
        lowering = int(np.nonzero(height > height.max() - 0.01)[0].max())
        sampled = self._kinematics.tool(paths[1])
        path = JointPath(
            paths[1], sampled[:, :3, 3], np.arctan2(sampled[:, 1, 0], sampled[:, 0, 0])
        )
        return PlannedMotion(approach, carry, retreat, float(carry.times[lowering]), path)
