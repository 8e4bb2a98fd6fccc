"""The timed arm as the registry of arms knows it."""

from __future__ import annotations

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.model.arm_interface import Arm
from arm_executor.model.layout import lifting_limit


def _make(setup: ArmSetup) -> Arm:
    # Only here: what predicts motions takes a second to be imported.
    from arm_executor.arms.timed import TimedArm
    from arm_executor.motion.timing import MotionLimits

    limits = MotionLimits(joint_jerk=setup.joint_jerk or 0.0)
    return TimedArm(setup.layout, speed=setup.speed, truth=setup.truth, limits=limits)


TIMED = ArmKind(
    name='timed',
    summary='only spends the time',
    make=_make,
    lifting_limit=lifting_limit,
    simulated=True,
)
