"""Choose an arm by name."""

from __future__ import annotations

from arm_executor.arms.timed import TimedArm
from arm_executor.arms.true_boxes import Truth
from arm_executor.model.arm_interface import Arm
from arm_executor.model.layout import Layout

ARMS = ('physics', 'timed')


def make_arm(
    kind: str,
    *,
    layout: Layout,
    speed: float = 1.0,
    tolerance_mm: float = 5.0,
    angle_tolerance_deg: float = 2.0,
    truth: Truth | None = None,
) -> Arm:
    """The arm called ``kind``.

    Parameters
    ----------
    kind : ``'physics'`` moves a robot model in PyBullet, ``'timed'`` only spends the time.
    speed : robot seconds per wall-clock second; 0 is as fast as the machine can.
    tolerance_mm, angle_tolerance_deg : how far off a box may rest, for ``'physics'``.
    truth : what the boxes really are; without it they are as scanned.
    """
    if kind == 'timed':
        return TimedArm(layout, speed=speed, truth=truth)
    if kind == 'physics':
        # Only here, so that everything else runs without PyBullet.
        from arm_executor.arms.physics.arm import PhysicsArm

        return PhysicsArm(
            layout=layout,
            speed=speed,
            tolerance_mm=tolerance_mm,
            angle_tolerance_deg=angle_tolerance_deg,
            others_tolerance_mm=tolerance_mm,
            truth=truth,
        )
    msg = f'unknown arm {kind!r}: use one of {", ".join(ARMS)}'
    raise ValueError(msg)
