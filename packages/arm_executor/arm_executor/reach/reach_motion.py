"""What the arm can really do in a layout: grasping poses without collision, and whole motions.

Needs PyBullet, toppra and Pinocchio, unlike :mod:`arm_executor.reach.reach`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from arm_executor.model.layout import Layout, bin_blocks, bin_frame, conveyor_block, pick_pose
from arm_executor.model.robot_data import find_robot
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.path import JointPath
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.task import Site
from arm_executor.motion.timing import MotionLimits
from arm_executor.reach.reach import PROBE_MM, configurations, pad_points, probe_box, probe_places
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.values import BinSpec

Array = NDArray[np.float64]

#: Period of the planned trajectories, seconds; finer is not needed to know their time.
_PERIOD_S = 1 / 60


@dataclass(frozen=True)
class StationReach:
    """Reach into one empty bin.

    Attributes
    ----------
    station, spec : where the bin stands, and its kind.
    places : centres (n, 3) of the probe box, bin frame, metres.
    free : (n,) whether the arm can stand there with the box and touch nothing.
    seconds : predicted robot time of a whole placement, for the places that were planned; NaN
        where no motion was found.
    blocked_by : what was in the way, and how often; the reason of a place without any.
    """

    station: str
    spec: BinSpec
    places: Array
    free: NDArray[np.bool_]
    seconds: Mapping[int, float] = field(default_factory=dict)
    blocked_by: Mapping[str, int] = field(default_factory=dict)

    @property
    def share(self) -> float:
        """Share of the places that can be taken, 0 to 1."""
        return float(self.free.mean())

    @property
    def median_s(self) -> float:
        """Median of the predicted times; NaN when no motion was found."""
        seconds = [duration for duration in self.seconds.values() if duration == duration]
        return float(np.median(seconds)) if seconds else float('nan')

    def within(self, deadline_s: float) -> float:
        """Share of the planned places whose time is within ``deadline_s``; NaN without any."""
        if not self.seconds:
            return float('nan')
        times = np.array(list(self.seconds.values()))
        return float((times <= deadline_s).mean())


class ReachCheck:
    """Asks collision checker and motion planner about one layout with bins of one kind.

    Raises
    ------
    ValueError
        There is no such robot.
    MotionError
        The arm cannot reach the waiting point above the belt.
    """

    def __init__(self, layout: Layout, bins: Mapping[str, BinSpec]) -> None:
        self._layout, self._bins = layout, dict(bins)
        arm = find_robot(layout.robot)
        self._world = PlanningWorld(arm, layout)
        self._world.set_block(conveyor_block(layout))
        for station, spec in self._bins.items():
            for block in bin_blocks(layout, station, spec):
                self._world.set_block(block)
        self._planner = MotionPlanner(arm, layout, MotionLimits(), self._world, _PERIOD_S)

    def station(self, station: str, samples: int = 0) -> StationReach:
        """Reach at ``station``; ``samples`` of its places are planned as whole motions."""
        spec = self._bins[station]
        places = probe_places(spec)
        free, blocked = self._poses(station, spec, places)
        picked = np.unique(np.linspace(0, len(places) - 1, min(samples, len(places))).astype(int))
        home = self._planner.home()
        seconds = {int(index): self._seconds(station, places[index], home) for index in picked}
        return StationReach(station, spec, places, free, seconds, blocked)

    def _poses(
        self, station: str, spec: BinSpec, places: Array
    ) -> tuple[NDArray[np.bool_], Mapping[str, int]]:
        points = pad_points(self._layout, station, spec, places)
        options = configurations(self._planner.kinematics, points)
        free, blocked = np.zeros(len(places), dtype=bool), Counter[str]()
        self._world.hold(metres(PROBE_MM), 'the box')
        try:
            for index, point in enumerate(points):
                hit = self._first_free(options[index].reshape(-1, 7), point)
                free[index] = hit is None
                if hit is not None:
                    blocked[hit] += 1
        finally:
            self._world.drop()
        return free, blocked

    def _first_free(self, options: Array, point: Array) -> str | None:
        """``None`` when one of the configurations (k, 7) is free, else why the first is not."""
        first = None
        for q in options[~np.isnan(options).any(axis=1)]:
            hit = self._world.first_hit(JointPath(q[None], point[None], np.zeros(1)), 0.0)
            if hit is None:
                return None
            first = first or hit
        return first or 'out of reach'

    def _seconds(self, station: str, place: Array, home: Array) -> float:
        spec = self._bins[station]
        site = Site(station, spec, bin_frame(self._layout, station, spec), [])
        x, y, z = (float(value) for value in place)
        pick = pick_pose(self._layout, PROBE_MM)
        try:
            motion = self._planner.plan(
                PlaceRequest(probe_box(self._layout), pick, station, Pose((x, y, z))), home, site
            )
        except MotionError:
            return float('nan')
        return motion.duration

    def close(self) -> None:
        """End the planning world."""
        self._world.close()
