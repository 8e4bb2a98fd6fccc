"""The induct turns a box that lies across the belt with its long edge, when only so it can ride."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pack_msgs_py.values import (
    UP_NEG_X,
    UP_NEG_Y,
    UP_NEG_Z,
    UP_POS_X,
    UP_POS_Y,
    UP_POS_Z,
    Box,
)

#: Where each face is after a quarter turn to the left about the vertical.
_FACE_AFTER = {
    UP_POS_X: UP_POS_Y,
    UP_POS_Y: UP_NEG_X,
    UP_NEG_X: UP_NEG_Y,
    UP_NEG_Y: UP_POS_X,
    UP_POS_Z: UP_POS_Z,
    UP_NEG_Z: UP_NEG_Z,
}


def aligned(box: Box, refusal: Callable[[Box], str]) -> Box:
    """``box`` as it lies on the belt: as it came, or a quarter turn on when it rides only so.

    ``refusal`` says why a box cannot ride, empty when it can. A box that rides neither way stays as
    it came, so that what is said of it names the edges as they were given.
    """
    if not refusal(box):
        return box
    turned = quarter_turned(box)
    return box if refusal(turned) else turned


def quarter_turned(box: Box) -> Box:
    """The same box a quarter turn to the left about the vertical, in axes along the belt's."""
    (x, y, z), (dx, dy, dz) = box.size_mm, box.size_stddev_mm
    com_x, com_y, com_z = box.com_offset_mm
    return replace(
        box,
        size_mm=(y, x, z),
        size_stddev_mm=(dy, dx, dz),
        com_offset_mm=(-com_y, com_x, com_z),
        allowed_up=sum(after for face, after in _FACE_AFTER.items() if box.allowed_up & face),
    )
