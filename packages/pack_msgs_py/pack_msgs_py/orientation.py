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
#: the axes is free for a rectangular box and chosen for the smallest turn, and so that of the faces
#: along y it is the front (-y) that comes up: that is the one that an arm can take on the belt.
_H = math.sqrt(0.5)
QUATERNIONS: dict[str, tuple[float, float, float, float]] = {
    'xyz': (0.0, 0.0, 0.0, 1.0),
    'yxz': (0.0, 0.0, _H, _H),
    'xzy': (-_H, 0.0, 0.0, _H),
    'zxy': (-0.5, -0.5, 0.5, 0.5),
    'yzx': (-0.5, -0.5, -0.5, 0.5),
    'zyx': (0.0, _H, 0.0, _H),
}

#: A front is large enough for a suction pad from this edge on, with the belt's head just below it.
FRONT_EDGE_MM = 100.0
#: And what is held by it may weigh, times how far its middle is behind the front, kg m: more peels
#: the pad off, or has to be carried too slowly.
FRONT_MOMENT_KG_M = 0.9

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


def _upright_or_front_up(size_mm: Vec3, orientation: str) -> bool:
    """Boxes are taken by the top, or by the front, which is along x and z on the belt."""
    large = min(size_mm[0], size_mm[2]) >= FRONT_EDGE_MM
    return orientation[2] == 'z' or (orientation[2] == 'y' and large)


def front_refusal(box: Box) -> str:
    """Why an arm cannot take ``box`` by its front (-y); empty when nothing speaks against it."""
    length, depth, height = box.size_mm
    if not box.allowed_up & UP_NEG_Y:
        return f'its front may not come up (allowed_up {box.allowed_up})'
    if min(length, height) < FRONT_EDGE_MM:
        return (
            f'its front is {length:g} x {height:g} mm; the pad takes fronts from '
            f'{FRONT_EDGE_MM:g} mm each way'
        )
    moment = box.weight_kg * depth / 2000
    if moment > FRONT_MOMENT_KG_M:
        return (
            f'{box.weight_kg:g} kg reach {depth / 2:g} mm behind it, which is {moment:.2f} kg m; '
            f'the pad holds {FRONT_MOMENT_KG_M:g} kg m'
        )
    return ''


ORIENTATION_RULES: dict[str, Callable[[Vec3, str], bool]] = {
    'any': _any,
    'largest_not_vertical': _largest_not_vertical,
    'upright': _upright,
    'upright_or_front_up': _upright_or_front_up,
}


def orientation_allowed(box: Box, orientation: str, rule: str) -> bool:
    """Whether ``rule`` and the box's own up flags both allow ``orientation``."""
    vertical_axis = orientation[2]
    if rule == 'upright_or_front_up' and vertical_axis == 'y' and front_refusal(box):
        return False
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
