"""Plans a whole placement: approach, carry, retreat.

Template paths: over the box, down to it; up over the highest obstacle on the way, across, down into
the bin; up, back over the pick point. Candidates differ in where the arm stands on the rail and in
the height and the side of the swing; the quickest by estimate are checked first, and time is spent
on few of them, so that a refusal is cheap too.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.arm import MotionError, PlaceRequest
from arm_executor.layout import NO_WALLS, OPEN_FRONT, BinFrame, Layout
from arm_executor.motion.collision import BOX_SKIN, PlanningWorld
from arm_executor.motion.path import (
    JointPath,
    Waypoint,
    joint_path,
    rounded,
    starting_at,
    waypoint,
)
from arm_executor.motion.timing import Load, MotionLimits, Timing, Trajectory
from arm_executor.robot.kinematics import BRANCHES, CellKinematics
from arm_executor.robot.parameters import ArmModel
from pack_msgs_py.cell_values import Pose
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import BinSpec, Vec3

Array = NDArray[np.float64]

#: Robot seconds to build up the vacuum, and to lose it; assumed.
GRIP_S = RELEASE_S = 0.25
#: Spacing of path samples, and of the check of the timed trajectory; metres and seconds.
PATH_STEP, CHECK_PERIOD = 0.015, 0.018
#: Air under the box while it swings, and under the empty pad; metres.
CLEAR = 0.05
#: Corners are rounded within this distance; the second where the first collides.
CORNERS = (0.15, 0.06)
#: The box is let go this far above what it stands on, metres.
DROP = 0.0005
#: How far under the commanded pose the box may be lowered to what really is there, and how far
#: that may stand above it; metres.
_LOWEST, _HIGHEST = 0.010, 0.003
_MAX_CHECKED, _MAX_TIMED, _BUDGET_S = 10, 2, 0.35


@dataclass(frozen=True)
class Standing:
    """A box that stands in a bin: its extent in `cell`."""

    box_id: str
    low: Vec3
    high: Vec3


@dataclass(frozen=True)
class Site:
    """The target bin as the planner sees it."""

    station: str
    spec: BinSpec
    frame: BinFrame
    standing: Sequence[Standing]


@dataclass(frozen=True)
class PlannedMotion:
    """Three trajectories from rest to rest, and where the second one starts to lower."""

    approach: Trajectory
    carry: Trajectory
    retreat: Trajectory
    lowering_s: float
    carry_path: JointPath = field(repr=False)
    release_z: float = 0.0

    @property
    def duration(self) -> float:
        """Robot time of all of it, grip and release included."""
        moving = self.approach.duration + self.carry.duration + self.retreat.duration
        return moving + GRIP_S + RELEASE_S


@dataclass(frozen=True)
class _Task:
    """A request in `cell`: pad positions and yaws, and heights to keep."""

    pick: Vec3
    place: Vec3
    pick_yaw: float
    turn: float
    size: Vec3
    symmetric: bool
    hover: Vec3
    swing_heights: tuple[float, ...]
    retreat_height: float
    front_y: float | None
    entry_height: float


@dataclass(frozen=True)
class _Candidate:
    estimate: float
    pick_rail: float
    place_rail: float
    swing: float
    around: float


class MotionPlanner:
    """Plans for one arm in one cell against one :class:`PlanningWorld`."""

    def __init__(
        self,
        arm: ArmModel,
        layout: Layout,
        limits: MotionLimits,
        world: PlanningWorld,
        period: float,
    ) -> None:
        self.kinematics = CellKinematics(arm, layout)
        self.timing = Timing(arm, layout, limits)
        self._world = world
        self._period = period

    def hover(self, belt_tops: Iterable[float] = ()) -> Vec3:
        """Where the pad waits: above the pick point and every box that may come there."""
        belt = self.kinematics.layout.conveyor
        height = max([belt.tallest_box + belt.top_z, *belt_tops]) + CLEAR
        return (0.0, belt.front_y + 0.20, height)

    def home(self) -> Array:
        """Configuration (7,) above the pick point, elbow up, for the first motion."""
        solutions = self.kinematics.tool_down([0.0], [self.hover()], [0.0])[0]
        home: Array = solutions[BRANCHES.index((1, 1, 1))]
        if np.isnan(home).any():
            arm = self.kinematics.arm
            msg = f'{arm.name} cannot reach the pick point {self.hover()} from the rail: move them'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        return home

    def plan(self, request: PlaceRequest, start: Array, site: Site) -> PlannedMotion:
        """The quickest of a few collision-free motions from ``start`` (7,), at rest.

        Raises
        ------
        MotionError
            ``LIMITS_EXCEEDED``, ``NO_IK_SOLUTION``, ``PATH_IN_COLLISION`` or
            ``START_STATE_INVALID``, with what was in the way.
        """
        begun = time.perf_counter()
        self._check_load(request)
        task, release_z = self._task(request, site)
        kinematics = self.kinematics
        tool = kinematics.tool(start)[0]
        if tool[2, 2] > -0.99:
            tilt = math.degrees(math.acos(float(np.clip(-tool[2, 2], -1, 1))))
            msg = f'the mast leans by {tilt:.0f} degrees at the start; move the arm upright first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        candidates = self._candidates(task, start, tool)
        if not candidates:
            x, y, z = request.target.position
            msg = (
                f'box {request.box.id}: no rail position lets {kinematics.arm.name} reach '
                f'({x:.3f}, {y:.3f}, {z:.3f}) m in bin {site.station}, or the pick point'
            )
            raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
        belt = [f'box {box.id} on the belt' for box, _ in request.belt]
        try:
            for name, (box, pose) in zip(belt, request.belt, strict=True):
                self._world.set_box(name, _metres(box.size_mm), pose)
            return self._best(request, task, release_z, candidates, (start, tool), begun)
        finally:
            self._world.drop()
            for name in (*belt, _at_pick(request), _at_place(request)):
                self._world.remove(name)

    def _best(
        self,
        request: PlaceRequest,
        task: _Task,
        release_z: float,
        candidates: list[_Candidate],
        begin: tuple[Array, Array],
        begun: float,
    ) -> PlannedMotion:
        offset = request.box.com_offset_mm
        load = Load(request.box.weight_kg, task.size, _metres(offset))
        world = self._world
        world.hold(task.size, f'box {request.box.id}')
        best: PlannedMotion | None = None
        hit, timed = '', 0
        pairs = itertools.product(candidates[:_MAX_CHECKED], CORNERS)
        for candidate, corner in pairs:
            if best is not None and (timed >= _MAX_TIMED or best.duration < candidate.estimate):
                break
            if time.perf_counter() - begun > _BUDGET_S:
                break
            paths = self._paths(task, candidate, *begin, corner)
            if paths is None:
                hit = hit or 'a joint limit'
                continue
            found = self._collision(request, task, paths)
            if found is None:
                timed += 1
                trajectories = self._timed(paths, load)
                found = 'the timing' if trajectories is None else None
                if trajectories is not None:
                    found = self._collision(request, task, [self._sampled(t) for t in trajectories])
                    if found is None:
                        motion = self._motion(task, trajectories, paths[1], release_z)
                        if best is None or motion.duration < best.duration:
                            best = motion
            hit = hit or found or ''
        if best is None:
            seconds = time.perf_counter() - begun
            msg = f'box {request.box.id}: every path tried touches something: {hit} ({seconds:.2f} s)'
            raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
        return best

    def _check_load(self, request: PlaceRequest) -> None:
        arm, tool = self.kinematics.arm, self.kinematics.layout.tool
        allowed = arm.payload_tool_down - tool.mass
        if request.box.weight_kg > allowed:
            msg = (
                f'box {request.box.id} weighs {request.box.weight_kg:g} kg; {arm.name} lifts '
                f'{allowed:g} kg with its {tool.mass:g} kg mast'
            )
            raise MotionError(ErrorCode.LIMITS_EXCEEDED, msg)

    def _task(self, request: PlaceRequest, site: Site) -> tuple[_Task, float]:
        pick_yaw = _upright_yaw(request.pick, request.box.id, 'pick')
        target = site.frame.to_cell(request.target)
        place_yaw = _upright_yaw(target, request.box.id, 'target')
        size = _metres(request.box.size_mm)
        ex, ey = _extent(size, place_yaw)
        x, y, z = target.position
        base = z - size[2] / 2
        under, name = site.frame.origin[2], f'the floor of bin {site.station}'
        corridor = base
        for one in site.standing:
            if one.low[0] < x + ex and one.high[0] > x - ex:
                if one.low[1] < y + ey and one.high[1] > y - ey and one.high[2] > under:
                    under, name = one.high[2], f'box {one.box_id}'
                # What lies between the open front of a roller cage and the target.
                if (one.low[1] < y + ey) if y > 0 else (one.high[1] > y - ey):
                    corridor = max(corridor, one.high[2])
        if under > base + _HIGHEST:
            msg = (
                f'box {request.box.id}: {name} stands {1000 * (under - base):.0f} mm '
                'above where its base is to be'
            )
            raise MotionError(ErrorCode.PATH_IN_COLLISION, msg)
        release_z = max(under, base - _LOWEST) + DROP
        place = (x, y, release_z + size[2])
        pick = (
            request.pick.position[0],
            request.pick.position[1],
            request.pick.position[2] + size[2] / 2,
        )
        tops = [pose.position[2] + box.size_mm[2] / 2000 for box, pose in request.belt]
        top = max([site.frame.origin[2], *(one.high[2] for one in site.standing)])
        walled = site.spec.name not in NO_WALLS | OPEN_FRONT
        rim = max(top, site.frame.origin[2] + site.spec.size_mm[2] / 1000 if walled else 0.0)
        belt_top = self.kinematics.layout.conveyor.top_z
        low = max(rim if walled else max(top, release_z), belt_top + CLEAR) + CLEAR
        high = max([low, *(tall + CLEAR for tall in tops)])
        heights = tuple(sorted({low + size[2], high + size[2], high + 0.25 + size[2]}))
        front = None
        if site.spec.name in OPEN_FRONT:
            inward = 1.0 if y > 0 else -1.0
            front = site.frame.origin[1] - inward * (ey + 0.06)
            heights = tuple(
                sorted({max(corridor, belt_top + CLEAR) + CLEAR + size[2], high + size[2]})
            )
        return _Task(
            pick=pick,
            place=place,
            pick_yaw=pick_yaw,
            turn=place_yaw - pick_yaw,
            size=size,
            symmetric=request.box.com_offset_mm[:2] == (0.0, 0.0),
            hover=self.hover(tops),
            swing_heights=heights,
            retreat_height=max(rim, place[2]) + 0.06,
            front_y=front,
            entry_height=max(corridor, release_z) + CLEAR + size[2],
        ), release_z

    def _candidates(self, task: _Task, start: Array, tool: Array) -> list[_Candidate]:
        rail = self.kinematics.layout.rail
        offsets = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0, 1.25, -1.25)
        branch = self._branch(start)
        options = []
        for offset in offsets:
            place_rail = _clip(task.place[0] + offset, rail.x_min, rail.x_max)
            near = _clip(place_rail - task.pick[0], -0.5, 0.5)
            for pick_rail in {float(start[0]), _clip(task.pick[0] + near, rail.x_min, rail.x_max)}:
                options.append((pick_rail, place_rail))
        options = sorted(set(options))
        swing = task.swing_heights[0]
        rows = []
        for pick_rail, place_rail in options:
            lifted = (task.pick[0], task.pick[1], swing)
            over = (task.place[0], task.place[1], swing)
            rows += [(pick_rail, task.pick), (pick_rail, lifted), (place_rail, over)]
            rows += [(place_rail, task.place), (pick_rail, task.hover)]
        rails = np.array([one for one, _ in rows])
        points = np.array([point for _, point in rows])
        q = self.kinematics.tool_down(rails, points, np.zeros(len(rows)))[:, branch]
        legs = q.reshape(len(options), 5, 7)
        found = []
        for (pick_rail, place_rail), leg in zip(options, legs, strict=True):
            if np.isnan(leg).any():
                continue
            pick, lifted, over, place, hover = leg
            estimate = GRIP_S + RELEASE_S + 0.75 * (
                self._least(start, pick)
                + self._least(pick, lifted)
                + self._least(lifted, over)
                + 2 * self._least(over, place)
                + self._least(over, hover)
            )
            found.append(_Candidate(estimate, pick_rail, place_rail, swing, 0.0))
        found.sort(key=lambda one: one.estimate)
        # First the lowest swing everywhere, then higher ones, then round the other side.
        more = [
            replace(one, swing=height, around=around)
            for around in (0.0, 2 * math.pi, -2 * math.pi)
            for height in task.swing_heights
            for one in found[: 4 if around == 0 else 2]
            if (height, around) != (swing, 0.0)
        ]
        return found[:4] + more

    def _least(self, one: Array, other: Array) -> float:
        """Least seconds between two configurations at rest, without the last joint."""
        way = np.abs((other - one)[:6])
        way[1:] = np.minimum(way[1:], np.abs(2 * math.pi - way[1:]))
        speed, acceleration = self.timing.max_speed[:6], self.timing.max_acceleration[:6]
        ramp = speed * speed / acceleration
        seconds = np.where(
            way > ramp, way / speed + speed / acceleration, 2 * np.sqrt(way / acceleration)
        )
        return float(seconds.max())

    def _branch(self, start: Array) -> int:
        tool = self.kinematics.tool(start)[0]
        yaw = math.atan2(tool[1, 0], tool[0, 0])
        solutions = self.kinematics.tool_down([start[0]], [tool[:3, 3]], [yaw])[0]
        away = np.abs((solutions - start + math.pi) % (2 * math.pi) - math.pi).max(axis=1)
        if np.isnan(away).all() or np.nanmin(away) > 0.1:
            msg = 'the arm stands where no branch of its kinematics does; move it by hand'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        return int(np.nanargmin(away))

    def _paths(
        self, task: _Task, candidate: _Candidate, start: Array, tool: Array, corner: float
    ) -> list[JointPath] | None:
        """Joint paths of approach, carry and retreat, or ``None`` when a joint cannot follow."""
        branch = self._branch(start)
        legs = _legs(task, candidate, start, tool, self.kinematics.arm.d4, BRANCHES[branch][0])
        paths: list[JointPath] = []
        at = start
        for leg in legs:
            path = joint_path(self.kinematics, rounded(leg, corner, PATH_STEP), branch)
            follows = None if path is None else starting_at(path, at)
            if follows is None:
                return None
            paths.append(follows)
            at = follows.q[-1]
        return paths

    def _timed(self, paths: list[JointPath], load: Load) -> list[Trajectory] | None:
        trajectories = []
        for path, carried in zip(paths, (None, load, None), strict=True):
            timed = self.timing.trajectory(path.q, carried, self._period)
            if timed is None:
                return None
            trajectories.append(timed)
        return trajectories

    def _collision(
        self, request: PlaceRequest, task: _Task, paths: Sequence[JointPath]
    ) -> str | None:
        """What the three paths touch first: the carry with the box, the others past it."""
        approach, carry, retreat = paths
        world = self._world
        hit = world.first_hit(carry, task.pick_yaw - float(carry.yaw[0]))
        if hit is not None:
            return hit
        for path, name, top, yaw in (
            (approach, _at_pick(request), task.pick, task.pick_yaw),
            (retreat, _at_place(request), task.place, task.pick_yaw + task.turn),
        ):
            lowered = (top[0], top[1], top[2] - task.size[2] / 2 - BOX_SKIN)
            world.set_box(name, task.size, Pose(lowered, _yaw_quaternion(yaw)))
            hit = world.first_hit(path)
            world.remove(name)
            if hit is not None:
                return hit
        return None

    def _sampled(self, trajectory: Trajectory) -> JointPath:
        every = max(1, int(CHECK_PERIOD / self._period))
        q = np.vstack([trajectory.q[::every], trajectory.q[-1:]])
        tool = self.kinematics.tool(q)
        return JointPath(q, tool[:, :3, 3], np.arctan2(tool[:, 1, 0], tool[:, 0, 0]))

    def _motion(
        self,
        task: _Task,
        trajectories: list[Trajectory],
        carry_path: JointPath,
        release_z: float,
    ) -> PlannedMotion:
        approach, carry, retreat = trajectories
        tcp = self.kinematics.tool(carry.q)[:, :3, 3]
        away = np.hypot(tcp[:, 0] - task.place[0], tcp[:, 1] - task.place[1])
        lowering = int(np.nonzero(away > 0.01)[0].max(initial=0))
        return PlannedMotion(
            approach, carry, retreat, float(carry.times[lowering]), carry_path, release_z
        )


def _legs(
    task: _Task, candidate: _Candidate, start: Array, tool: Array, d4: float, shoulder: int
) -> tuple[list[Waypoint], list[Waypoint], list[Waypoint]]:
    """Waypoints of approach, carry and retreat."""
    pick_rail, place_rail = candidate.pick_rail, candidate.place_rail
    start_yaw = math.atan2(tool[1, 0], tool[0, 0])
    begin = waypoint(float(start[0]), tool[:3, 3], start_yaw, math.pi / 2)
    # The first joint is this far ahead of theta.
    def turn_of(point: Waypoint) -> float:
        return point[1] + shoulder * math.acos(d4 / point[2])

    grip_yaw = _nearest(task.pick_yaw, start_yaw, math.pi / 2)
    grip = waypoint(pick_rail, task.pick, grip_yaw, begin[1])
    place = waypoint(place_rail, task.place, 0.0, grip[1])
    place = (place[0], place[1] + candidate.around, *place[2:])
    # The last joint turns by what the first turns less what the box turns: keep that small.
    period = math.pi if task.symmetric else 2 * math.pi
    place_yaw = _nearest(grip_yaw + task.turn, grip_yaw + turn_of(place) - turn_of(grip), period)
    place = (*place[:4], place_yaw)
    hover = waypoint(pick_rail, task.hover, 0.0, grip[1])
    # Back above the pick point with the last joint near its middle.
    middle = start_yaw + float(start[6]) + turn_of(hover) - turn_of(begin)
    hover = (*hover[:4], _nearest(task.pick_yaw, middle, math.pi / 2))

    def at(point: Waypoint, height: float) -> Waypoint:
        return (point[0], point[1], point[2], height, point[4])

    above = max(task.pick[2] + CLEAR, min(begin[3], task.pick[2] + 0.15))
    approach = [begin, at(grip, above), grip]
    moved = math.dist(tool[:2, 3], task.pick[:2])
    if moved > 0.5 or begin[3] < task.pick[2] + CLEAR:
        safe = max(begin[3], task.retreat_height, task.hover[2])
        approach = [begin, at(begin, safe), at(grip, safe), grip]
    swing = candidate.swing
    rise = max(task.retreat_height, place[3] + CLEAR)
    carry = [grip, at(grip, swing), at(place, swing), place]
    retreat = [place, at(place, rise), hover]
    if task.front_y is not None:
        carry, retreat = _through_front(task, grip, place, hover, swing)
    return approach, carry, retreat


def _through_front(
    task: _Task, grip: Waypoint, place: Waypoint, hover: Waypoint, swing: float
) -> tuple[list[Waypoint], list[Waypoint]]:
    """Carry and retreat through the open front of a roller cage, above what stands in it."""
    assert task.front_y is not None
    entry, clear = task.entry_height, task.place[2] + 0.03
    leave = max(entry - task.size[2], clear)
    carry, retreat = [grip, (*grip[:3], swing, grip[4])], [place, (*place[:3], leave, place[4])]
    # Along a line in front of the cage; straight in x and y, so several points.
    before = task.pick if task.pick[1] * task.place[1] > 0 else task.place
    line, back = [], []
    for share in np.linspace(0.0, 1.0, 9):
        x = before[0] + (task.place[0] - before[0]) * share
        rail = grip[0] + (place[0] - grip[0]) * share
        yaw = grip[4] + (place[4] - grip[4]) * share
        near = line[-1][1] if line else grip[1]
        line.append(waypoint(rail, (x, task.front_y, max(swing, entry)), yaw, near))
        back.append((*line[-1][:3], max(leave, task.hover[2]), place[4]))
    inner = (place[0], place[1], place[2], entry, place[4])
    carry += [*line, (*line[-1][:3], entry, place[4]), inner, place]
    retreat += [(*line[-1][:3], leave, place[4]), *reversed(back), hover]
    return carry, retreat


def reversed_path(path: JointPath, q: Array) -> JointPath:
    """The part of ``path`` already travelled at ``q`` (7,), backwards from there to its start."""
    nearest = int(np.abs(path.q - q).sum(axis=1).argmin())
    back = path.q[max(nearest - 1, 0) :: -1]
    if np.abs(back[0] - q).max() > 1e-6:
        back = np.vstack([q, back])
    return JointPath(back, np.zeros((len(back), 3)), np.zeros(len(back)))


def _upright_yaw(pose: Pose, box_id: str, what: str) -> float:
    x, y, z, w = pose.quaternion
    if math.hypot(x, y) > 0.01:
        msg = (
            f'box {box_id}: the {what} quaternion ({x:.3f}, {y:.3f}, {z:.3f}, {w:.3f}) tips the box '
            'over; this arm picks from above only, so a box can only turn about the vertical'
        )
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    return 2 * math.atan2(z, w)


def _extent(size: Vec3, yaw: float) -> tuple[float, float]:
    """Half extents along x and y of a box turned by ``yaw``."""
    cosine, sine = abs(math.cos(yaw)), abs(math.sin(yaw))
    return (cosine * size[0] + sine * size[1]) / 2, (sine * size[0] + cosine * size[1]) / 2


def _nearest(angle: float, wanted: float, period: float) -> float:
    return angle + period * round((wanted - angle) / period)


def _clip(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))


def _yaw_quaternion(yaw: float) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def _at_pick(request: PlaceRequest) -> str:
    return f'box {request.box.id} at the pick point'


def _at_place(request: PlaceRequest) -> str:
    return f'box {request.box.id} in place'


def _metres(values_mm: Vec3) -> Vec3:
    x, y, z = values_mm
    return (x / 1000, y / 1000, z / 1000)
