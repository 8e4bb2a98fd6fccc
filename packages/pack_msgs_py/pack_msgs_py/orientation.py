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
#: along an axis the same one comes up either way: along y the front (-y), which is the one that an
#: arm can take on the belt, along x the left end (-x).
_H = math.sqrt(0.5)
QUATERNIONS: dict[str, tuple[float, float, float, float]] = {
    'xyz': (0.0, 0.0, 0.0, 1.0),
    'yxz': (0.0, 0.0, _H, _H),
    'xzy': (-_H, 0.0, 0.0, _H),
    'zxy': (-0.5, -0.5, 0.5, 0.5),
    'yzx': (-0.5, 0.5, 0.5, 0.5),
    'zyx': (0.0, _H, 0.0, _H),
}

#: A front is large enough for a suction pad from this edge on, with the belt's head just below it.
FRONT_EDGE_MM = 100.0
#: And what is held by it may weigh, times how far its middle is behind the front, kg m: more peels
#: the pad off, or has to be carried too slowly.
FRONT_MOMENT_KG_M = 0.9

#: How a box lies whose axis is up that the key names, when it was only tipped, not turned.
TIPPED = {'x': 'zyx', 'y': 'xzy', 'z': 'xyz'}
#: A tilt tray takes boxes of this length across and along the belt before and after the tip, and no
#: higher ones than an arm that waits above it leaves room for.
TRAY_MM, TRAY_HEIGHT_MM = 660.0, 500.0
#: An edge swings past below that arm, with what it keeps clear of (diagonal of the tipped sides).
TRAY_SWING_MM = 550.0
#: And nothing is stood on a narrower face than this: neither tray nor pad would hold it.
TIPPED_EDGE_MM = 50.0
#: Robot time in which it tips a box, or tips it back, seconds: assumed, see docs/decisions.md.
TILT_TIME_S = 1.5

_UP_FLAGS = {
    'x': UP_POS_X | UP_NEG_X,
    'y': UP_POS_Y | UP_NEG_Y,
    'z': UP_POS_Z | UP_NEG_Z,
}
#: The same for the tilt tray, which tips one way only.
_TIPPED_UP_FLAGS = {**_UP_FLAGS, 'x': UP_NEG_X, 'y': UP_NEG_Y}


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


def _upright_or_tipped(size_mm: Vec3, orientation: str) -> bool:
    return not _tray_refusal(size_mm, orientation[2])


def _tray_refusal(size_mm: Vec3, up: str) -> str:
    """Why a box of ``size_mm`` cannot be tipped so that axis ``up`` stands up."""
    if up == 'z':
        return ''
    tipped = oriented_size(size_mm, TIPPED[up])
    widest, high = max(*size_mm[:2], *tipped[:2]), tipped[2]
    swing, narrow = math.hypot(high, size_mm[2]), min(tipped[:2])
    if narrow < TIPPED_EDGE_MM:
        return (
            f'it would stand on a face that is {narrow:g} mm narrow; tray and pad hold faces '
            f'from {TIPPED_EDGE_MM:g} mm'
        )
    if widest > TRAY_MM:
        return f'it is {widest:g} mm wide or deep; the tray takes {TRAY_MM:g} mm'
    if high > TRAY_HEIGHT_MM:
        return f'it would stand {high:g} mm high; the arm leaves room for {TRAY_HEIGHT_MM:g} mm'
    if swing > TRAY_SWING_MM:
        return (
            f'an edge of it swings {swing:.0f} mm high; the waiting arm leaves room for '
            f'{TRAY_SWING_MM:g} mm'
        )
    return ''


def tray_refusal(box: Box, up: str) -> str:
    """Why a tilt tray does not bring axis ``up`` of ``box`` up; empty when it does.

    >>> tray_refusal(Box('a', (600.0, 200.0, 100.0)), 'x')
    'it would stand 600 mm high; the arm leaves room for 500 mm'
    """
    if not box.allowed_up & _TIPPED_UP_FLAGS[up]:
        what = {'x': 'its left end may', 'y': 'its front may', 'z': 'neither top nor base may'}[up]
        return f'{what} not come up (allowed_up {box.allowed_up})'
    return _tray_refusal(box.size_mm, up)


def at_pick(orientation: str, rule: str) -> str:
    """How a box lies at the pick point that is to be placed in ``orientation``.

    As on the belt, unless ``rule`` leaves it to the tilt tray to bring another face up.
    """
    return TIPPED[orientation[2]] if rule == UPRIGHT_OR_TIPPED else TIPPED['z']


#: Name of the rule of a cell with a tilt tray.
UPRIGHT_OR_TIPPED = 'upright_or_tipped'

ORIENTATION_RULES: dict[str, Callable[[Vec3, str], bool]] = {
    'any': _any,
    'largest_not_vertical': _largest_not_vertical,
    'upright': _upright,
    'upright_or_front_up': _upright_or_front_up,
    UPRIGHT_OR_TIPPED: _upright_or_tipped,
}


def orientation_allowed(box: Box, orientation: str, rule: str) -> bool:
    """Whether ``rule`` and the box's own up flags both allow ``orientation``."""
    vertical_axis = orientation[2]
    if rule == 'upright_or_front_up' and vertical_axis == 'y' and front_refusal(box):
        return False
    if rule == UPRIGHT_OR_TIPPED and tray_refusal(box, vertical_axis):
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


def way_up(orientation: str) -> str:
    """How a box is turned from how it lay on the belt, in words.

    >>> way_up('yxz'), way_up('zxy')
    ('upright, quarter turn', 'front up, quarter turn')
    """
    up = {'z': 'upright', 'y': 'front up', 'x': 'end up'}[orientation[2]]
    straight = orientation in ('xyz', 'xzy', 'zyx')
    return up if straight else f'{up}, quarter turn'
