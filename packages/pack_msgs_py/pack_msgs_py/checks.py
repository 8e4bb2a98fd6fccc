"""Checks on values that arrive from outside; each returns the value or raises ``InvalidValue``."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pack_msgs_py.geometry.pose import Pose, Quaternion
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Int3, Vec3


class InvalidValue(ValueError):
    """A message or parameter holds a value that cannot be used; the text says which and why."""


def check_finite(name: str, value: float) -> float:
    """``value`` if it is finite."""
    if not math.isfinite(value):
        msg = f'{name} is {value}; it must be finite'
        raise InvalidValue(msg)
    return value


def check_vec3(name: str, value: Sequence[float]) -> Vec3:
    """Three finite numbers."""
    x, y, z = (
        check_finite(f'{name}.{axis}', number) for axis, number in zip('xyz', value, strict=True)
    )
    return (x, y, z)


def check_unit_quaternion(name: str, value: Quaternion, tolerance: float = 1e-3) -> Quaternion:
    """A quaternion (x, y, z, w) of length 1 within ``tolerance``."""
    length = math.sqrt(sum(check_finite(f'{name} component', part) ** 2 for part in value))
    if abs(length - 1.0) > tolerance:
        msg = f'{name} is a quaternion of length {length:.4f}; it must be 1'
        raise InvalidValue(msg)
    return value


def check_pose(name: str, pose: Pose, reach_m: float = 100.0) -> Pose:
    """A finite pose within ``reach_m`` of its frame's origin, with a unit quaternion."""
    position = check_vec3(f'{name}.position', pose.position)
    check_unit_quaternion(f'{name}.orientation', pose.quaternion)
    if max(abs(value) for value in position) > reach_m:
        msg = f'{name}.position is {position} m; it must be within {reach_m:g} m'
        raise InvalidValue(msg)
    return pose


def check_frame(name: str, frame_id: str, wanted: str) -> str:
    """A frame that is the one expected."""
    if frame_id != wanted:
        msg = f'{name} is {frame_id!r}; it must be {wanted!r}'
        raise InvalidValue(msg)
    return frame_id


def check_whole_mm(name: str, value_m: Sequence[float]) -> Int3:
    """Metres that are whole millimetres within 0.01 mm, as integers of millimetres."""
    millimetres = [1000.0 * number for number in check_vec3(name, value_m)]
    x, y, z = (round(number) for number in millimetres)
    for axis, exact, whole in zip('xyz', millimetres, (x, y, z), strict=True):
        if abs(exact - whole) > 0.01:
            msg = f'{name}.{axis} is {exact:.3f} mm; it must be a whole number of millimetres'
            raise InvalidValue(msg)
    return (x, y, z)


def check_orientation(text: str) -> str:
    """``text`` if it names one of the six orientations."""
    if text not in ORIENTATIONS:
        msg = f'orientation {text!r} must be one of {", ".join(ORIENTATIONS)}'
        raise InvalidValue(msg)
    return text
