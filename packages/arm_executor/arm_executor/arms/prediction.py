"""An arm and what stands around it, as far as a prediction needs them."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.arm_interface import PlaceRequest
from arm_executor.model.layout import Layout, bin_blocks, bin_frame, conveyor_block
from arm_executor.model.robot_data import find_robot
from arm_executor.model.suction import check_grip
from arm_executor.motion.grasp import as_lying
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.predictor import MotionPredictor
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.task import Site, StandingBox
from arm_executor.motion.timing import MotionLimits
from pack_msgs_py.geometry.pose import Pose, extent
from pack_msgs_py.values import BinSpec, Vec3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BinContent:
    """A bin of kind ``spec``, and the size (m) and pose (bin frame) of each box in it by its id."""

    spec: BinSpec
    boxes: Mapping[str, tuple[Vec3, Pose]] = field(default_factory=dict)


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
        self._shown: dict[str, object] = {}
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
            self._show(bins)
            target = bins[request.station]
            frame = bin_frame(self._layout, request.station, target.spec)
            boxes = [
                StandingBox(box_id, *extent(frame.to_cell(pose), size))
                for box_id, (size, pose) in target.boxes.items()
            ]
            site = Site(request.station, target.spec, frame, boxes)
            return self._motions.plan(request, start, site)

    def _show(self, bins: Mapping[str, BinContent]) -> None:
        """Let the world hold exactly ``bins``."""
        shown: dict[str, object] = {}
        for station, content in bins.items():
            for block in bin_blocks(self._layout, station, content.spec):
                shown[block.name] = block
                if self._shown.get(block.name) != block:
                    self._world.set_block(block)
            frame = bin_frame(self._layout, station, content.spec)
            for box_id, (size, pose) in content.boxes.items():
                name = f'placed box {box_id}'
                shown[name] = (station, size, pose)
                if self._shown.get(name) != shown[name]:
                    self._world.set_box(name, size, frame.to_cell(pose))
        for name in self._shown.keys() - shown.keys():
            self._world.remove(name)
        self._shown = shown
