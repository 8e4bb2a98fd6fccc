"""Stances: in which posture, and from where on its rail, the arm can do a task.

Only inverse kinematics at five points and an estimate of time; collisions come later.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.kinematics import BRANCHES, CellKinematics
from arm_executor.motion.task import Task
from arm_executor.motion.timing import Timing

Array = NDArray[np.float64]

#: Robot seconds to build up the vacuum, and to lose it; assumed.
GRIP_S = RELEASE_S = 0.25
#: Where the arm stands on the rail, relative to the target; metres.
_RAIL_OFFSETS = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0, 1.25, -1.25)
#: Elbow above the shoulder, in either posture of shoulder and wrist.
_ELBOW_UP = tuple(i for i, (shoulder, _, elbow) in enumerate(BRANCHES) if shoulder == elbow)
#: A path overlaps its legs: it takes about this share of their sum.
_OVERLAP = 0.75
#: Seconds by which another posture must be quicker, since it mostly pays for one box only.
_SWITCH_S = 0.5


@dataclass(frozen=True)
class Stance:
    """How the arm stands: posture (branch), and places on the rail.

    ``around`` is 0, or a whole turn to swing the other way round.
    """

    estimate: float
    branch: int
    pick_rail: float
    place_rail: float
    around: float = 0.0


def find_stances(
    kinematics: CellKinematics, timing: Timing, task: Task, start: Array, branch: int
) -> list[Stance]:
    """Every stance that reaches pick and place, the quickest by estimate first.

    ``kinematics`` and ``timing`` are of the robot, ``task`` is what it is to do; ``start`` (7,) is
    where the arm is, in posture ``branch``.
    """
    rail = kinematics.layout.rail
    options = set()
    for offset in _RAIL_OFFSETS:
        place_rail = rail.nearest(task.place[0] + offset)
        near = rail.nearest(task.pick[0] + _clip(place_rail - task.pick[0], -0.5, 0.5))
        for pick_rail in (float(start[0]), near, rail.nearest(_clip(place_rail, -1.0, 1.0))):
            options.add((round(pick_rail, 6), round(place_rail, 6)))
    lifted, over = (*task.pick[:2], task.over), (*task.place[:2], task.over)
    rows = [
        (where, point)
        for pick_rail, place_rail in sorted(options)
        for where, point in (
            (pick_rail, task.pick),
            (pick_rail, lifted),
            (place_rail, over),
            (place_rail, task.place),
            (pick_rail, task.hover),
        )
    ]
    rails, points = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    q = kinematics.tool_down(rails, points, np.zeros(len(rows)), _ELBOW_UP)
    legs = q.reshape(len(options), 5, 8, 7).swapaxes(1, 2)
    pick, lift, above, place, hover = (legs[:, :, k] for k in range(5))
    estimate = (
        GRIP_S
        + RELEASE_S
        + _OVERLAP
        * (
            least_seconds(timing, start, pick)
            + least_seconds(timing, pick, lift)
            + least_seconds(timing, lift, above)
            + 2 * least_seconds(timing, above, place)
            + least_seconds(timing, above, hover)
        )
    )
    # Another posture is taken above the pick point, in a motion of its own.
    estimate += np.where(
        np.arange(8) == branch, 0.0, _SWITCH_S + least_seconds(timing, start, hover)
    )
    stances = [
        Stance(float(estimate[row, posture]), posture, pick_rail, place_rail)
        for row, (pick_rail, place_rail) in enumerate(sorted(options))
        for posture in _ELBOW_UP
        if np.isfinite(estimate[row, posture])
    ]
    return sorted(stances, key=lambda stance: stance.estimate)


def least_seconds(timing: Timing, start: Array, end: Array) -> Array:
    """Least seconds between configurations (..., 7) at rest, without the last joint."""
    way = np.abs(end - start)[..., :6]
    way[..., 1:] = np.minimum(way[..., 1:], np.abs(2 * math.pi - way[..., 1:]))
    speed, acceleration = timing.max_speed[:6], timing.max_acceleration[:6]
    ramp = speed * speed / acceleration
    seconds = np.where(
        way > ramp, way / speed + speed / acceleration, 2 * np.sqrt(way / acceleration)
    )
    most: Array = seconds.max(axis=-1)
    return most


def _clip(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))
