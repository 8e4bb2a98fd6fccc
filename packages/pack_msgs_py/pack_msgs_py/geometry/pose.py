"""Poses of boxes: metres, radians, unit quaternions (x, y, z, w)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

from pack_msgs_py.values import Vec3

Quaternion = tuple[float, float, float, float]
#: Rows of a rotation matrix.
Matrix3 = tuple[Vec3, Vec3, Vec3]

NO_TURN: Quaternion = (0.0, 0.0, 0.0, 1.0)
#: A box stands straight up to this (sine of half the tilt).
STRAIGHT = 0.01


@dataclass(frozen=True)
class Pose:
    """Position in metres and orientation as unit quaternion (x, y, z, w)."""

    position: Vec3 = (0.0, 0.0, 0.0)
    quaternion: Quaternion = NO_TURN


def metres(values_mm: Vec3) -> Vec3:
    """Millimetres to metres."""
    x, y, z = values_mm
    return (x / 1000, y / 1000, z / 1000)


def about_z(yaw: float) -> Quaternion:
    """The turn by ``yaw`` about the vertical."""
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def yaw_of(quaternion: Quaternion) -> float:
    """Turn about the vertical, -2 pi to 2 pi, of what is turned no other way."""
    _, _, z, w = quaternion
    return 2 * math.atan2(z, w)


def stands_upright(quaternion: Quaternion) -> bool:
    """Whether the box's own z points up."""
    return math.hypot(quaternion[0], quaternion[1]) <= STRAIGHT


def quaternion_product(second: Quaternion, first: Quaternion) -> Quaternion:
    """The turn ``first`` and then ``second``."""
    (a, b, c, d), (x, y, z, w) = second, first
    return (
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    )


def conjugate(quaternion: Quaternion) -> Quaternion:
    """The turn back."""
    x, y, z, w = quaternion
    return (-x, -y, -z, w)


def partial_turn(quaternion: Quaternion, share: float) -> Quaternion:
    """The first ``share``, 0 to 1, of a turn by less than half a turn."""
    x, y, z, w = quaternion
    sine, half = math.hypot(x, y, z), math.atan2(math.hypot(x, y, z), w)
    if share == 1.0 or sine == 0.0:
        return quaternion
    scale = math.sin(share * half) / sine
    return (scale * x, scale * y, scale * z, math.cos(share * half))


def upright_axis(quaternion: Quaternion) -> int:
    """Which of the box's own axes, 0 to 2, is nearest to the vertical."""
    upwards = [abs(part) for part in rotation_matrix(quaternion)[2]]
    return upwards.index(max(upwards))


def rotation_matrix(quaternion: Quaternion) -> Matrix3:
    """Rows of the rotation matrix of a unit quaternion."""
    x, y, z, w = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def rotated(quaternion: Quaternion, vector: Vec3) -> Vec3:
    """``vector`` turned by ``quaternion``.

    >>> rotated((0.0, 0.0, 1.0, 0.0), (1.0, 2.0, 3.0))
    (-1.0, -2.0, 3.0)
    """
    x, y, z = (
        sum(entry * part for entry, part in zip(row, vector, strict=True))
        for row in rotation_matrix(quaternion)
    )
    return (x, y, z)


def corners(pose: Pose, size_m: Vec3) -> list[Vec3]:
    """The eight corners of a box of ``size_m``, box axes, with its centre at ``pose``."""
    points = []
    for signs in product((-0.5, 0.5), repeat=3):
        sx, sy, sz = (sign * edge for sign, edge in zip(signs, size_m, strict=True))
        dx, dy, dz = rotated(pose.quaternion, (sx, sy, sz))
        x, y, z = pose.position
        points.append((x + dx, y + dy, z + dz))
    return points


def extent(pose: Pose, size_m: Vec3) -> tuple[Vec3, Vec3]:
    """Lowest and highest x, y, z that a box of ``size_m`` takes up with its centre at ``pose``."""
    rows = rotation_matrix(pose.quaternion)
    (x, y, z), (length, breadth, height) = pose.position, size_m
    hx, hy, hz = ((abs(a) * length + abs(b) * breadth + abs(c) * height) / 2 for a, b, c in rows)
    return (x - hx, y - hy, z - hz), (x + hx, y + hy, z + hz)


def corner_distance(first: Pose, second: Pose, size_m: Vec3) -> float:
    """Largest distance between corresponding corners of a box in two poses, metres."""
    return max(map(math.dist, corners(first, size_m), corners(second, size_m)))


def turn_between(first: Pose, second: Pose) -> float:
    """Angle between two orientations, 0 to pi."""
    dot = abs(sum(a * b for a, b in zip(first.quaternion, second.quaternion, strict=True)))
    return 2 * math.acos(min(1.0, dot))


def tilt_between(first: Quaternion, second: Quaternion) -> float:
    """Angle between what is up in two orientations, 0 to pi: turns about the vertical are none."""
    up, other_up = rotation_matrix(first)[2], rotation_matrix(second)[2]
    return math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(up, other_up, strict=True)))))


#: Half a turn about each of the axes.
HALF_TURNS: tuple[Quaternion, ...] = (
    (1.0, 0.0, 0.0, 0.0),
    (0.0, 1.0, 0.0, 0.0),
    (0.0, 0.0, 1.0, 0.0),
)


def folded(pose: Pose, near: Pose) -> Pose:
    """``pose`` or the same turned by half a turn about the axis that is up, whichever is nearer.

    A box turned so fills the same space, and the arm may place it either way round.
    """
    half_turn = HALF_TURNS[upright_axis(pose.quaternion)]
    half_turned = Pose(pose.position, quaternion_product(pose.quaternion, half_turn))
    return min((pose, half_turned), key=lambda candidate: turn_between(candidate, near))
