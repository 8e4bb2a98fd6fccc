"""The six axis-aligned orientations of a box, and which of them a profile and a box allow.

An orientation is a string of three letters: the box axes that lie along the bin's x, y and z.
``'xyz'`` is as it lies on the belt, ``'yxz'`` a quarter turn about the vertical.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from pack_msgs_py.values import (
    UP_NEG_X,
    UP_NEG_Y,
    UP_NEG_Z,
    UP_POS_X,
    UP_POS_Y,
    UP_POS_Z,
    Box,
    Vec3,
)

ORIENTATIONS = ('xyz', 'yxz', 'xzy', 'zxy', 'yzx', 'zyx')

#: Unit quaternions (x, y, z, w), bin frame from box frame. Each is a proper rotation; the sign of
#: the axes is free for a rectangular box and chosen for the smallest turn.
_H = math.sqrt(0.5)
QUATERNIONS: dict[str, tuple[float, float, float, float]] = {
    'xyz': (0.0, 0.0, 0.0, 1.0),
    'yxz': (0.0, 0.0, _H, _H),
    'xzy': (_H, 0.0, 0.0, _H),
    'zxy': (0.5, 0.5, 0.5, 0.5),
    'yzx': (-0.5, -0.5, -0.5, 0.5),
    'zyx': (0.0, _H, 0.0, _H),
}

_UP_FLAGS = {
    'x': UP_POS_X | UP_NEG_X,
    'y': UP_POS_Y | UP_NEG_Y,
    'z': UP_POS_Z | UP_NEG_Z,
}


def oriented_size(size_mm: Vec3, orientation: str) -> Vec3:
    """Edge lengths along the bin's x, y, z of a box of ``size_mm`` in ``orientation``.

    >>> oriented_size((300, 200, 100), 'yxz')
    (200, 300, 100)
    """
    x, y, z = ('xyz'.index(axis) for axis in orientation)
    return (size_mm[x], size_mm[y], size_mm[z])


def _any(size_mm: Vec3, orientation: str) -> bool:
    return True


def _largest_not_vertical(size_mm: Vec3, orientation: str) -> bool:
    """The lab rule of Ojha et al., II-B; a cube's edges are all largest, so it may stand."""
    dx, dy, dz = oriented_size(size_mm, orientation)
    return dz < max(size_mm) or max(dx, dy) == dz


def _upright(size_mm: Vec3, orientation: str) -> bool:
    return orientation[2] == 'z'


ORIENTATION_RULES: dict[str, Callable[[Vec3, str], bool]] = {
    'any': _any,
    'largest_not_vertical': _largest_not_vertical,
    'upright': _upright,
}


def orientation_allowed(box: Box, orientation: str, rule: str) -> bool:
    """Whether ``rule`` and the box's own up flags both allow ``orientation``."""
    vertical_axis = orientation[2]
    return bool(box.allowed_up & _UP_FLAGS[vertical_axis]) and ORIENTATION_RULES[rule](
        box.size_mm, orientation
    )


def allowed_orientations(box: Box, rule: str) -> tuple[str, ...]:
    """Orientations allowed for ``box``, without those that give the same three sizes again."""
    seen: dict[Vec3, str] = {}
    for orientation in ORIENTATIONS:
        if orientation_allowed(box, orientation, rule):
            seen.setdefault(oriented_size(box.size_mm, orientation), orientation)
    return tuple(seen.values())
