"""Timing: the fastest way along a path within speed, acceleration, torque and suction limits.

Time-optimal path parametrisation by reachability analysis (Pham and Pham, 2018) from `toppra`,
rigid body dynamics of arm and load from `pinocchio`. Jerk is limited on request
(:mod:`arm_executor.motion.jerk`).
"""

from __future__ import annotations

import logging
import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio
import toppra
from numpy.typing import NDArray
from toppra import algorithm, constraint

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.model.suction import LEAST_ACCELERATION, holding_limits, tool_acceleration_limit
from arm_executor.model.urdf import cell_urdf
from arm_executor.motion.jerk import Pace, joint_motion, smoothed
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

toppra.setup_logging('ERROR')
logging.getLogger('toppra').setLevel(logging.ERROR)

_KEPT_LOADS = 8
_COLLOCATION = constraint.DiscretizationType.Collocation
#: Spacing of the check of the result, seconds; a result that needs more stretching is no good.
_PROBE, _MAX_STRETCH = 0.005, 2.0
#: Grid points of the parametrisation for each sample of the path, and the least and most.
_GRID_SHARE, _GRID_MIN, _GRID_MAX = 1.0, 40, 160
#: With more stretching than this it is tried once more with so many times the grid points: at a
#: sharp corner limits are passed between two points, and all of the motion would pay for it.
_STRETCHED, _FINER = 1.02, 3


@dataclass(frozen=True)
class MotionLimits:
    """Limits that no data sheet publishes; assumed, and so parameters.

    Attributes
    ----------
    joint_acceleration : of the first three joints, rad/s2; the wrists may do twice as much.
    tool_acceleration : of the pad with a box on it, m/s2, any horizontal direction, and vertical.
    empty_tool_factor : how much more the empty pad may do.
    joint_jerk : of the first three joints, rad/s3, in proportion of the others; 0 for no limit.
    torque_share : share of the maximum torque that motion may use; the rest is for tracking.
    """

    joint_acceleration: float = 5.0
    tool_acceleration: float = 5.0
    empty_tool_factor: float = 2.0
    joint_jerk: float = 0.0
    torque_share: float = 0.9


@dataclass(frozen=True)
class Load:
    """What hangs on the pad: mass in kg, size in metres, centre of mass off the box's centre.

    ``tilts`` is whether the pad tilts with it on, so that gravity pulls across the pad too.
    """

    mass: float
    size: Vec3
    com_offset: Vec3 = (0.0, 0.0, 0.0)
    tilts: bool = False


@dataclass(frozen=True)
class Trajectory:
    """A timed path: ``q``, ``qd`` (n, 7) at ``times`` (n,), from rest to rest; seconds."""

    times: Array
    q: Array
    qd: Array
    qdd: Array

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return float(self.times[-1])


def joined(pieces: Sequence[Trajectory]) -> Trajectory:
    """One trajectory of several, each from where the one before came to rest."""
    whole = pieces[0]
    for piece in pieces[1:]:
        whole = Trajectory(
            np.r_[whole.times, whole.duration + piece.times[1:]],
            np.vstack([whole.q, piece.q[1:]]),
            np.vstack([whole.qd, piece.qd[1:]]),
            np.vstack([whole.qdd, piece.qdd[1:]]),
        )
    return whole


class Timing:
    """Turns joint paths into trajectories for one arm in one cell."""

    def __init__(self, robot: RobotModel, layout: Layout, limits: MotionLimits) -> None:
        self.limits = limits
        self._tool = layout.tool
        self.kinematics = CellKinematics(robot, layout)
        self._model = pinocchio.buildModelFromXML(cell_urdf(robot, layout))
        self._loaded: OrderedDict[Load | None, _Loaded] = OrderedDict()
        rail = layout.rail
        acceleration = limits.joint_acceleration * np.array([1, 1, 1, 2, 2, 2])
        self.max_speed: Array = np.r_[rail.speed, robot.max_speed]
        self.max_acceleration: Array = np.r_[rail.acceleration, acceleration]
        # Every joint comes to its greatest acceleration in the same time.
        self.ramp_s = limits.joint_acceleration / limits.joint_jerk if limits.joint_jerk else 0.0
        self.max_jerk: Array | None = self.max_acceleration / self.ramp_s if self.ramp_s else None
        self.max_torque: Array = np.r_[rail.force, robot.max_torque] * limits.torque_share

    def trajectory(
        self, q: Array, load: Load | None, period: float, *, share: float = 1.0
    ) -> Trajectory | None:
        """Fastest trajectory through ``q`` (n, 7), sampled every ``period`` s; ``None`` if none.

        The last sample is the end of the path, at rest. A ``share`` below 1 is that share of the
        fastest pace.
        """
        steps = np.abs(np.diff(q, axis=0)).max(axis=1)
        q = q[np.r_[True, steps > 1e-9]]
        if len(q) < 2:
            # It is there already, as after a stop right above the box that comes next.
            here, still = np.vstack([q, q]), np.zeros((2, q.shape[1]))
            return Trajectory(np.array([0.0, period]), here, still, still)
        # Samples are evenly spaced along a smooth curve: their index is a smooth parameter.
        path = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(q)), q)
        count = int(np.clip(len(q) * _GRID_SHARE, _GRID_MIN, _GRID_MAX))
        found = self._paced(path, load, count)
        if found is None or found[1] > _STRETCHED:
            finer = self._paced(path, load, _FINER * count)
            found = min(filter(None, (found, finer)), key=_seconds, default=None)
        if found is None or found[1] > _MAX_STRETCH:
            return None
        pace, slower = found
        slower /= share
        duration = pace.duration * slower
        samples = max(2, math.ceil(duration / period) + 1)
        times = np.minimum(np.arange(samples) * period, duration)
        q, qd, qdd = joint_motion(path, pace, times / slower)
        return Trajectory(times, q, qd / slower, qdd / slower**2)

    def _paced(
        self, path: toppra.SplineInterpolator, load: Load | None, count: int
    ) -> tuple[Pace, float] | None:
        """The fastest pace along ``path`` on ``count`` points, and how much it is stretched."""
        solver = algorithm.TOPPRA(
            self._loaded_with(load).constraints,
            path,
            parametrizer='ParametrizeConstAccel',
            gridpoints=np.linspace(0.0, 1.0, count),
        )
        accelerations, speeds, _ = solver.compute_parameterization(0.0, 0.0)
        if speeds is None or not np.isfinite(speeds).all():
            return None
        profile = _Profile.made(np.linspace(0.0, 1.0, count), speeds, accelerations)
        if profile is None:
            return None
        pace: Pace = profile
        slower = 1.0
        if self.max_jerk is not None:
            pace, slower = smoothed(path, profile, self.max_jerk)
        return pace, max(slower, self._stretch(pace, path, self._loaded_with(load).model))

    def _stretch(
        self, pace: Pace, path: toppra.SplineInterpolator, model: pinocchio.Model
    ) -> float:
        """How much slower all of it must run, at least 1.

        The limits hold at the grid points; between them they can be passed by a little.
        """
        probe = np.linspace(0.0, pace.duration, max(2, math.ceil(pace.duration / _PROBE)))
        q, qd, qdd = joint_motion(path, pace, probe)
        speed = np.abs(qd / self.max_speed).max()
        acceleration = np.abs(qdd / self.max_acceleration).max()
        data = model.createData()
        still = np.zeros(7)
        rows = range(0, len(probe), 2)
        hold = np.array([pinocchio.rnea(model, data, q[i], still, still) for i in rows])
        move = np.array([pinocchio.rnea(model, data, q[i], qd[i], qdd[i]) for i in rows]) - hold
        # Slower by k, the moving part of the torque shrinks by k squared; the holding part stays.
        room = self.max_torque - np.sign(move) * hold
        torque = (np.abs(move) / np.maximum(room, 1e-3)).max()
        return float(max(1.0, speed, math.sqrt(acceleration), math.sqrt(torque)))

    def torque(self, trajectory: Trajectory, load: Load | None) -> Array:
        """Joint torques (n, 7) that ``trajectory`` takes, N m (N for the rail)."""
        model = self._loaded_with(load).model
        data = model.createData()
        rows = zip(trajectory.q, trajectory.qd, trajectory.qdd, strict=True)
        return np.array([pinocchio.rnea(model, data, *row) for row in rows])

    def torques_along(
        self, q: Array, slope: Array, bend: Array, load: Load | None
    ) -> tuple[Array, Array, Array]:
        """Torques (n, 7) for each unit of acceleration, and of squared speed, and to hold still.

        Along a path of a parameter by which ``q`` (n, 7) has derivatives ``slope`` and ``bend``.
        """
        model = self._loaded_with(load).model
        data, still = model.createData(), np.zeros(7)
        hold = np.array([pinocchio.rnea(model, data, at, still, still) for at in q])
        by_u = [pinocchio.rnea(model, data, *row) for row in zip(q, 0 * q, slope, strict=True)]
        by_x = [pinocchio.rnea(model, data, *row) for row in zip(q, slope, bend, strict=True)]
        return np.array(by_u) - hold, np.array(by_x) - hold, hold

    def _loaded_with(self, load: Load | None) -> _Loaded:
        if load not in self._loaded:
            model = self._model.copy()
            if load is not None:
                frame = model.frames[model.getFrameId('tcp')]
                # Pinocchio 2, which goes with Jazzy's NumPy 1, has the older name only.
                joint = frame.parentJoint if hasattr(frame, 'parentJoint') else frame.parent
                model.inertias[joint] += frame.placement.act(_inertia(load))
            self._loaded[load] = _Loaded(model, self._constraints(model, load))
            if len(self._loaded) > _KEPT_LOADS:
                self._loaded.popitem(last=False)
        self._loaded.move_to_end(load)
        return self._loaded[load]

    def dynamics(self, load: Load | None) -> pinocchio.Model:
        """The arm's rigid body dynamics, empty or with ``load`` on the pad."""
        return self._loaded_with(load).model

    def tool_limits(self, load: Load | None) -> tuple[Array, Array]:
        """What the pad may do, empty or with ``load`` on it: directions (n, 3), and limits (n,).

        Level it is limited in eight directions; between two of them 8 % more gets through.
        """
        most = self.limits.tool_acceleration
        if load is None:
            return _directions([(1.0, 0.0, most * self.limits.empty_tool_factor)])
        held = tool_acceleration_limit(
            self._tool, load.mass, load.size, load.com_offset, tilts=load.tilts
        )
        if load.tilts or held < LEAST_ACCELERATION:
            return _directions([(1.0, 0.0, min(most, max(held, LEAST_ACCELERATION)))])
        rows = [(1.0, 0.0, most)]
        for level, up, limit in holding_limits(self._tool, load.mass, load.size, load.com_offset):
            if level * most + up * most > limit:
                rows.append((level, up, limit))
        return _directions(rows)

    def _constraints(
        self, model: pinocchio.Model, load: Load | None
    ) -> list[constraint.Constraint]:
        data = model.createData()
        frame = model.getFrameId('tcp')

        def torque(position: Array, speed: Array, acceleration: Array) -> Array:
            result: Array = pinocchio.rnea(model, data, position, speed, acceleration)
            return result

        def tool_acceleration(position: Array, speed: Array, acceleration: Array) -> Array:
            pinocchio.forwardKinematics(model, data, position, speed, acceleration)
            result: Array = pinocchio.getFrameClassicalAcceleration(
                model, data, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            ).linear
            return result

        directions, bounds = self.tool_limits(load)
        return [
            constraint.JointVelocityConstraint(_both_ways(self.max_speed)),
            constraint.JointAccelerationConstraint(_both_ways(self.max_acceleration)),
            constraint.JointTorqueConstraint(
                torque, _both_ways(self.max_torque), np.zeros(7), discretization_scheme=_COLLOCATION
            ),
            constraint.SecondOrderConstraint(
                tool_acceleration,
                lambda _: directions,
                lambda _: bounds,
                7,
                discretization_scheme=_COLLOCATION,
            ),
        ]


@dataclass(frozen=True)
class _Loaded:
    """The arm's dynamics with one load, and the limits that follow."""

    model: pinocchio.Model
    constraints: list[constraint.Constraint]


def _inertia(load: Load) -> pinocchio.Inertia:
    """Inertia of a box in the frame of the pad's face."""
    x, y, z = load.size
    box = pinocchio.Inertia.FromBox(load.mass, x, y, z)
    # The tool's z points down: the box's centre is half its height along it.
    lever = np.array([load.com_offset[0], -load.com_offset[1], z / 2 - load.com_offset[2]])
    return pinocchio.Inertia(box.mass, lever, box.inertia)


@dataclass(frozen=True)
class _Profile:
    """Motion along a path's parameter: constant acceleration between grid points."""

    starts: Array
    grid: Array
    speeds: Array
    accelerations: Array

    @staticmethod
    def made(grid: Array, speeds: Array, accelerations: Array) -> _Profile | None:
        """From speeds (n,) at the ``grid`` (n,) and accelerations between; ``None`` if it halts."""
        pace = speeds[1:] + speeds[:-1]
        if (pace <= 1e-9).any():
            return None
        starts = np.r_[0.0, np.cumsum(2 * np.diff(grid) / pace)]
        return _Profile(starts, grid, speeds, accelerations)

    @property
    def duration(self) -> float:
        return float(self.starts[-1])

    def at(self, times: Array) -> tuple[Array, Array, Array]:
        """The path's parameter (n,) at ``times`` (n,), its speed and its acceleration."""
        piece = np.clip(np.searchsorted(self.starts, times, 'right') - 1, 0, len(self.grid) - 2)
        since = times - self.starts[piece]
        acceleration = self.accelerations[piece]
        speed = self.speeds[piece] + acceleration * since
        s = self.grid[piece] + self.speeds[piece] * since + acceleration * since * since / 2
        return np.clip(s, 0.0, 1.0), speed, acceleration


def _seconds(found: tuple[Pace, float]) -> float:
    pace, slower = found
    return pace.duration * slower


def _both_ways(limit: Array) -> Array:
    return np.stack([-limit, limit], axis=1)


def _directions(rows: Sequence[tuple[float, float, float]]) -> tuple[Array, Array]:
    """Rows (level, up, most) for each of eight level directions, and the first's most up and down.

    As matrix (n, 3) and bounds (n,) on accelerations (3,), frame `cell`.
    """
    angles = np.arange(8) * math.pi / 4
    level = np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=1)
    vertical = np.array([0.0, 0.0, 1.0])
    parts = [share * level + up * vertical for share, up, _ in rows]
    bounds = [np.full(8, most) for _, _, most in rows]
    table = np.vstack([*parts, vertical, -vertical])
    return table, np.r_[np.concatenate(bounds), rows[0][2], rows[0][2]]
