"""How hard a suction pad holds.

A flat pad with a sealing lip: the air presses it on with pressure times area (`grip`). What pulls
the box off the pad takes from that. What is left carries shear by friction, and a moment by
pressing one edge of the pad harder than the other, until the far edge opens (peel). Boxes narrower
than the pad are held by the part that covers them; its cups close by themselves.

The same limits hold in physics (:mod:`arm_executor.arms.physics.gripper`), without reserve, and in
planning (here), with the reserve ``tool.safety``. Twist about the pad's normal is not limited.
Newtons, metres, kg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arm_executor.model.arm_interface import MotionError
from arm_executor.model.layout import Tool
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import metres
from pack_msgs_py.values import Box, Vec3

GRAVITY = 9.81
#: A box that would have to be carried slower than this cannot be carried, m/s2.
LEAST_ACCELERATION = 0.5


@dataclass(frozen=True)
class Pad:
    """What holds a box: air pressure times area (N), friction, and half of the shorter edge (m)."""

    grip: float
    friction: float
    lever: float


@dataclass(frozen=True)
class PadLoad:
    """What a pad bears: pull away from it and shear (N), and the moment that peels it (N m)."""

    pull: float
    shear: float
    peel: float


def pad_on(tool: Tool, size: Vec3) -> Pad:
    """The pad of ``tool`` in the middle of the top of a box of ``size``, metres."""
    along, across = (min(tool.pad_edge, edge) for edge in size[:2])
    return Pad(tool.vacuum * along * across, tool.friction, min(along, across) / 2)


def overload(pad: Pad, load: PadLoad) -> str | None:
    """What of ``load`` is more than ``pad`` holds, with both numbers; ``None`` when it holds."""
    left = pad.grip - load.pull
    if left <= 0:
        return f'a pull of {load.pull:.0f} N on a pad that holds {pad.grip:.0f} N'
    if load.shear > pad.friction * left:
        return f'a shear of {load.shear:.0f} N where {pad.friction * left:.0f} N hold'
    if load.peel > pad.lever * left:
        return f'a peeling moment of {load.peel:.1f} N m where {pad.lever * left:.1f} N m hold'
    return None


def tool_acceleration_limit(
    tool: Tool, mass: float, size: Vec3, com_offset: Vec3, *, tilts: bool = False
) -> float:
    """Acceleration, m/s2, that the pad may give a box level and upwards at the same time.

    Zero or less when it cannot even hold the box still. ``size`` and ``com_offset`` are metres.

    With grip F, mass m and acceleration a, each limit is linear in a:
    shear  m a <= friction (F - m (g + a)),
    peel   m (g + a) e + m a h <= lever (F - m (g + a)),
    where e is how far the centre of mass is off the pad's axis, and h how far below the pad.
    A pad that ``tilts`` bears gravity in any direction between down and across; of those the
    worst counts, for either limit.
    """
    pad = pad_on(tool, size)
    held = pad.grip / tool.safety / mass
    aside = math.hypot(com_offset[0], com_offset[1])
    below = size[2] / 2 - com_offset[2]
    across, over = (1.0, below) if tilts else (0.0, 0.0)
    sliding = GRAVITY * math.hypot(pad.friction, across)
    shear = (pad.friction * held - sliding) / (1 + pad.friction)
    peeling = GRAVITY * math.hypot(pad.lever + aside, over)
    peel = (pad.lever * held - peeling) / (pad.lever + aside + below)
    return min(shear, peel)


def holding_limits(
    tool: Tool, mass: float, size: Vec3, com_offset: Vec3
) -> tuple[tuple[float, float, float], ...]:
    """What the pad may do to a box that hangs upright, as rows (level, up, most).

    With an acceleration a in any level direction and b upwards, m/s2, each row says
    ``level * a + up * b <= most``: shear, and peel. See :func:`tool_acceleration_limit`, which has
    a = b: a box that only goes up may be pulled harder, one that goes down may be pushed harder.
    """
    pad = pad_on(tool, size)
    held = pad.grip / tool.safety / mass
    lever = pad.lever + math.hypot(com_offset[0], com_offset[1])
    below = size[2] / 2 - com_offset[2]
    return (
        (1.0, pad.friction, pad.friction * (held - GRAVITY)),
        (below, lever, pad.lever * held - lever * GRAVITY),
    )


def check_grip(tool: Tool, box: Box, *, tilts: bool = False) -> None:
    """:class:`MotionError` ``LIMITS_EXCEEDED`` when the pad cannot carry ``box``."""
    size = metres(box.size_mm)
    offset = metres(box.com_offset_mm)
    most = tool_acceleration_limit(tool, box.weight_kg, size, offset, tilts=tilts)
    if most >= LEAST_ACCELERATION:
        return
    pad = pad_on(tool, size)
    aside = math.hypot(offset[0], offset[1])
    msg = (
        f'box {box.id}: {box.weight_kg:g} kg, {1000 * aside:.0f} mm off balance, is more than the '
        f'pad can carry; it holds {pad.grip:.0f} N ({tool.vacuum / 1000:g} kPa), of which '
        f'{pad.grip / tool.safety:.0f} N are used'
    )
    raise MotionError(ErrorCode.LIMITS_EXCEEDED, msg)
