"""Predicts what planning would find, a good deal faster: verdict and seconds, not a motion to run.

It is the planner itself with a world of bars and boxes and with timing on a coarse grid, so that it
tries what the planner tries in the same order; what it does not do is check the timed motion again.
"""

from __future__ import annotations

import numpy as np

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.motion.path import JointPath
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.quick_timing import QuickTiming
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.task import Task
from arm_executor.motion.timing import Load, MotionLimits, Trajectory

#: Spacing of the samples of a path, metres.
_STEP = 0.02


class MotionPredictor(MotionPlanner):
    """A :class:`MotionPlanner` whose motions are right in their verdict and their time.

    Parameters
    ----------
    robot, layout : which robot it is, and where everything stands.
    limits : assumed limits of motion.
    world : where what stands in the cell is put.
    """

    def __init__(
        self, robot: RobotModel, layout: Layout, limits: MotionLimits, world: QuickWorld
    ) -> None:
        timing = QuickTiming(robot, layout, limits)
        super().__init__(robot, layout, limits, world, _STEP, timing=timing, step=_STEP)
        self._warm_up()

    def _warm_up(self) -> None:
        """Compile, or load, what the first prediction would have to wait for."""
        still = np.repeat(self.home()[None], 8, axis=0)
        moving = still + np.linspace(0.0, 0.1, 8)[:, None]
        self.timing.trajectory(moving, Load(1.0, (0.3, 0.2, 0.2)), self._period)
        tool = self.kinematics.tool(still)
        self._world.first_hit(JointPath(still, tool[:, :3, 3], np.zeros(8)))

    def _motion_hit(
        self, task: Task, approach: Trajectory, carry: Trajectory, retreat: Trajectory
    ) -> str | None:
        return None
