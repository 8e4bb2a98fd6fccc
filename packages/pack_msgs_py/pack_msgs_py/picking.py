"""Where a box is when the arm takes it, by what the scanner says of it.

Frame `cell`, metres, radians.
"""

from __future__ import annotations

import math
from dataclasses import replace

from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.geometry.pose import (
    Pose,
    about_z,
    conjugate,
    extent,
    metres,
    quaternion_product,
    tilt_between,
    yaw_of,
)

#: A box lies as it is wanted up to this tilt: more, and another face is up, or half way up.
FLAT_RAD = 0.1
#: A box whose base is so near to the height of the belt lies on it.
_ON_BELT_M = 0.02


def lies_as(pose: Pose, wanted: Pose) -> bool:
    """Whether the same face is up, however it is turned about the vertical."""
    return tilt_between(pose.quaternion, wanted.quaternion) <= FLAT_RAD


def turn_from(pose: Pose, wanted: Pose) -> float:
    """Turn about the vertical from ``wanted`` to ``pose``, -pi to pi; the tilt does not count."""
    _, _, z, w = quaternion_product(pose.quaternion, conjugate(wanted.quaternion))
    length = math.hypot(z, w)
    yaw = yaw_of((0.0, 0.0, z / length, w / length)) if length else 0.0
    return math.remainder(yaw, 2 * math.pi)


def levelled(pose: Pose, wanted: Pose) -> Pose:
    """``pose`` with the tilt of ``wanted``: what a scanner sees of a tilt, a belt does not have."""
    yaw = about_z(turn_from(pose, wanted))
    return Pose(pose.position, quaternion_product(yaw, wanted.quaternion))


def is_presented(scanned: ScannedBox, stamp_s: float) -> bool:
    """Whether a box is at the pick point in a scan of ``stamp_s``, seconds since the epoch."""
    return scanned.pick_open_s is not None and scanned.pick_open_s <= stamp_s


def expected_pick(nominal: Pose, box_id: str, scan: Scan | None) -> Pose:
    """Where the box called ``box_id`` will lie when it is taken.

    One that is at the pick point lies where ``scan`` shows it. One that lies on the top strand
    comes there as far aside, and turned, as it lies now. Of any other box nothing else is known
    than ``nominal``, which also says which face is to be up.
    """
    scanned = None if scan is None else scan.find(box_id)
    if scan is None or scanned is None:
        return nominal
    if is_presented(scanned, scan.stamp_s) and lies_as(scanned.pose, nominal):
        return levelled(scanned.pose, nominal)
    size = metres(scanned.box.size_mm)
    (_, front_y, belt_z), _ = extent(nominal, size)
    flat = Pose()
    (_, _, base_z), _ = extent(scanned.pose, size)
    if not lies_as(scanned.pose, flat) or abs(base_z - belt_z) > _ON_BELT_M:
        return nominal
    yaw = about_z(turn_from(scanned.pose, flat))
    x, _, _ = scanned.pose.position
    _, y, z = nominal.position
    turned = Pose((x, y, z), quaternion_product(yaw, nominal.quaternion))
    (_, low_y, _), _ = extent(turned, size)
    return replace(turned, position=(x, y + front_y - low_y, z))
