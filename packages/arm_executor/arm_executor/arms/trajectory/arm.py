"""The arm `trajectory`: plans as the physics arm does, and has a driver execute it.

Nothing here knows ROS: :mod:`arm_executor.arms.trajectory.link` says what is asked of the robot.
It has no eyes. Where a box came to rest is where the measured joints let go of it, and the other
boxes are where they were put; docs/real_arm.md says what that means.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio
from numpy.typing import NDArray

from arm_executor.arms.kind import ArmSetup
from arm_executor.arms.known_bins import KnownBins
from arm_executor.arms.trajectory.following import Follower
from arm_executor.arms.trajectory.link import RobotLink
from arm_executor.arms.trajectory.parameters import USUAL_JERK, TrajectoryParameters
from arm_executor.arms.trajectory.planning import KnownPlanning
from arm_executor.arms.trajectory.run import RobotRun
from arm_executor.model.arm_interface import (
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
    MotionUnderWay,
    PlaceRequest,
)
from arm_executor.model.layout import Layout, LayoutError, bin_frame, check_layout
from arm_executor.motion.grasp import as_taken, by_front
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.stances import GRIP_S, RELEASE_S
from arm_executor.motion.timing import Load, MotionLimits
from arm_executor.motion.way_back import Leg, reversed_path, ways_out
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose, folded, metres, rotation_matrix
from pack_msgs_py.values import Bin, Vec3

Array = NDArray[np.float64]

#: The input of the vacuum is looked at this often, wall-clock seconds.
_LOOK_S = 0.005
#: The arm need not move to where it is already, radians and metres of its joints.
_THERE = 2e-3


@dataclass(frozen=True)
class TakenBox:
    """The box in the gripper: its id, its pose in the pad's frame, what it weighs, its motion."""

    box_id: str
    in_pad: Array
    load: Load
    motion: PlannedMotion


class TrajectoryArm:
    """An :class:`~arm_executor.model.arm_interface.Arm` that moves a robot by ``setup.link``.

    Raises
    ------
    LayoutError
        The layout has a rail, and no controller moves it.
    MotionError
        The robot or its driver is not there.
    ValueError
        There is no link, or it cannot run at this ``speed``.
    """

    def __init__(self, setup: ArmSetup) -> None:
        if setup.link is None:
            msg = 'arm trajectory needs the link of a node: start it by arm_executor'
            raise ValueError(msg)
        if setup.speed <= 0:
            msg = (
                'arm trajectory moves a robot, which runs at its own speed: give speed 1 '
                '(cell run --speed 1); 0 is for arms that only exist here'
            )
            raise ValueError(msg)
        self._own: TrajectoryParameters = setup.parameters or TrajectoryParameters()
        self._layout = check_layout(setup.layout, {})
        self._speed = setup.speed
        _check_rail(self._layout, self._own)
        self._link: RobotLink = setup.link
        self._link.connect()
        if self._link.vacuum_holds():
            msg = (
                'the vacuum holds something, and no book says what: take it off by hand, switch '
                'the vacuum off at the driver, and start again'
            )
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        self._bins = KnownBins()
        jerk = USUAL_JERK if setup.joint_jerk is None else setup.joint_jerk
        self._planning = KnownPlanning(
            self._layout,
            MotionLimits(joint_jerk=jerk),
            self._own.point_period_s,
            self._bins,
            self._pace,
        )
        self._follower = Follower(
            self._link,
            self._planning.motions.timing,
            self._own.start_tolerance,
            ramps=self._own.stop_by == 'ramp',
        )
        self._taken: TakenBox | None = None
        # The motion that is under way or ended early, and where in it the arm is.
        self._under_way: tuple[PlannedMotion, Leg] | None = None
        # A driver takes it only while the robot runs, which it need not at the start.
        self._payload_told = False

    # -- see arm_executor.model.arm_interface ----------------------------------------------------

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Every box is believed to be where ``poses`` says."""
        box_ids = {placed.box.id for bin_ in bins for placed in bin_.boxes}
        if self._taken is not None and self._taken.box_id in box_ids:
            self._taken = None
        return self._bins.set_bins(bins, poses)

    def plan(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> MotionPlan:
        """See :meth:`arm_executor.model.arm_interface.Arm.plan`."""
        return self._planning.plan(request, self._start(after), after)

    def predict(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> float:
        """See :meth:`arm_executor.model.arm_interface.PredictingArm.predict`."""
        return self._planning.predict(request, self._start(after), after)

    def _start(self, after: MotionUnderWay | None) -> Array:
        if after is not None:
            end: Array = after.plan.detail.retreat.q[-1]
            return end
        if self._taken is not None:
            msg = f'the arm still holds box {self._taken.box_id}; return it to the belt first'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        return self._follower.commanded

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """See :meth:`arm_executor.model.arm_interface.Arm.execute`."""
        motion: PlannedMotion = plan.detail
        request = plan.request
        if self._bins.spec(request.station) is None:
            msg = f'the bin at station {request.station!r} has gone since this was planned'
            return MotionResult(ErrorCode.INVALID_GOAL, msg)
        trouble = self._link.trouble()
        if trouble:
            return MotionResult(ErrorCode.PROTECTIVE_STOP, trouble)
        run = RobotRun(plan, hooks, stop, self._speed)
        others = dict(self._bins.poses[request.station])
        placed: Pose | None = None
        code, text = ErrorCode.NONE, ''
        try:
            astray = self._follower.astray(motion.approach.q[0])
            if astray:
                return MotionResult(ErrorCode.START_STATE_INVALID, astray)
            if not self._payload_told:
                self._set_payload(None)
            self._bring(run, motion)
            placed = self._let_go(run, motion)
            self._retreat(run, motion)
        except MotionError as error:
            code, text = error.code, str(error)
        if code is ErrorCode.BOX_LOST:
            self._forget_box()
        return run.result(code, text, placed or self._placed_by(run), others)

    def _bring(self, run: RobotRun, motion: PlannedMotion) -> None:
        """Take the box, and carry it to its place."""
        self._under_way = motion, Leg.APPROACH
        self._follower.follow(motion.approach, run, [(0.0, Phase.APPROACHING)])
        done_s = self._planning.as_run(motion, motion.approach.duration)
        self._grasp(run, motion, done_s)
        done_s += GRIP_S
        self._under_way = motion, Leg.CARRY
        lowering = (motion.lowering_s, Phase.LOWERING)
        self._follower.follow(
            motion.carry,
            run,
            [(0.0, Phase.TRANSFERRING), lowering],
            done_s=done_s,
            load=self._load(),
        )

    def _grasp(self, run: RobotRun, motion: PlannedMotion, done_s: float) -> None:
        request = run.plan.request
        taken = as_taken(request)
        run.enter(Phase.GRASPING, done_s)
        pick = np.linalg.inv(self._pad(self._link.positions())) @ _matrix(request.pick)
        self._link.set_vacuum(on=True)
        if not self._waited(run, self._link.vacuum_holds, self._own.grip_timeout_s):
            self._link.set_vacuum(on=False)
            if run.stop.is_set():
                raise MotionError(ErrorCode.CANCELED, 'the motion was stopped on request')
            msg = (
                f'box {request.box.id}: no vacuum builds up within {self._own.grip_timeout_s:g} s; '
                'look whether it lies where it was scanned, and at the pad'
            )
            raise MotionError(ErrorCode.GRASP_FAILED, msg)
        size, offset = metres(taken.box.size_mm), metres(taken.box.com_offset_mm)
        load = Load(request.box.weight_kg, size, offset, by_front(request))
        self._taken = TakenBox(request.box.id, pick, load, motion)
        run.hooks.picked()
        self._set_payload(load)

    def _waited(self, run: RobotRun | None, done: Callable[[], bool], timeout_s: float) -> bool:
        """Whether ``done`` becomes true within ``timeout_s`` of robot time; not after a stop."""
        until = time.monotonic() + timeout_s / self._speed
        while not done():
            if time.monotonic() > until or (run is not None and run.stop.is_set()):
                return False
            time.sleep(_LOOK_S)
        return True

    def _let_go(self, run: RobotRun, motion: PlannedMotion) -> Pose:
        """The box is the bin's from here on; where it is, bin frame."""
        request, done_s = run.plan.request, motion.approach.duration + GRIP_S
        run.enter(Phase.RELEASING, done_s + motion.carry.duration)
        if run.stop.is_set():
            raise MotionError(ErrorCode.CANCELED, 'the motion was stopped on request')
        assert self._taken is not None
        in_cell = _pose(self._pad(self._link.positions()) @ self._taken.in_pad)
        spec = self._bins.spec(request.station)
        assert spec is not None
        frame = bin_frame(self._layout, request.station, spec)
        placed = folded(frame.from_cell(in_cell), request.target)
        run.hooks.releasing()
        self._release()
        self._bins.place(request.station, request.box, placed)
        run.hooks.released()
        self._under_way = motion, Leg.RETREAT
        self._set_payload(None)
        return placed

    def _release(self) -> None:
        """The pad lets go; ``MotionError`` when it does not."""
        self._link.set_vacuum(on=False)
        timeout_s = self._own.release_timeout_s
        if not self._waited(None, lambda: not self._link.vacuum_holds(), timeout_s):
            msg = (
                f'the vacuum was switched off, but still holds after {timeout_s:g} s; '
                'look at valve and pad before the arm moves on'
            )
            raise MotionError(ErrorCode.PROTECTIVE_STOP, msg)
        self._taken = None

    def _retreat(self, run: RobotRun, motion: PlannedMotion) -> None:
        done_s = motion.approach.duration + motion.carry.duration + GRIP_S + RELEASE_S
        self._follower.follow(motion.retreat, run, [(0.0, Phase.RETREATING)], done_s=done_s)
        self._under_way = None

    def _placed_by(self, run: RobotRun) -> Pose | None:
        """Where the box of ``run`` is in its bin, when the pad has let go there."""
        request = run.plan.request
        return self._bins.poses[request.station].get(request.box.id)

    def return_to_belt(self) -> bool:
        """Back along the path it came, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        taken = self._taken
        if taken is None:
            return False
        back = reversed_path(taken.motion.carry_path, self._follower.commanded)
        timed = self._planning.timed(back, taken.load)
        if timed is None:
            msg = f'no way back is within the limits of the arm with box {taken.box_id}'
            raise MotionError(ErrorCode.LIMITS_EXCEEDED, msg)
        self._check_rest()
        try:
            self._follower.follow(timed, load=taken.load)
        except MotionError as error:
            if error.code is ErrorCode.BOX_LOST:
                self._forget_box()
            raise MotionError(error.code, f'on the way back: {error}') from error
        self._release()
        self._set_payload(None)
        if self._under_way is not None:
            self._under_way = self._under_way[0], Leg.APPROACH
        return True

    def withdraw(self) -> bool:
        """Along a way checked before, see :meth:`~arm_executor.model.arm_interface.Arm`."""
        if self._under_way is None:
            return True
        if self._taken is not None:
            return False
        try:
            self._check_rest()
            for path in ways_out(*self._under_way, self._follower.commanded)[0]:
                if np.abs(path[-1] - self._follower.commanded).max() < _THERE:
                    continue
                timed = self._planning.timed(path, None)
                if timed is None:
                    return False
                self._follower.follow(timed)
        except MotionError:
            return False
        self._under_way = None
        return True

    def _check_rest(self) -> None:
        """``MotionError`` when the robot cannot move; where it was pushed meanwhile is taken in."""
        trouble = self._link.trouble()
        if trouble:
            raise MotionError(ErrorCode.PROTECTIVE_STOP, trouble)
        self._follower.astray(self._follower.commanded)

    def holds(self) -> str | None:
        """See :meth:`arm_executor.model.arm_interface.Arm.holds`."""
        return None if self._taken is None else self._taken.box_id

    def trouble(self) -> str:
        """See :meth:`arm_executor.model.arm_interface.WatchedArm.trouble`."""
        return self._link.trouble()

    def tracking_error(self) -> float:
        """The controller watches its own."""
        return 0.0

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """The driver publishes them."""
        return (), ()

    def close(self) -> None:
        """See :meth:`arm_executor.model.arm_interface.Arm.close`."""
        self._planning.close()

    # -- what hangs on the flange ---------------------------------------------------------------

    def _pace(self) -> float:
        return self._link.speed_scaling()

    def _load(self) -> Load | None:
        return None if self._taken is None else self._taken.load

    def _forget_box(self) -> None:
        self._taken = None
        try:
            self._link.set_vacuum(on=False)
            self._set_payload(None)
        except MotionError:
            # The driver is in trouble, which is told of anyway.
            return

    def _set_payload(self, load: Load | None) -> None:
        """Mast, and what hangs below its pad; its z points from flange to pad."""
        tool = self._layout.tool
        mass, (x, y, z) = tool.mass, (0.0, 0.0, tool.length / 2)
        if load is not None:
            below = tool.length + load.size[2] / 2 - load.com_offset[2]
            whole = mass + load.mass
            x, y = (
                load.mass * load.com_offset[0] / whole,
                -load.mass * load.com_offset[1] / whole,
            )
            z = (mass * z + load.mass * below) / whole
            mass = whole
        centre: Vec3 = (x, y, z)
        self._payload_told = False
        self._link.set_payload(mass, centre)
        self._payload_told = True

    def _pad(self, q: Array) -> Array:
        pose: Array = self._planning.motions.kinematics.tool(q)[0]
        return pose


def _check_rail(layout: Layout, own: TrajectoryParameters) -> None:
    if layout.rail.fixed or own.rail_controller:
        return
    msg = (
        f'the layout has a rail from {layout.rail.x_min:g} to {layout.rail.x_max:g} m and no '
        'trajectory.rail_controller moves it: name one, or give rail.x_min and rail.x_max the same '
        'value, which is where the arm stands'
    )
    raise LayoutError(msg)


def _matrix(pose: Pose) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(pose.quaternion)
    matrix[:3, 3] = pose.position
    return matrix


def _pose(matrix: Array) -> Pose:
    """Position and unit quaternion of a homogeneous matrix (4, 4)."""
    qx, qy, qz, qw = (float(value) for value in pinocchio.Quaternion(matrix[:3, :3]).coeffs())
    x, y, z = (float(value) for value in matrix[:3, 3])
    return Pose((x, y, z), (qx, qy, qz, qw))
