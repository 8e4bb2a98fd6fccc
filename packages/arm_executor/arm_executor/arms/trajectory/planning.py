"""Planning of the arm `trajectory`: as the physics arm plans, in a world of what is known."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.known_bins import KnownBins, ShownBins
from arm_executor.model.arm_interface import MotionError, MotionPlan, MotionUnderWay, PlaceRequest
from arm_executor.model.layout import Layout, conveyor_block
from arm_executor.model.robot_data import find_robot
from arm_executor.model.suction import check_grip
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.grasp import as_lying
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.predictor import MotionPredictor
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.timing import Load, MotionLimits, Trajectory
from arm_executor.motion.way_back import WITH_CARE
from pack_msgs_py.codes import ErrorCode

Array = NDArray[np.float64]


class KnownPlanning:
    """Plans and predicts among ``bins``; safe to use from two threads.

    Parameters
    ----------
    layout, limits, period : as for :class:`~arm_executor.motion.planner.MotionPlanner`.
    bins : what stands in the cell.
    pace : share of the planned speed at which the robot runs now; asked for each plan.
    """

    def __init__(
        self,
        layout: Layout,
        limits: MotionLimits,
        period: float,
        bins: KnownBins,
        pace: Callable[[], float],
    ) -> None:
        robot = find_robot(layout.robot)
        self._world = PlanningWorld(robot, layout)
        sketched = QuickWorld(robot, layout)
        for world in (self._world, sketched):
            world.set_block(conveyor_block(layout))
        self._predictor = MotionPredictor(robot, layout, limits, sketched)
        self.motions = MotionPlanner(
            robot, layout, limits, self._world, period, scout=self._predictor
        )
        self._layout, self._period = layout, period
        self._bins, self._pace = bins, pace
        self._shown = ShownBins(layout, self._world, sketched)
        self._lock = threading.RLock()

    def plan(self, request: PlaceRequest, start: Array, after: MotionUnderWay | None) -> MotionPlan:
        """Plan from ``start`` (7,), with the bins as they are when ``after`` has ended.

        Raises
        ------
        MotionError
            There is no such motion, or no bin at the station.
        """
        begun_s = time.perf_counter()
        motion = self._motion(request, start, after, self.motions)
        return MotionPlan(
            request,
            self.as_run(motion, motion.duration),
            time.perf_counter() - begun_s,
            motion,
            after_pick_s=self.as_run(motion, motion.duration_after_pick),
        )

    def predict(self, request: PlaceRequest, start: Array, after: MotionUnderWay | None) -> float:
        """Robot seconds that planning most probably finds; raises as :meth:`plan` does."""
        motion = self._motion(request, start, after, self._predictor)
        return self.as_run(motion, motion.duration)

    def as_run(self, motion: PlannedMotion, seconds: float) -> float:
        """How long ``seconds`` of ``motion`` take at the speed that the robot runs at now."""
        pace = self._pace()
        return seconds if pace >= 1.0 else seconds / max(pace, 0.01)

    def _motion(
        self,
        request: PlaceRequest,
        start: Array,
        after: MotionUnderWay | None,
        motions: MotionPlanner,
    ) -> PlannedMotion:
        check_grip(self._layout.tool, as_lying(request).box)
        with self._lock:
            bins = self._bins.standing(after)
            target = bins.get(request.station)
            if target is None:
                msg = f'no bin stands at station {request.station!r}; open one there first'
                raise MotionError(ErrorCode.INVALID_GOAL, msg)
            self._shown.show(bins)
            return motions.plan(request, start, self._shown.site(request.station, target))

    def timed(self, path: Array, load: Load | None) -> Trajectory | None:
        """A trajectory back along ``path`` (n, 7), if there is one; gentle with a ``load``."""
        share = 1.0 if load is None else WITH_CARE
        with self._lock:
            return self.motions.timing.trajectory(path, load, self._period, share=share)

    def close(self) -> None:
        """End the world."""
        self._world.close()
