"""An arm without physics: it only spends the time that the motion would take.

For soaks, planner studies and tests. Every box comes to rest exactly where it should, unless it
is not what was scanned, or a fault is asked for.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

from arm_executor.arms.kind import ArmKind
from arm_executor.arms.true_boxes import Truth, mismatch, missed_by_pad, true_rest
from arm_executor.model.arm_interface import (
    MotionError,
    MotionHooks,
    MotionPlan,
    MotionResult,
    MotionUnderWay,
    PlaceRequest,
)
from arm_executor.model.layout import Layout, bin_frame
from arm_executor.motion.grasp import as_lying, by_front
from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin

#: Speed and acceleration of the tool centre point, assumed. Together with the rail of the layout
#: and the two allowances below they give medians of 4.1 s (EQ), 4.4 s (LDC), 5.1 s (PAL and RC)
#: at stations A and B and 5.2 s (LDC) at C, near those measured with the physics prototype.
TOOL_SPEED_M_S, TOOL_ACCELERATION_M_S2 = 1.5, 5.0
#: Base joint of a UR20 (data sheet: 120 deg/s); the acceleration is assumed.
TURN_SPEED_RAD_S, TURN_ACCELERATION_RAD_S2 = math.radians(120.0), 5.0
#: The arm reaches this far to the side while the rail carries it less.
LEAN_M = 0.3
#: Turn of the base between belt and station C; the elbow makes up for the rest of the half turn.
HALF_TURN_RAD = math.radians(120.0)
#: Building up, and breaking, the vacuum: assumed.
GRIP_S = 0.25
#: Air between the carried box and the rims that it passes over.
CLEARANCE_M = 0.10
#: How much longer a box takes that is taken by its front: to get the tool level, and down again;
#: medians of planned motions.
TO_LEVEL_S, FROM_LEVEL_S = 1.0, 0.7
#: A waiting thread looks this often whether progress is due; a stop is noticed at once.
SLICE_S = 0.1

#: Phases after the grasp.
AFTER_PICK = (Phase.TRANSFERRING, Phase.LOWERING, Phase.RELEASING, Phase.RETREATING)

_AT_PLANNING = frozenset(
    {
        ErrorCode.NO_IK_SOLUTION,
        ErrorCode.START_STATE_INVALID,
        ErrorCode.PATH_IN_COLLISION,
        ErrorCode.LIMITS_EXCEEDED,
    }
)
_IN_TRANSFER = frozenset(
    {ErrorCode.BOX_LOST, ErrorCode.PATH_TOLERANCE_VIOLATED, ErrorCode.PROTECTIVE_STOP}
)
#: How far a fault puts a box out of place, and how late it makes the arm.
FAULT_SHIFT_M, FAULT_DELAY_S = 0.02, 60.0


def trapezoid_time(distance: float, speed: float, acceleration: float) -> float:
    """Seconds from rest to rest over ``distance`` with a trapezoidal speed profile.

    >>> trapezoid_time(3.0, 1.5, 3.0)
    2.5
    """
    if distance * acceleration < speed * speed:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration


def predict(request: PlaceRequest, target: Bin, layout: Layout) -> dict[Phase, float]:
    """Robot time by phase, seconds: a simple model of the arm described in the layout.

    The tool waits over the pick point, as high as the tallest box; goes down to the box; lifts it
    over the rim of the bin while the rail and the turning base bring it over its place; lowers
    it; goes up and back over the pick point. Going up overlaps half with going across.
    """
    front = by_front(request)
    request = request if front else as_lying(request)
    frame = bin_frame(layout, target.station, target.spec)
    place = frame.to_cell(request.target).position
    height = request.box.size_mm[2] / 1e3
    pick_top = request.pick.position[2] + height / 2
    place_top = place[2] + height / 2
    rim = frame.origin[2] + target.spec.size_mm[2] / 1e3
    over = max(rim + CLEARANCE_M + height, pick_top, place_top + CLEARANCE_M)
    wait_height = layout.conveyor.top_z + layout.conveyor.tallest_box + CLEARANCE_M

    def tool(distance: float) -> float:
        return trapezoid_time(abs(distance), TOOL_SPEED_M_S, TOOL_ACCELERATION_M_S2)

    rail = trapezoid_time(
        max(0.0, abs(place[0] - request.pick.position[0]) - LEAN_M),
        layout.rail.speed,
        layout.rail.acceleration,
    )
    half_turn = place[1] * request.pick.position[1] < 0
    turn = trapezoid_time(
        HALF_TURN_RAD if half_turn else 0.0, TURN_SPEED_RAD_S, TURN_ACCELERATION_RAD_S2
    )
    across = max(rail, turn)
    to_level, from_level = (TO_LEVEL_S, FROM_LEVEL_S) if front else (0.0, 0.0)
    return {
        Phase.APPROACHING: tool(wait_height - pick_top) + to_level,
        Phase.GRASPING: GRIP_S,
        Phase.TRANSFERRING: tool(over - pick_top) / 2 + across + from_level,
        Phase.LOWERING: tool(over - place_top),
        Phase.RELEASING: GRIP_S,
        Phase.RETREATING: tool(over - place_top) / 2 + across,
    }


class TimedArm:
    """An :class:`~arm_executor.model.arm_interface.Arm` that spends the predicted time, no more.

    Parameters
    ----------
    layout : where everything stands.
    speed : robot seconds per wall-clock second; 0 spends no time at all.
    faults : what goes wrong with which box, by id; read anew for each motion. Codes of planning
        are raised by :meth:`plan`; ``GRASP_FAILED`` comes at the grasp; ``BOX_LOST``,
        ``PATH_TOLERANCE_VIOLATED`` and ``PROTECTIVE_STOP`` in the transfer;
        ``PLACED_OUT_OF_TOLERANCE`` and ``OTHERS_DISTURBED`` shift a box by 20 mm;
        ``DEADLINE_MISSED`` makes the motion 60 s longer than predicted; ``UNKNOWN`` raises.
    truth : what the boxes really are; without it they are as scanned.
    """

    def __init__(
        self,
        layout: Layout | None = None,
        *,
        speed: float = 1.0,
        faults: Mapping[str, ErrorCode] | None = None,
        truth: Truth | None = None,
    ) -> None:
        self._truth = truth or Truth()
        self._layout = layout or Layout()
        self._speed = speed
        self._faults = {} if faults is None else faults
        self._bins: dict[str, Bin] = {}
        self._contents: dict[str, dict[str, Pose]] = {}
        self._held: str | None = None

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Every box stays where ``poses`` says."""
        self._bins = {bin_.station: bin_ for bin_ in bins}
        self._truth.keep({placed.box.id for bin_ in bins for placed in bin_.boxes})
        self._contents = {
            bin_.station: {placed.box.id: poses[placed.box.id] for placed in bin_.boxes}
            for bin_ in bins
        }
        return {
            box_id: pose for content in self._contents.values() for box_id, pose in content.items()
        }

    def plan(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> MotionPlan:
        """Predict the time by :func:`predict`; what the other motion does has no bearing on it."""
        started = time.perf_counter()
        target = self._bins.get(request.station)
        if target is None:
            msg = f'there is no bin at station {request.station!r}'
            raise MotionError(ErrorCode.START_STATE_INVALID, msg)
        fault = self._faults.get(request.box.id)
        if fault in _AT_PLANNING:
            msg = f'box {request.box.id!r}: {fault.name}, as asked for'
            raise MotionError(fault, msg)
        split = predict(request, target, self._layout)
        total_s, after_s = sum(split.values()), sum(split[phase] for phase in AFTER_PICK)
        return MotionPlan(
            request, total_s, time.perf_counter() - started, split, after_pick_s=after_s
        )

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """Spend the time of each phase, and call the hooks where they belong."""
        request = plan.request
        box_id = request.box.id
        fault = self._faults.get(box_id)
        if fault is ErrorCode.UNKNOWN:
            msg = f'box {box_id!r}: the arm fails, as asked for'
            raise RuntimeError(msg)
        spent: dict[Phase, float] = {}
        true = self._truth.find(box_id)
        released = False
        for phase, duration in plan.detail.items():
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
        contents = self._contents[request.station]
        moved, code = 0.0, ErrorCode.NONE
        true = self._truth.find(request.box.id)
        measured = request.target if true is None else true_rest(request, true)
        if fault is ErrorCode.PLACED_OUT_OF_TOLERANCE:
            measured, code = _shifted(measured), fault
        elif fault is ErrorCode.OTHERS_DISTURBED and contents:
            last = next(reversed(contents))
            contents[last] = _shifted(contents[last])
            moved, code = FAULT_SHIFT_M, fault
        elif fault is ErrorCode.DEADLINE_MISSED:
            spent[Phase.RETREATING] += FAULT_DELAY_S
        others = dict(contents)
        contents[request.box.id] = measured
        text = '' if code is ErrorCode.NONE else f'{code.name}, as asked for'
        return replace(
            _ended(code, text, spent), measured=measured, others=others, others_moved_m=moved
        )

    def return_to_belt(self) -> bool:
        """The held box is back at the pick point at once."""
        had_box = self._held is not None
        self._held = None
        return had_box

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

    def close(self) -> None:
        """Nothing to give back."""


def _ended(code: ErrorCode, message: str, spent: Mapping[Phase, float]) -> MotionResult:
    return MotionResult(code, message, motion_s=sum(spent.values()), split_s=dict(spent))


def _shifted(pose: Pose) -> Pose:
    x, y, z = pose.position
    return replace(pose, position=(x + FAULT_SHIFT_M, y, z))


TIMED = ArmKind(
    name='timed',
    summary='only spends the time',
    make=lambda setup: TimedArm(setup.layout, speed=setup.speed, truth=setup.truth),
)
