"""Forward and inverse kinematics as machine code, for :mod:`arm_executor.model.kinematics`.

Nothing here calls another file, so that Numba's cache is never older than its source.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model='numpy')
def solutions_of(lengths, poses, signs, columns):  # type: ignore[no-untyped-def]
    """Joint angles (n, 8, 6) in (-pi, pi], NaN where there is none, or it is not asked for.

    ``lengths`` (6,) are d1, a2, a3, d4, d5, d6 of the robot, ``poses`` (n, 4, 4) of its flange,
    ``signs`` (8, 3) those of shoulder, wrist and elbow of each column, ``columns`` the ones wanted.
    """
    d1, a2, a3, d4, d5, d6 = lengths
    found = np.full((len(poses), 8, 6), np.nan)
    for i in range(len(poses)):
        pose = poses[i]
        x, y, z = pose[0, 3], pose[1, 3], pose[2, 3]
        wrist_x, wrist_y = x - d6 * pose[0, 2], y - d6 * pose[1, 2]
        radius = math.hypot(wrist_x, wrist_y)
        if not radius >= d4:
            continue
        spread, heading = math.acos(d4 / radius), math.atan2(wrist_y, wrist_x)
        for column in columns:
            shoulder, flip, elbow = signs[column]
            q1 = heading + shoulder * spread + math.pi / 2
            c1, s1 = math.cos(q1), math.sin(q1)
            c5 = (x * s1 - y * c1 - d4) / d6
            if not abs(c5) < 1 + 1e-9:
                continue
            c5 = min(1.0, max(-1.0, c5))
            q5 = flip * math.acos(c5)
            s5 = math.sin(q5)
            # Rows of the arm plane's frame: along the arm, up, and its normal.
            along = (
                c1 * pose[0, 0] + s1 * pose[1, 0],
                c1 * pose[0, 1] + s1 * pose[1, 1],
                c1 * pose[0, 2] + s1 * pose[1, 2],
            )
            normal_x = s1 * pose[0, 0] - c1 * pose[1, 0]
            normal_y = s1 * pose[0, 1] - c1 * pose[1, 1]
            q6 = math.atan2(-normal_y / s5, normal_x / s5)
            c6, s6 = math.cos(q6), math.sin(q6)
            # Axis x of frame 4, and so q2 + q3 + q4, by undoing joints 6 and 5.
            x_along = (along[0] * c6 - along[1] * s6) * c5 - along[2] * s5
            x_up = (pose[2, 0] * c6 - pose[2, 1] * s6) * c5 - pose[2, 2] * s5
            q234 = math.atan2(x_up, x_along)
            # Frame 5's y is the direction of d5 reversed; go back from the flange to joint 4.
            px = c1 * x + s1 * y - d6 * along[2] + d5 * (along[0] * s6 + along[1] * c6)
            py = z - d1 - d6 * pose[2, 2] + d5 * (pose[2, 0] * s6 + pose[2, 1] * c6)
            c3 = (px * px + py * py - a2 * a2 - a3 * a3) / (2 * a2 * a3)
            if not abs(c3) <= 1:
                continue
            q3 = elbow * math.acos(c3)
            q2 = math.atan2(py, px) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
            angles = (q1, q2, q3, q234 - q2 - q3, q5, q6)
            for joint in range(6):
                turned = (math.pi - angles[joint]) % (2 * math.pi) - math.pi
                found[i, column, joint] = -turned
            if math.isnan(q6):
                found[i, column] = np.nan
    return found


@njit(cache=True, nogil=True, error_model='numpy')
def frames_of(lengths, twists, angles):  # type: ignore[no-untyped-def]
    """Denavit-Hartenberg frames 1 to 6 (n, 6, 4, 4) for joint angles (n, 6).

    ``lengths`` are as above, ``twists`` (6, 2) cosine and sine of the twist of each joint.
    """
    d1, a2, a3, d4, d5, d6 = lengths
    offsets = (d1, 0.0, 0.0, d4, d5, d6)
    bars = (0.0, a2, a3, 0.0, 0.0, 0.0)
    frames = np.zeros((len(angles), 6, 4, 4))
    for i in range(len(angles)):
        for joint in range(6):
            c, s = math.cos(angles[i, joint]), math.sin(angles[i, joint])
            ca, sa = twists[joint]
            bar, offset = bars[joint], offsets[joint]
            frame = frames[i, joint]
            frame[3, 3] = 1.0
            for row in range(3):
                if joint == 0:
                    x, y, z = 1.0 * (row == 0), 1.0 * (row == 1), 1.0 * (row == 2)
                    at = 0.0
                else:
                    before = frames[i, joint - 1]
                    x, y, z, at = before[row, 0], before[row, 1], before[row, 2], before[row, 3]
                frame[row, 0] = x * c + y * s
                frame[row, 1] = (y * c - x * s) * ca + z * sa
                frame[row, 2] = (x * s - y * c) * sa + z * ca
                frame[row, 3] = (x * c + y * s) * bar + z * offset + at
    return frames
