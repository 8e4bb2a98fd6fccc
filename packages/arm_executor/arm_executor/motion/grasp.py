"""By which face a box is taken: the one that is up at the pick point, or the front.

A tilt tray may have tipped the box, so that another face than its top is up there. Taken by the
front with the tool level and turned down, what was the front comes up. The pad's other ways to a
box on the belt are barred: beside the belt stand bins A and B. Frame `cell`, metres.
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
    conjugate,
    quaternion_product,
    rotated,
    stands_upright,
    upright_axis,
    yaw_of,
)
from pack_msgs_py.orientation import QUATERNIONS, TIPPED, front_refusal, oriented_size
from pack_msgs_py.values import Vec3

#: Turns the box so that its front (-y) comes up, and back.
_H = math.sqrt(0.5)
_FRONT_UP: Quaternion = (-_H, 0.0, 0.0, _H)
_BACK: Quaternion = (_H, 0.0, 0.0, _H)


def as_lying(request: PlaceRequest) -> PlaceRequest:
    """``request`` with the axes of the box named as it lies at the pick point: z is up there.

    Pick and target stay where they are; it is ``request`` itself where the box was not tipped.

    Raises
    ------
    MotionError
        ``NO_IK_SOLUTION`` when the box was tipped, and is to be placed with yet another axis up.
    """
    if stands_upright(request.pick.quaternion):
        return request
    box, pick, target = request.box, request.pick, request.target
    up = 'xyz'[upright_axis(pick.quaternion)]
    back = conjugate(QUATERNIONS[TIPPED[up]])
    lies, stands = (quaternion_product(pose.quaternion, back) for pose in (pick, target))
    if not stands_upright(lies) or not stands_upright(stands):
        parts = ', '.join(f'{part:.3f}' for part in target.quaternion)
        msg = (
            f'box {box.id}: its {up} axis is up at the pick point, but the target quaternion '
            f'({parts}) has another one up; a tipped box can only turn about the vertical'
        )
        raise MotionError(ErrorCode.NO_IK_SOLUTION, msg)
    tip = QUATERNIONS[TIPPED[up]]
    x, y, z = rotated(tip, box.com_offset_mm)
    lying = replace(
        box,
        size_mm=oriented_size(box.size_mm, TIPPED[up]),
        size_stddev_mm=oriented_size(box.size_stddev_mm, TIPPED[up]),
        com_offset_mm=(round(x, 9), round(y, 9), round(z, 9)),
    )
    return replace(
        request, box=lying, pick=Pose(pick.position, lies), target=Pose(target.position, stands)
    )


def by_front(request: PlaceRequest) -> bool:
    """Whether another face is to be up at the target than at the pick point."""
    return not stands_upright(as_lying(request).target.quaternion)


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
        As :func:`as_lying` and :func:`turned_down`.
    """
    lying = as_lying(request)
    return turned_down(lying) if by_front(lying) else lying


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
