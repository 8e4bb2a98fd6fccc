"""An arm without physics: it only spends the time that the motion would take.

For dry runs, soaks, planner studies and tests. Reach and time are predicted as the arm in physics
plans them (:mod:`arm_executor.motion.predictor`). Every box comes to rest exactly where it should,
unless it or what lies beneath is not what was scanned, or a fault is asked for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.known_bins import BinContent, KnownBins
from arm_executor.arms.prediction import PredictedCell
from arm_executor.arms.sinking import sunk
from arm_executor.arms.true_boxes import Truth, mismatch, missed_by_pad, true_rest
from arm_executor.model.arm_interface import (
    FoundAt,
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
    MotionUnderWay,
    PlaceRequest,
)
from arm_executor.model.layout import Layout
from arm_executor.motion.planned import PlannedMotion
from arm_executor.motion.stances import GRIP_S, RELEASE_S
from arm_executor.motion.timing import MotionLimits
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.values import Bin, Box

Array = NDArray[np.float64]

#: A waiting thread looks this often whether progress is due; a stop is noticed at once.
SLICE_S = 0.1


_AT_PLANNING = frozenset(
    {
        ErrorCode.NO_IK_SOLUTION,
        ErrorCode.START_STATE_INVALID,
        ErrorCode.PATH_IN_COLLISION,
        ErrorCode.LIMITS_EXCEEDED,
    }
)
_IN_TRANSFER = frozenset(
    {
        ErrorCode.BOX_LOST,
        ErrorCode.COLLISION,
        ErrorCode.PATH_TOLERANCE_VIOLATED,
        ErrorCode.PROTECTIVE_STOP,
    }
)
#: How far a fault puts a box out of place, and how late it makes the arm.
FAULT_SHIFT_M, FAULT_DELAY_S = 0.02, 60.0


def phases_of(motion: PlannedMotion) -> dict[Phase, float]:
    """Robot time of ``motion`` by phase, seconds."""
    return {
        Phase.APPROACHING: motion.approach.duration,
        Phase.GRASPING: GRIP_S,
        Phase.TRANSFERRING: motion.lowering_s,
        Phase.LOWERING: motion.carry.duration - motion.lowering_s,
        Phase.RELEASING: RELEASE_S,
        Phase.RETREATING: motion.retreat.duration,
    }


@dataclass(frozen=True)
class _Predicted:
    """The last prediction: what is predicted is mostly planned next."""

    request: PlaceRequest
    start: Array
    bins: dict[str, BinContent]
    motion: PlannedMotion

    def serves(self, request: PlaceRequest, start: Array, bins: dict[str, BinContent]) -> bool:
        """Whether it is about that."""
        return self.request == request and np.array_equal(self.start, start) and self.bins == bins


class TimedArm:
    """An :class:`~arm_executor.model.arm_interface.Arm` that spends the predicted time, no more.

    Parameters
    ----------
    layout : where everything stands.
    speed : robot seconds per wall-clock second; 0 spends no time at all.
    faults : what goes wrong with which box, by id; read anew for each motion. Codes of planning
        are raised by :meth:`plan`; ``GRASP_FAILED`` comes at the grasp; ``BOX_LOST``,
        ``COLLISION``, ``PATH_TOLERANCE_VIOLATED`` and ``PROTECTIVE_STOP`` in the transfer;
        ``PLACED_OUT_OF_TOLERANCE`` and ``OTHERS_DISTURBED`` shift a box by 20 mm;
        ``DEADLINE_MISSED`` makes the motion 60 s longer than predicted; ``UNKNOWN`` raises.
    truth : what the boxes really are; without it they are as scanned.
    limits : assumed limits of motion.
    """

    def __init__(
        self,
        layout: Layout | None = None,
        *,
        speed: float = 1.0,
        faults: Mapping[str, ErrorCode] | None = None,
        truth: Truth | None = None,
        limits: MotionLimits | None = None,
    ) -> None:
        self._truth = truth or Truth()
        self._layout = layout or Layout()
        self._speed = speed
        self._faults = {} if faults is None else faults
        self._cell = PredictedCell(self._layout, limits)
        self._at = self._cell.home
        self._bins = KnownBins()
        self._held: str | None = None
        self._last: _Predicted | None = None
        self._moved_s = 0.0

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Every box stays where ``poses`` says."""
        self._truth.keep({placed.box.id for bin_ in bins for placed in bin_.boxes})
        return self._bins.set_bins(bins, poses)

    def plan(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> MotionPlan:
        """Predict the motion, from where the arm is, or where ``after`` ends."""
        started = time.perf_counter()
        fault = self._faults.get(request.box.id)
        if fault in _AT_PLANNING:
            msg = f'box {request.box.id!r}: {fault.name}, as asked for'
            raise MotionError(fault, msg)
        motion = self._motion(request, after)
        return MotionPlan(
            request,
            motion.duration,
            time.perf_counter() - started,
            motion,
            after_pick_s=motion.duration_after_pick,
        )

    def predict(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> float:
        """See :meth:`arm_executor.model.arm_interface.PredictingArm.predict`; it is exact."""
        return self._motion(request, after).duration

    def _motion(self, request: PlaceRequest, after: MotionUnderWay | None) -> PlannedMotion:
        if self._bins.spec(request.station) is None:
            msg = f'there is no bin at station {request.station!r}'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        start = self._at if after is None else after.plan.detail.retreat.q[-1]
        bins, known = self._bins.standing(after), self._last
        if known is None or not known.serves(request, start, bins):
            motion = self._cell.motion(request, start, bins)
            self._last = known = _Predicted(request, start, bins, motion)
        return known.motion

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """Spend the time of each phase, and call the hooks where they belong."""
        request = plan.request
        box_id = request.box.id
        fault = self._faults.get(box_id)
        if fault is ErrorCode.UNKNOWN:
            msg = f'box {box_id!r}: the arm fails, as asked for'
            raise RuntimeError(msg)
        spent: dict[Phase, float] = {}
        true = self._truth.lying(box_id, request.pick)
        released = False
        self._at = self._cell.home  # wherever it ends early
        for phase, duration in phases_of(plan.detail).items():
            if phase is Phase.RELEASING:
                hooks.releasing()
            if not self._spend(phase, duration, spent, plan.predicted_s, hooks, stop):
                return _ended(ErrorCode.CANCELED, f'stopped while {phase.name.lower()}', spent)
            if phase is Phase.GRASPING:
                missed = true is not None and missed_by_pad(request.pick, true)
                if missed or fault is ErrorCode.GRASP_FAILED:
                    return _ended(ErrorCode.GRASP_FAILED, f'no vacuum on box {box_id!r}', spent)
                self._held = box_id
                self._truth.picked(box_id)
                hooks.picked()
                wrong = '' if true is None else mismatch(request.box, true.box)
                if wrong:
                    return _ended(ErrorCode.BOX_MISMATCH, wrong, spent)
            elif phase is Phase.TRANSFERRING and fault in _IN_TRANSFER:
                if fault is ErrorCode.BOX_LOST:
                    self._held = None
                return _ended(fault, f'box {box_id!r}: {fault.name}, as asked for', spent)
            elif phase is Phase.RELEASING:
                self._held = None
                hooks.released()
                released = True
        assert released
        self._at = plan.detail.retreat.q[-1]
        return self._measured(request, fault, spent)

    def _spend(
        self,
        phase: Phase,
        duration: float,
        spent: dict[Phase, float],
        total: float,
        hooks: MotionHooks,
        stop: threading.Event,
    ) -> bool:
        """Let ``duration`` of robot time pass; ``False`` when stopped before its end.

        The release itself cannot be stopped: the vacuum is already going.
        """
        before = sum(spent.values())
        stoppable = phase not in (Phase.RELEASING, Phase.RETREATING)
        started = time.monotonic()
        while True:
            wall = time.monotonic() - started
            done = duration if self._speed == 0 else min(duration, wall * self._speed)
            self._moved_s += done - spent.get(phase, 0.0)
            spent[phase] = done
            hooks.phase(phase, min(1.0, (before + done) / total))
            if stoppable and stop.is_set():
                return False
            if done >= duration:
                return True
            pause = min(SLICE_S, (duration - done) / self._speed)
            if stoppable:
                stop.wait(pause)
            else:
                time.sleep(pause)

    def _measured(
        self, request: PlaceRequest, fault: ErrorCode | None, spent: dict[Phase, float]
    ) -> MotionResult:
        contents = self._bins.poses[request.station]
        moved, code = 0.0, ErrorCode.NONE
        true = self._truth.find(request.box.id)
        measured = request.target
        if true is not None:
            measured = self._at_rest(true_rest(request, true), true.box, contents)
        if fault is ErrorCode.PLACED_OUT_OF_TOLERANCE:
            measured, code = _shifted(measured), fault
        elif fault is ErrorCode.OTHERS_DISTURBED and contents:
            last = next(reversed(contents))
            contents[last] = _shifted(contents[last])
            moved, code = FAULT_SHIFT_M, fault
        elif fault is ErrorCode.DEADLINE_MISSED:
            spent[Phase.RETREATING] += FAULT_DELAY_S
        others = dict(contents)
        self._bins.place(request.station, request.box, measured)
        text = '' if code is ErrorCode.NONE else f'{code.name}, as asked for'
        return replace(
            _ended(code, text, spent), measured=measured, others=others, others_moved_m=moved
        )

    def _at_rest(self, pose: Pose, box: Box, contents: Mapping[str, Pose]) -> Pose:
        """Where ``box``, let go at ``pose``, comes to rest on what really lies beneath it."""
        known = ((self._truth.find(box_id), at) for box_id, at in contents.items())
        others = [(metres(true.box.size_mm), at) for true, at in known if true is not None]
        return sunk(pose, metres(box.size_mm), others)

    def return_to_belt(self) -> bool:
        """The held box is back at the pick point at once."""
        had_box = self._held is not None
        self._held = None
        return had_box

    def find_box(self, box: Box, station: str, target: Pose, *, released: bool) -> FoundAt:
        """Its world begins anew as the journal says, so nothing in it is in doubt."""
        return FoundAt.IN_BIN if released else FoundAt.ON_BELT

    def withdraw(self) -> bool:
        """It is never in the way."""
        return True

    def holds(self) -> str | None:
        """Id of the box in the gripper."""
        return self._held

    def tracking_error(self) -> float:
        """It has no joints that could stray."""
        return 0.0

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """It has no joints."""
        return (), ()

    def robot_time(self) -> float:
        """See :meth:`arm_executor.model.arm_interface.ClockedArm.robot_time`."""
        return self._moved_s

    def close(self) -> None:
        """Nothing to give back."""


def _ended(code: ErrorCode, message: str, spent: Mapping[Phase, float]) -> MotionResult:
    return MotionResult(code, message, motion_s=sum(spent.values()), split_s=dict(spent))


def _shifted(pose: Pose) -> Pose:
    x, y, z = pose.position
    return replace(pose, position=(x + FAULT_SHIFT_M, y, z))
