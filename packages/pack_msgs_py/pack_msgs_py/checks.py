"""Checks on values that arrive from outside; each returns the value or raises ``InvalidValue``."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pack_msgs_py.geometry.pose import Pose, Quaternion
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Int3, Vec3, shortened

#: Nothing in a cell is farther from the origin of its frame, metres; nor moves faster, m/s.
REACH_M = 100.0
#: Nothing in a cell takes longer, seconds: eleven days.
LONGEST_S = 1e6
#: What an integer of a journal can hold.
LARGEST_COUNT = 2**63 - 1
#: Characters of a name, and of a sentence for people.
LONGEST_NAME, LONGEST_TEXT = 200, 2000


class InvalidValue(ValueError):
    """A message or parameter holds a value that cannot be used; the text says which and why."""


def check_finite(name: str, value: float) -> float:
    """``value`` if it is finite."""
    if not math.isfinite(value):
        msg = f'{name} is {value}; it must be finite'
        raise InvalidValue(msg)
    return value


def check_range(name: str, value: float, low: float, high: float, unit: str = '') -> float:
    """``value`` if it is finite and from ``low`` to ``high``."""
    if not low <= check_finite(name, value) <= high:
        behind = f' {unit}' if unit else ''
        msg = f'{name} is {value:g}{behind}; it must be {low:g} to {high:g}{behind}'
        raise InvalidValue(msg)
    return value


def check_seconds(name: str, value: float, low: float = 0.0, high: float = LONGEST_S) -> float:
    """A time that something takes, seconds."""
    return check_range(name, value, low, high, 's')


def check_count(name: str, value: int) -> int:
    """A count, a revision or a number of a sequence, as far as it can be written down."""
    if not 0 <= value <= LARGEST_COUNT:
        msg = f'{name} is {value}; it must be 0 to {LARGEST_COUNT}'
        raise InvalidValue(msg)
    return value


def check_length(name: str, items: Sequence[object], most: int) -> None:
    """A list that is not longer than anything real is."""
    if len(items) > most:
        msg = f'{name} holds {len(items)}; it must hold at most {most}'
        raise InvalidValue(msg)


def check_name(name: str, text: str) -> str:
    """A name, which may be empty: short, and nothing in it that moves a cursor."""
    if len(text) > LONGEST_NAME or not text.isprintable():
        msg = f'{name} is {shortened(text)}; it must be at most {LONGEST_NAME} printable characters'
        raise InvalidValue(msg)
    return text


def clean_text(text: str) -> str:
    """A sentence for people on one line: what no terminal should be sent is replaced, and its end
    is left out when it is long."""
    kept = text[:LONGEST_TEXT] + ('...' if len(text) > LONGEST_TEXT else '')
    if kept.isprintable():
        return kept
    return ''.join(sign if sign.isprintable() else ' ' for sign in kept)


def check_vec3(name: str, value: Sequence[float], reach: float = math.inf) -> Vec3:
    """Three finite numbers, none of them farther from zero than ``reach``."""
    x, y, z = (
        check_finite(f'{name}.{axis}', number)
        if math.isinf(reach)
        else check_range(f'{name}.{axis}', number, -reach, reach)
        for axis, number in zip('xyz', value, strict=True)
    )
    return (x, y, z)


def check_unit_quaternion(name: str, value: Quaternion, tolerance: float = 1e-3) -> Quaternion:
    """A quaternion (x, y, z, w) of length 1 within ``tolerance``."""
    length = math.hypot(*(check_finite(f'{name} component', part) for part in value))
    if abs(length - 1.0) > tolerance:
        msg = f'{name} is a quaternion of length {length:#.5g}; it must be 1'
        raise InvalidValue(msg)
    return value


def check_pose(name: str, pose: Pose, reach_m: float = REACH_M) -> Pose:
    """A finite pose within ``reach_m`` of its frame's origin, with a unit quaternion."""
    check_vec3(f'{name}.position', pose.position, reach_m)
    check_unit_quaternion(f'{name}.orientation', pose.quaternion)
    return pose


def check_frame(name: str, frame_id: str, wanted: str) -> str:
    """A frame that is the one expected."""
    if frame_id != wanted:
        msg = f'{name} is {shortened(frame_id)}; it must be {wanted!r}'
        raise InvalidValue(msg)
    return frame_id


def check_whole_mm(name: str, value_m: Sequence[float]) -> Int3:
    """Metres that are whole millimetres within 0.01 mm, as integers of millimetres."""
    millimetres = [1000.0 * number for number in check_vec3(name, value_m, REACH_M)]
    x, y, z = (round(number) for number in millimetres)
    for axis, exact, whole in zip('xyz', millimetres, (x, y, z), strict=True):
        if abs(exact - whole) > 0.01:
            msg = f'{name}.{axis} is {exact:.3f} mm; it must be a whole number of millimetres'
            raise InvalidValue(msg)
    return (x, y, z)


def check_orientation(text: str) -> str:
    """``text`` if it names one of the six orientations."""
    if text not in ORIENTATIONS:
        msg = f'orientation {shortened(text)} must be one of {", ".join(ORIENTATIONS)}'
        raise InvalidValue(msg)
    return text
