"""By which face a box is taken: its top, or the front that it turns to the arm on the belt.

Taken by the front with the tool level and turned down, what was the front comes up. The pad's other
ways to a box on the belt are barred: beside the belt stand bins A and B. Frame `cell`, metres.
"""

from __future__ import annotations

import math
from dataclasses import replace

from arm_executor.model.arm_interface import MotionError, PlaceRequest
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import (
    STRAIGHT,
    Pose,
    Quaternion,
    quaternion_product,
    stands_upright,
    yaw_of,
)
from pack_msgs_py.orientation import front_refusal
from pack_msgs_py.values import Vec3

#: Turns the box so that its front (-y) comes up, and back.
_H = math.sqrt(0.5)
_FRONT_UP: Quaternion = (-_H, 0.0, 0.0, _H)
_BACK: Quaternion = (_H, 0.0, 0.0, _H)


def turned_down(request: PlaceRequest) -> PlaceRequest:
    """``request`` for a box taken by its front, as if that had been its top on the belt.

    The pick stays where it is. The box's axes are the old x, z and -y.

    Raises
    ------
    MotionError
        ``NO_IK_SOLUTION`` when another face than the front is to come up, or the front cannot be
        taken.
    """
    box, target = request.box, request.target
    turned = quaternion_product(target.quaternion, _BACK)
    if not stands_upright(turned):
        text = ', '.join(f'{part:.3f}' for part in target.quaternion)
        msg = (
            f'box {box.id}: the target quaternion ({text}) brings up a face that the arm cannot '
            'take; it takes boxes by the top or by the front (-y)'
        )
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    why = front_refusal(box)
    if not why and not _lies_straight(request.pick):
        why = 'it lies askew on the belt'
    if why:
        msg = f'box {box.id} is to stand on its back, but cannot be taken by its front: {why}'
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    lying = replace(box, size_mm=_turned(box.size_mm), com_offset_mm=_offset(box.com_offset_mm))
    return replace(request, box=lying, target=Pose(target.position, turned))


def as_taken(request: PlaceRequest) -> PlaceRequest:
    """``request`` with the axes of the box as the pad sees them, z against the tool.

    Raises
    ------
    MotionError
        As :func:`turned_down`.
    """
    return request if stands_upright(request.target.quaternion) else turned_down(request)


def front_point(request: PlaceRequest) -> Vec3:
    """Middle of the front of the box at the pick point."""
    x, y, z = request.pick.position
    half, yaw = request.box.size_mm[1] / 2000, yaw_of(request.pick.quaternion)
    return (x + half * math.sin(yaw), y - half * math.cos(yaw), z)


def _lies_straight(pick: Pose) -> bool:
    return math.hypot(*pick.quaternion[:3]) <= STRAIGHT


def _turned(size: Vec3) -> Vec3:
    return (size[0], size[2], size[1])


def _offset(offset: Vec3) -> Vec3:
    return (offset[0], offset[2], -offset[1])
