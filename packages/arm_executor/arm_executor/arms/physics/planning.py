"""Planning of the physics arm: from what is asked for to trajectories that touch nothing.

Nothing moves here. What may stand in the way is what :class:`StandingBins` shows, and the boxes
on the belt that the request names.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.physics.driver import ArmDriver
from arm_executor.arms.physics.gripper import SuctionGripper
from arm_executor.arms.physics.standing_bins import StandingBin, StandingBins
from arm_executor.arms.physics.world import STEP_S
from arm_executor.model.arm_interface import MotionError, MotionPlan, MotionUnderWay, PlaceRequest
from arm_executor.model.layout import Tool
from arm_executor.model.suction import check_grip
from arm_executor.motion.grasp import as_lying
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.predictor import MotionPredictor
from arm_executor.motion.timing import Load, Trajectory
from arm_executor.motion.way_back import WITH_CARE
from pack_msgs_py.codes import ErrorCode

Array = NDArray[np.float64]


class PhysicsPlanning:
    """Makes plans whose ``detail`` is a :class:`~arm_executor.motion.planned.PlannedMotion`.

    Safe to use from two threads: planning and the bins share one lock, ``bins.lock``.

    Parameters
    ----------
    motions, predictor : find motions between configurations, and predict what is found.
    bins : what stands in the cell.
    driver, gripper : where the arm is, and whether its pad is free.
    tool : the suction mast, which must hold the box.
    """

    def __init__(
        self,
        motions: MotionPlanner,
        predictor: MotionPredictor,
        bins: StandingBins,
        driver: ArmDriver,
        gripper: SuctionGripper,
        tool: Tool,
    ) -> None:
        self.motions = motions
        self._predictor = predictor
        self._bins = bins
        self._driver = driver
        self._gripper = gripper
        self._tool = tool

    def plan(self, request: PlaceRequest) -> MotionPlan:
        """Plan from where the arm is.

        Raises
        ------
        MotionError
            There is no motion, no bin at the station, or a box in the gripper.
        """
        begun_s = time.perf_counter()
        return _plan(request, self._from_now(request, self.motions), begun_s)

    def plan_after(self, request: PlaceRequest, first: MotionUnderWay) -> MotionPlan:
        """Plan from where ``first`` ends, with its box in its bin; raises as :meth:`plan` does."""
        begun_s = time.perf_counter()
        return _plan(request, self._from_after(request, first, self.motions), begun_s)

    def predict(self, request: PlaceRequest, after: MotionUnderWay | None) -> float:
        """Robot time that planning most probably finds, seconds; raises as :meth:`plan` does."""
        if after is None:
            return self._from_now(request, self._predictor).duration
        return self._from_after(request, after, self._predictor).duration

    def _from_now(self, request: PlaceRequest, motions: MotionPlanner) -> PlannedMotion:
        with self._bins.lock:
            target = self._target(request)
            if self._gripper.box_id is not None:
                msg = f'the arm still holds box {self._gripper.box_id}; return it to the belt first'
                raise MotionError(ErrorCode.START_STATE_INVALID, msg)
            check_grip(self._tool, as_lying(request).box)
            return motions.plan(request, self._driver.commanded, self._bins.site(target))

    def _from_after(
        self, request: PlaceRequest, first: MotionUnderWay, motions: MotionPlanner
    ) -> PlannedMotion:
        with self._bins.lock:
            target = self._target(request)
            start: Array = first.plan.detail.retreat.q[-1]
            with self._bins.expecting(target, first) as site:
                return motions.plan(request, start, site)

    def _target(self, request: PlaceRequest) -> StandingBin:
        target = self._bins.find(request.station)
        if target is None:
            msg = f'no bin stands at station {request.station!r}; open one there first'
            raise MotionError(ErrorCode.INVALID_GOAL, msg)
        return target

    def timed(self, path: Array, load: Load | None) -> Trajectory | None:
        """A trajectory back along ``path`` (n, 7), if there is one; it is not checked.

        The fastest one with an empty gripper; a box that is brought back is set down gently.
        """
        share = 1.0 if load is None else WITH_CARE
        with self._bins.lock:
            return self.motions.timing.trajectory(path, load, STEP_S, share=share)


def _plan(request: PlaceRequest, motion: PlannedMotion, begun_s: float) -> MotionPlan:
    return MotionPlan(
        request,
        motion.duration,
        time.perf_counter() - begun_s,
        motion,
        after_pick_s=motion.duration_after_pick,
    )
