"""An arm and what stands around it, as far as a prediction needs them."""

from __future__ import annotations

import threading
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.known_bins import BinContent, ShownBins
from arm_executor.model.arm_interface import PlaceRequest
from arm_executor.model.layout import Layout, conveyor_block
from arm_executor.model.robot_data import find_robot
from arm_executor.model.suction import check_grip
from arm_executor.motion.grasp import as_lying
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.predictor import MotionPredictor
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.timing import MotionLimits

Array = NDArray[np.float64]


class PredictedCell:
    """Predicts motions in a cell of values; safe to use from several threads.

    Attributes
    ----------
    home : configuration (7,) in which the arm waits for its first motion.

    Raises
    ------
    MotionError
        The arm cannot reach the waiting point above the belt.
    ValueError
        There is no such robot.
    """

    def __init__(self, layout: Layout, limits: MotionLimits | None = None) -> None:
        robot = find_robot(layout.robot)
        self._layout = layout
        self._world = QuickWorld(robot, layout)
        self._world.set_block(conveyor_block(layout))
        self._motions = MotionPredictor(robot, layout, limits or MotionLimits(), self._world)
        self._bins = ShownBins(layout, self._world)
        self._lock = threading.Lock()
        self.home = self._motions.home()

    def motion(
        self, request: PlaceRequest, start: Array, bins: Mapping[str, BinContent]
    ) -> PlannedMotion:
        """The motion from ``start`` (7,), with ``bins`` by station; not one to carry out.

        Raises
        ------
        MotionError
            There is none, as far as a prediction can tell.
        """
        check_grip(self._layout.tool, as_lying(request).box)
        with self._lock:
            self._bins.show(bins)
            site = self._bins.site(request.station, bins[request.station])
            return self._motions.plan(request, start, site)
