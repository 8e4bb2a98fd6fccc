"""Motion plans that were made for check_placements, kept for the goal that follows."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace

from arm_executor.model.arm_interface import (
    Arm,
    MotionError,
    MotionPlan,
    MotionUnderWay,
    PlaceRequest,
)
from pack_msgs_py.geometry.pose import Pose, turn_between

#: How far the target may be from where a plan took it to be: the arm lets go half a millimetre
#: above what it stands on. And the other boxes: sideways half of the gap that profile `cell` keeps;
#: a box passes over them with more air than they can be higher.
TARGET_DRIFT_M, DRIFT_M, DRIFT_UP_M, DRIFT_RAD = 0.0005, 0.002, 0.005, 0.005
#: Neighbours may stand this much elsewhere without a new plan.
NEIGHBOUR_DRIFT_M = 0.02
#: Plans kept at a time.
_KEPT = 32

Poses = Mapping[str, Pose]


@dataclass(frozen=True)
class _Kept:
    """An answer of the arm, and what it rests on.

    ``poses`` are of every box in the bins, ``first`` is the motion that must end as planned first.
    """

    request: PlaceRequest
    poses: Poses
    first: MotionPlan | None
    answer: MotionPlan | MotionError


class PlanCache:
    """Plans and refusals of the arm by what was asked for and by where everything stood.

    Safe to use from two threads: one that moves, and one that plans ahead meanwhile.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # The arm plans one motion at a time: who asks for one that is being planned gets it too.
        self._planning = threading.Lock()
        self._kept: list[_Kept] = []
        self._last: MotionPlan | None = None

    def plan(
        self, arm: Arm, request: PlaceRequest, poses: Poses, after: MotionUnderWay | None = None
    ) -> MotionPlan:
        """The plan for ``request``, made now if there is none; may raise ``MotionError``.

        ``poses`` of all boxes in the bins, bin frame, are those at the start of the motion, which
        follows that of ``after`` if there is one. One that was kept cost no planning.
        """
        with self._planning:
            kept = self._kept_answer(request, poses, after)
            answer = kept or self._made(arm, request, poses, after)
        if isinstance(answer, MotionError):
            raise MotionError(answer.code, str(answer))
        planning_s = answer.planning_s if kept is None else 0.0
        return replace(answer, request=request, planning_s=planning_s)

    def _kept_answer(
        self, request: PlaceRequest, poses: Poses, after: MotionUnderWay | None
    ) -> MotionPlan | MotionError | None:
        with self._lock:
            first = self._first(after)
            answers = (
                kept.answer
                for kept in self._kept
                if kept.first is first and _serves(kept, request, poses)
            )
            return next(answers, None)

    def _made(
        self, arm: Arm, request: PlaceRequest, poses: Poses, after: MotionUnderWay | None
    ) -> MotionPlan | MotionError:
        answer: MotionPlan | MotionError
        try:
            answer = arm.plan(request, after)
        except MotionError as error:
            answer = error
        with self._lock:
            made = _Kept(request, dict(poses), self._first(after), answer)
            self._kept = [*self._kept[1 - _KEPT :], made]
        return answer

    def _first(self, after: MotionUnderWay | None) -> MotionPlan | None:
        """The motion to wait for; ``None`` when it has ended as planned, or there is none."""
        return None if after is None or after.plan is self._last else after.plan

    def moved(self, motion: MotionPlan, *, as_planned: bool) -> None:
        """The arm has moved: only plans that start where ``motion`` should end are of any use."""
        with self._lock:
            following = [replace(kept, first=None) for kept in self._kept if kept.first is motion]
            self._kept = following if as_planned else []
            self._last = motion if as_planned else None

    def clear(self) -> None:
        """Forget all plans."""
        with self._lock:
            self._kept, self._last = [], None


def _serves(kept: _Kept, request: PlaceRequest, poses: Poses) -> bool:
    made = kept.request
    return (
        made.box == request.box
        and made.station == request.station
        and _near(made.pick, request.pick, TARGET_DRIFT_M)
        and _near(made.target, request.target, TARGET_DRIFT_M)
        # One that has gone since is no matter, one that has come is.
        and all(
            any(box == other and _near(was, now, NEIGHBOUR_DRIFT_M) for other, was in made.belt)
            for box, now in request.belt
        )
        and kept.poses.keys() == poses.keys()
        and all(_stays(was, poses[box_id]) for box_id, was in kept.poses.items())
    )


def _stays(was: Pose, now: Pose) -> bool:
    """Whether a box in a bin is where a plan took it to be."""
    aside = math.dist(was.position[:2], now.position[:2])
    up = abs(was.position[2] - now.position[2])
    return was is now or (
        aside <= DRIFT_M and up <= DRIFT_UP_M and turn_between(was, now) <= DRIFT_RAD
    )


def _near(was: Pose, now: Pose, metres: float) -> bool:
    return was is now or (
        math.dist(was.position, now.position) <= metres and turn_between(was, now) <= DRIFT_RAD
    )
