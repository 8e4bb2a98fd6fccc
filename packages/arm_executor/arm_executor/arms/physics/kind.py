"""The physics arm as the registry of arms knows it."""

from __future__ import annotations

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.model.arm_interface import Arm
from arm_executor.model.layout import lifting_limit


def _make(setup: ArmSetup) -> Arm:
    # Only here, so that everything else runs without PyBullet.
    from arm_executor.arms.physics.arm import PhysicsArm
    from arm_executor.motion.timing import MotionLimits

    return PhysicsArm(
        layout=setup.layout,
        speed=setup.speed,
        limits=MotionLimits(joint_jerk=setup.joint_jerk or 0.0),
        truth=setup.truth,
    )


PHYSICS = ArmKind(
    name='physics',
    summary='moves a robot model in PyBullet',
    make=_make,
    moves_robot=True,
    lifting_limit=lifting_limit,
    keeps_true_boxes=True,
    simulated=True,
)
