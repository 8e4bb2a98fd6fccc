"""The arm that really moves: a robot model in PyBullet under position control.

Two physics clients: one is the world, where boxes have mass and fall; the other only answers
whether a configuration would touch anything. Planning is in
:mod:`arm_executor.arms.physics.planning`, execution in :mod:`arm_executor.arms.physics.execution`;
here they are tied together to an :class:`arm_executor.model.arm_interface.Arm`.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from arm_executor.arms.physics.driver import ArmDriver
from arm_executor.arms.physics.execution import PhysicsExecution
from arm_executor.arms.physics.gripper import SuctionGripper
from arm_executor.arms.physics.planning import PhysicsPlanning
from arm_executor.arms.physics.render import Camera, save_picture
from arm_executor.arms.physics.standing_bins import StandingBins
from arm_executor.arms.physics.world import STEP_S, PhysicsWorld
from arm_executor.arms.true_boxes import Truth
from arm_executor.model.arm_interface import (
    FoundAt,
    MotionHooks,
    MotionPlan,
    MotionResult,
    MotionUnderWay,
    PlaceRequest,
)
from arm_executor.model.layout import Layout, check_layout, conveyor_block
from arm_executor.model.robot_data import find_robot
from arm_executor.model.tree import CELL_JOINT_NAMES
from arm_executor.motion.collision import PlanningWorld
from arm_executor.motion.planner import MotionPlanner
from arm_executor.motion.predictor import MotionPredictor
from arm_executor.motion.quick_world import QuickWorld
from arm_executor.motion.timing import MotionLimits
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import STATIONS, Bin, BinSpec, Box


class PhysicsArm:
    """A robot arm with its cell in PyBullet.

    Parameters
    ----------
    layout : which robot it is, and where everything stands.
    speed : robot seconds per wall-clock second; 0 as fast as possible.
    bin_spec : kind of bin that every station is checked for; ``None`` to check when bins come.
    limits : assumed limits of motion.
    truth : what the boxes really are; without it they are as scanned.

    Attributes
    ----------
    world, gripper, bins : the world, the pad in it, and what stands in it.
    obstacles, planning : the world for planning, and what plans in it.
    driver : moves the joints.

    Raises
    ------
    LayoutError
        The layout cannot be built with these bins.
    ValueError
        There is no such robot.
    MotionError
        ``START_STATE_INVALID``: the robot cannot reach the pick point from its rail.
    """

    def __init__(
        self,
        layout: Layout | None = None,
        speed: float = 0.0,
        bin_spec: BinSpec | None = None,
        limits: MotionLimits | None = None,
        truth: Truth | None = None,
    ) -> None:
        self._truth = truth or Truth()
        self.layout = layout or Layout()
        robot = find_robot(self.layout.robot)
        check_layout(self.layout, {} if bin_spec is None else dict.fromkeys(STATIONS, bin_spec))
        self.world = PhysicsWorld(robot, self.layout, speed)
        self.gripper = SuctionGripper(self.world, self.layout.tool)
        self.obstacles = PlanningWorld(robot, self.layout)
        sketched = QuickWorld(robot, self.layout)
        for planned_in in (self.obstacles, sketched):
            planned_in.set_block(conveyor_block(self.layout))
        limits = limits or MotionLimits()
        predictor = MotionPredictor(robot, self.layout, limits, sketched)
        motions = MotionPlanner(robot, self.layout, limits, self.obstacles, STEP_S, scout=predictor)
        self.bins = StandingBins(self.layout, self.world, self.obstacles, sketched)
        self.driver = ArmDriver(self.world, self.gripper, motions.timing, motions.home())
        self.planning = PhysicsPlanning(
            motions, predictor, self.bins, self.driver, self.gripper, self.layout.tool
        )
        self._execution = PhysicsExecution(
            self.world,
            self.gripper,
            self.driver,
            self.bins,
            self.planning,
            self._truth,
        )

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """See :meth:`arm_executor.model.arm_interface.Arm.set_bins`.

        Raises
        ------
        LayoutError
            A station is not known, or a bin of this size does not fit there.
        ValueError
            A box has no pose.
        """
        box_ids = {placed.box.id for content in bins for placed in content.boxes}
        self._execution.free(box_ids)
        self._truth.keep(box_ids)
        return self.bins.set_bins([self._as_it_is(content) for content in bins], poses)

    def _as_it_is(self, content: Bin) -> Bin:
        boxes = (replace(placed, box=self._truth.box(placed.box)) for placed in content.boxes)
        return replace(content, boxes=tuple(boxes))

    def plan(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> MotionPlan:
        """See :meth:`arm_executor.model.arm_interface.Arm.plan`."""
        if after is None:
            return self.planning.plan(request)
        return self.planning.plan_after(request, after)

    def predict(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> float:
        """See :meth:`arm_executor.model.arm_interface.PredictingArm.predict`."""
        return self.planning.predict(request, after)

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """See :meth:`arm_executor.model.arm_interface.Arm.execute`."""
        return self._execution.execute(plan, hooks, stop)

    def return_to_belt(self) -> bool:
        """See :meth:`arm_executor.model.arm_interface.Arm.return_to_belt`."""
        return self._execution.return_to_belt()

    def find_box(self, box: Box, station: str, target: Pose, *, released: bool) -> FoundAt:
        """Its world begins anew as the journal says, so nothing in it is in doubt."""
        return FoundAt.IN_BIN if released else FoundAt.ON_BELT

    def withdraw(self) -> bool:
        """See :meth:`arm_executor.model.arm_interface.Arm.withdraw`."""
        return self._execution.withdraw()

    def holds(self) -> str | None:
        """See :meth:`arm_executor.model.arm_interface.Arm.holds`."""
        return self.gripper.box_id

    def tracking_error(self) -> float:
        """See :meth:`arm_executor.model.arm_interface.Arm.tracking_error`."""
        return self.driver.tracking_error

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """See :meth:`arm_executor.model.arm_interface.Arm.joint_positions`."""
        return CELL_JOINT_NAMES, self.driver.positions

    def robot_time(self) -> float:
        """See :meth:`arm_executor.model.arm_interface.ClockedArm.robot_time`."""
        return self.driver.measured_at_s

    def close(self) -> None:
        """See :meth:`arm_executor.model.arm_interface.Arm.close`."""
        self.world.close()
        self.obstacles.close()

    # -- for studies ----------------------------------------------------------------------------

    def present(self, box: Box, pick: Pose) -> None:
        """Put ``box`` on the belt at ``pick``, frame `cell`, in place of what was there."""
        self._execution.present(box, pick)

    def hold_still(self, seconds: float) -> None:
        """Let ``seconds`` of robot time pass with the arm where it is."""
        self.driver.hold(seconds)

    def render(
        self, path: Path, width: int = 960, height: int = 640, camera: Camera | None = None
    ) -> None:
        """Save a picture of the cell as it is now, PNG."""
        save_picture(self.world, path, width, height, camera)
