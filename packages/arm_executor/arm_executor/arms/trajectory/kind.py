"""The arm `trajectory` as the registry of arms knows it."""

from __future__ import annotations

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.arms.trajectory.parameters import TrajectoryParameters
from arm_executor.model.arm_interface import Arm
from arm_executor.model.layout import lifting_limit


def _make(setup: ArmSetup) -> Arm:
    # Only here: what plans motions takes seconds to be imported.
    from arm_executor.arms.trajectory.arm import TrajectoryArm

    return TrajectoryArm(setup)


TRAJECTORY = ArmKind(
    name='trajectory',
    summary='moves a robot by its driver',
    make=_make,
    moves_robot=True,
    lifting_limit=lifting_limit,
    has_driver=True,
    parameters=TrajectoryParameters,
)
