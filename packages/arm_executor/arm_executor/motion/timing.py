"""Timing: the fastest way along a path within speed, acceleration, torque and suction limits.

Time-optimal path parametrisation by reachability analysis (Pham and Pham, 2018) from `toppra`,
rigid body dynamics of arm and load from `pinocchio`. The result is not limited in jerk.
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

from arm_executor.layout import Layout
from arm_executor.robot.parameters import ArmModel
from arm_executor.robot.urdf import cell_urdf
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

toppra.setup_logging('ERROR')
logging.getLogger('toppra').setLevel(logging.ERROR)

_COLLOCATION = constraint.DiscretizationType.Collocation
#: Spacing of the check of the result, seconds; a result that needs more stretching is no good.
_PROBE, _MAX_STRETCH = 0.005, 2.0
#: Grid points of the parametrisation for each sample of the path, and the least and most.
_GRID_SHARE, _GRID_MIN, _GRID_MAX = 1.0, 40, 160


@dataclass(frozen=True)
class MotionLimits:
    """Limits that no data sheet publishes; assumed, and so parameters.

    Attributes
    ----------
    joint_acceleration : of the first three joints, rad/s2; the wrists may do twice as much.
    tool_acceleration : of the pad with a box on it, m/s2, any horizontal direction, and vertical.
    empty_tool_factor : how much more the empty pad may do.
    torque_share : share of the maximum torque that motion may use; the rest is for tracking.
    """

    joint_acceleration: float = 5.0
    tool_acceleration: float = 5.0
    empty_tool_factor: float = 2.0
    torque_share: float = 0.9


@dataclass(frozen=True)
class Load:
    """What hangs on the pad: mass in kg, size in metres, centre of mass off the box's centre."""

    mass: float
    size: Vec3
    com_offset: Vec3 = (0.0, 0.0, 0.0)


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

    def __init__(self, arm: ArmModel, layout: Layout, limits: MotionLimits) -> None:
        self.limits = limits
        self._arm_and_layout = (arm, layout)
        self._model = pinocchio.buildModelFromXML(cell_urdf(arm, layout))
        self._loaded: OrderedDict[Load | None, pinocchio.Model] = OrderedDict()
        rail = layout.rail
        acceleration = limits.joint_acceleration * np.array([1, 1, 1, 2, 2, 2])
        self.max_speed: Array = np.r_[rail.speed, arm.max_speed]
        self.max_acceleration: Array = np.r_[rail.acceleration, acceleration]
        self.max_torque: Array = np.r_[rail.force, arm.max_torque] * limits.torque_share

    def trajectory(self, q: Array, load: Load | None, period: float) -> Trajectory | None:
        """Fastest trajectory through ``q`` (n, 7), sampled every ``period`` s; ``None`` if none.

        The last sample is the end of the path, at rest.
        """
        model = self._model_with(load)
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

        steps = np.abs(np.diff(q, axis=0)).max(axis=1)
        q = q[np.r_[True, steps > 1e-9]]
        if len(q) < 2:
            return None
        # Samples are evenly spaced along a smooth curve: their index is a smooth parameter.
        path = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(q)), q)
        count = int(np.clip(len(q) * _GRID_SHARE, _GRID_MIN, _GRID_MAX))
        most = self.limits.tool_acceleration * (self.limits.empty_tool_factor if load is None else 1)
        directions, bounds = _tool_polytope(most)
        constraints = [
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
        solver = algorithm.TOPPRA(
            constraints,
            path,
            parametrizer='ParametrizeConstAccel',
            gridpoints=np.linspace(0.0, 1.0, count),
        )
        timed = solver.compute_trajectory()
        if timed is None or not math.isfinite(timed.duration):
            return None
        # Between grid points the limits can be passed by a little: then all of it runs slower.
        probe = np.linspace(0.0, timed.duration, max(2, math.ceil(timed.duration / _PROBE)))
        speed = np.abs(timed(probe, 1) / self.max_speed).max()
        acceleration = np.abs(timed(probe, 2) / self.max_acceleration).max()
        slower = float(max(1.0, speed, math.sqrt(acceleration)))
        if slower > _MAX_STRETCH:
            return None
        duration = timed.duration * slower
        samples = max(2, math.ceil(duration / period) + 1)
        times = np.minimum(np.arange(samples) * period, duration)
        at = times / slower
        return Trajectory(times, timed(at), timed(at, 1) / slower, timed(at, 2) / slower**2)

    def torque(self, trajectory: Trajectory, load: Load | None) -> Array:
        """Joint torques (n, 7) that ``trajectory`` takes, N m (N for the rail)."""
        model = self._model_with(load)
        data = model.createData()
        rows = zip(trajectory.q, trajectory.qd, trajectory.qdd, strict=True)
        return np.array([pinocchio.rnea(model, data, *row) for row in rows])

    def _model_with(self, load: Load | None) -> pinocchio.Model:
        if load is None:
            return self._model
        if load not in self._loaded:
            model = self._model.copy()
            frame = model.frames[model.getFrameId('tcp')]
            x, y, z = load.size
            box = pinocchio.Inertia.FromBox(load.mass, x, y, z)
            # The tool's z points down: the box's centre is half its height along it.
            lever = np.array([load.com_offset[0], -load.com_offset[1], z / 2 - load.com_offset[2]])
            hung = pinocchio.Inertia(box.mass, lever, box.inertia)
            model.inertias[frame.parentJoint] += frame.placement.act(hung)
            self._loaded[load] = model
            if len(self._loaded) > 8:
                self._loaded.popitem(last=False)
        return self._loaded[load]


def _both_ways(limit: Array) -> Array:
    return np.stack([-limit, limit], axis=1)


def _tool_polytope(most: float) -> tuple[Array, Array]:
    """Eight horizontal directions and both verticals, none above ``most`` m/s2."""
    angles = np.arange(8) * math.pi / 4
    level = np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=1)
    directions = np.vstack([level, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    return directions, np.full(len(directions), most)
