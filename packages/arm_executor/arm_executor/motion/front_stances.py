"""Stances for a box that is taken by its front: where the arm stands, and in which posture.

Only inverse kinematics and an estimate of time; collisions come later. Metres and radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.kinematics import BRANCHES, CellKinematics
from arm_executor.motion.path import within_limits
from arm_executor.motion.stances import least_seconds
from arm_executor.motion.task import Task
from arm_executor.motion.timing import Timing
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Where the arm stands on the rail to take a front: nearer its forearm meets the carriage.
_PICK_RAILS = (-1.2, -1.05, -0.9, -0.75, -0.6, -0.45, 0.45, 0.6, 0.75, 0.9, 1.05, 1.2)
#: And to place, relative to the target.
_PLACE_OFFSETS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.2, -1.2)
#: Postures with the elbow above the shoulder.
_ELBOW_UP = tuple(i for i, (shoulder, _, elbow) in enumerate(BRANCHES) if shoulder == elbow)
_MAX_TRIED = 60
#: A quarter turn of the pad is the same pad.
QUARTER = math.pi / 2
#: A wrist nearer to its singular posture than this turns too fast, sine of joint 5.
_LEAST_SINE = 0.15
#: Corners are cut: above the place the pad is this much higher than the box needs.
_RISE = 0.15


@dataclass(frozen=True)
class FrontStance:
    """One way to stand: configurations (7,) at the pick, above the place, at the place.

    ``estimate`` is robot time in seconds, ``branch`` the posture above the place, ``key`` tells
    apart which place on the rail it is for the grip and for the place.
    """

    estimate: float
    branch: int
    key: tuple[int, int]
    pick: Array
    above: Array
    place: Array


def find_front_stances(
    kinematics: CellKinematics, timing: Timing, task: Task, pick: Vec3, q: Array
) -> list[FrontStance]:
    """Ways to stand, the quickest by estimate first.

    ``kinematics`` and ``timing`` are of the robot, ``task`` is what it is to do with the box lying
    as it is taken, ``pick`` the middle of its front on the belt, ``q`` (7,) where the arm is.
    """
    rail = kinematics.layout.rail
    rails = np.unique(np.clip(_PICK_RAILS, rail.x_min, rail.x_max))
    level = kinematics.tool_ahead(rails, np.tile(pick, (len(rails), 1)), task.pick_yaw).reshape(
        -1, 7
    )
    level = level[~np.isnan(level).any(axis=1)]
    level = level[np.abs(np.sin(level[:, 5])) > _LEAST_SINE]
    places = np.unique(np.clip(task.place[0] + np.array(_PLACE_OFFSETS), rail.x_min, rail.x_max))
    yaws = np.full(len(places), task.turn)
    over = (*task.place[:2], max(task.over, task.place[2] + 0.05) + _RISE)
    low, high = (
        kinematics.tool_down(places, np.tile(point, (len(places), 1)), yaws, _ELBOW_UP)
        for point in (task.place, over)
    )
    rows = np.argwhere(~(np.isnan(low) | np.isnan(high)).any(axis=2))
    if not len(rows) or not len(level):
        return []
    place, above = low[tuple(rows.T)], high[tuple(rows.T)]
    to_grip = least_seconds(timing, q, level)
    to_above = least_seconds(timing, level[:, None], above[None])
    rest = 1.5 * least_seconds(timing, above, place)
    rest += 0.8 * least_seconds(timing, above, q)
    estimate = to_grip[:, None] + to_above + rest[None]
    order = np.argsort(estimate, axis=None)[:_MAX_TRIED]
    stances = []
    for grip, row in zip(*np.unravel_index(order, estimate.shape), strict=True):
        branch = int(rows[row, 1])
        stance = _stance(q, level[grip], above[row], place[row], branch)
        if stance is not None:
            key = (int(grip), int(row))
            stances.append(replace(stance, estimate=float(estimate[grip, row]), key=key))
    return stances


def _stance(q: Array, grip: Array, above: Array, place: Array, branch: int) -> FrontStance | None:
    grip, above, place = grip.copy(), above.copy(), place.copy()
    unwind(grip, q)
    # The last joint: pick and place share the quarter turn by which the pad is held.
    turn = QUARTER * round((q[6] / 2 - grip[6]) / QUARTER)
    grip[6] += turn
    above[6] += turn
    unwind(above, grip)
    place[6] += turn
    unwind(place, above)
    if not within_limits(np.array([grip, above, place])):
        return None
    return FrontStance(0.0, branch, (0, 0), grip, above, place)


def unwind(q: Array, near: Array) -> None:
    """Add whole turns to joints 1 to 6 of ``q`` (7,) so that each is nearest to ``near``."""
    q[1:] += np.round((near[1:] - q[1:]) / (2 * math.pi)) * 2 * math.pi
