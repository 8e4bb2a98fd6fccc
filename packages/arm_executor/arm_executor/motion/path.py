"""Paths: waypoints of the mast, rounded corners, and the joint angles along them.

A waypoint is (rail, theta, radius, height, yaw): where the arm stands on the rail, the direction
and distance from there to the pad seen from above, the height of the pad's face, and its turn about
the vertical. Going straight in these coordinates swings the box round the arm instead of through
it. Metres and radians, frame `cell`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.urdf import joint_limit

Array = NDArray[np.float64]
Waypoint = tuple[float, float, float, float, float]

#: Weight of a radian of yaw against a metre, for the spacing of samples.
_YAW_WEIGHT = 0.3
#: Spacing of the curve before it is sampled, as a share of that of the samples.
_FINE = 2 / 15
#: How much longer than it is the end of a path may count.
_STRETCH = 2.0
#: Largest joint step between two samples, radians; beyond it the branch has jumped.
_MAX_STEP = 0.7
#: The elbow stays this far from straight, radians.
_ELBOW_MARGIN = 0.06


@dataclass(frozen=True)
class JointPath:
    """Configurations (n, 7) along a path, and the pad's positions (n, 3) and yaws (n,)."""

    q: Array
    tcp: Array
    yaw: Array


def waypoint(rail: float, xyz: Sequence[float] | Array, yaw: float, near: float) -> Waypoint:
    """Waypoint with the pad at ``xyz``; theta is the equivalent angle nearest to ``near``."""
    x, y, z = xyz
    theta = math.atan2(y, x - rail)
    theta = near + (theta - near + math.pi) % (2 * math.pi) - math.pi
    return (rail, theta, math.hypot(x - rail, y), z, yaw)


def rounded(points: Sequence[Waypoint], corner: float, step: float) -> Array:
    """Samples (n, 5) along ``points`` with corners rounded over ``corner`` metres.

    Neighbouring samples are at most ``step`` metres apart.
    """
    table = np.asarray(points, dtype=float)
    scale = np.array([1.0, max(0.6, table[:, 2].mean()), 1.0, 1.0, _YAW_WEIGHT])
    table = table * scale
    keep = np.r_[True, np.linalg.norm(np.diff(table, axis=0), axis=1) > 1e-6]
    table = table[keep]
    if len(table) == 1:
        table = np.repeat(table, 2, axis=0)
    curve = _smoothed(table, corner, _FINE * step)
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    count = max(8, math.ceil(along[-1] / step) + 1)
    at = np.linspace(0.0, along[-1], count)
    samples = np.stack([np.interp(at, along, curve[:, k]) for k in range(5)], axis=1)
    scaled: Array = samples / scale
    return scaled


def _smoothed(corners: Array, reach: float, fine: float) -> Array:
    """The polyline through ``corners`` (k, 5), rounded within ``reach`` of each inner corner.

    Points are ``fine`` metres apart. A cubic B-spline kernel keeps straight parts straight and
    curvature continuous, which the timing needs: a kink in curvature is a spike in acceleration. A
    first or last part too short for ``reach`` counts as up to twice as long, so that it stays
    straighter.
    """
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    for end in (0, -1):
        lengths[end] = max(1e-3, lengths[end], min(1.2 * reach, _STRETCH * lengths[end]))
    at_corner = np.r_[0.0, np.cumsum(lengths)]
    total = at_corner[-1]
    count = max(9, math.ceil(total / fine) + 1)
    # No wider than the whole line, or mirroring it would not keep its ends.
    half = max(1, min(round(reach / (total / (count - 1)) / 4), (count - 1) // 4))
    at = np.linspace(0.0, total, count)
    pad = 4 * half
    box = np.ones(2 * half + 1) / (2 * half + 1)
    kernel = np.convolve(np.convolve(box, box), np.convolve(box, box))
    columns = []
    for k in range(corners.shape[1]):
        line = np.interp(at, at_corner, corners[:, k])
        # Mirrored about the end points, so that the ends stay where they are.
        before = 2 * line[0] - line[pad:0:-1]
        after = 2 * line[-1] - line[-2 : -pad - 2 : -1]
        columns.append(np.convolve(np.r_[before, line, after], kernel, mode='valid'))
    return np.stack(columns, axis=1)


def positions(samples: Array) -> Array:
    """Pad positions (n, 3), frame `cell`, of waypoint samples (n, 5)."""
    rail, theta, radius, height, _ = samples.T
    return np.stack([rail + radius * np.cos(theta), radius * np.sin(theta), height], axis=1)


def joint_path(kinematics: CellKinematics, samples: Array, branch: int) -> JointPath | None:
    """Continuous joint path along ``samples`` (n, 5) in one branch of the inverse kinematics.

    ``None`` when a sample is out of reach, the elbow gets near straight, or a joint jumps.
    """
    tcp, yaw = positions(samples), samples[:, 4]
    # The yaw only turns the last joint, the other way round.
    q = kinematics.tool_down(samples[:, 0], tcp, np.zeros(len(tcp)), (branch,))[:, branch]
    if np.isnan(q).any() or np.abs(q[:, 3]).min() < _ELBOW_MARGIN:
        return None
    q[:, 1:] = np.unwrap(q[:, 1:], axis=0)
    q[:, 6] -= yaw
    if np.abs(np.diff(q, axis=0)).max() > _MAX_STEP:
        return None
    return JointPath(q, tcp, yaw)


def starting_at(path: JointPath, start: Array) -> JointPath | None:
    """``path`` with whole turns added so that it starts at ``start`` (7,), or ``None``.

    ``None`` when the path starts elsewhere by more than 0.1 rad, or leaves the joint limits. A
    smaller difference (tracking error after a stop) fades out over the first ten samples.
    """
    turns = np.round((start[1:] - path.q[0, 1:]) / (2 * math.pi)) * 2 * math.pi
    q = path.q.copy()
    q[:, 1:] += turns
    offset = start - q[0]
    if np.abs(offset).max() > 0.1:
        return None
    fade = np.clip(1.0 - np.arange(len(q)) / 10.0, 0.0, 1.0)
    q += fade[:, None] * offset
    return JointPath(q, path.tcp, path.yaw) if within_limits(q) else None


def within_limits(q: Array) -> bool:
    """Whether every joint of the configurations (n, 7) is inside its limits."""
    limits = np.array([joint_limit(i) for i in range(6)])
    return bool((np.abs(q[:, 1:]) <= limits).all())
