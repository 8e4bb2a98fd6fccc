"""Checks of a goal that need no motion, in the order of the codes in PlaceBox.action.

Pure functions of what is known at that moment; the first reason that applies is returned.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from arm_executor.bins.book import BookState
from arm_executor.goals.place_goal import SIZE_TOLERANCE_MM, PlaceGoal, target_of
from arm_executor.goals.placement_errors import placement_errors
from pack_msgs_py.cell_values import Decision, Scan
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import Bin, Box

MAX_SCAN_AGE_S = 5.0


@dataclass(frozen=True)
class Refusal:
    """Why a goal is refused: the code, and a sentence with the numbers."""

    code: ErrorCode
    message: str


@dataclass(frozen=True)
class AdmissionState:
    """All that admission looks at.

    Attributes
    ----------
    bins : the open bins.
    ids_in_bins : the boxes of all bins, closed ones too.
    profile : packing rules.
    scan : the latest look-ahead, ``None`` before the first.
    mode : of the executor.
    busy_with : the box being handled, empty when the arm is free.
    now_s : seconds since the epoch.
    """

    bins: BookState
    ids_in_bins: Collection[str]
    profile: Profile
    scan: Scan | None
    mode: Mode
    busy_with: str
    now_s: float


def admit(goal: PlaceGoal, state: AdmissionState, *, with_deadline: bool = True) -> Refusal | None:
    """``None`` when the goal may go on to motion planning, else the first reason why not.

    ``with_deadline`` is off for candidates of check_placements, which have none.
    """
    return next(_refusals(goal, state, with_deadline=with_deadline), None)


def _refusals(goal: PlaceGoal, state: AdmissionState, *, with_deadline: bool) -> Iterator[Refusal]:
    try:
        target = target_of(goal, state.bins)
    except ValueError as error:
        yield Refusal(ErrorCode.INVALID_GOAL, str(error))
        return
    yield from _revision(goal.decision, target)
    yield from _free(state)
    if target.id in state.bins.held:
        yield Refusal(ErrorCode.NOT_ACTIVE, f'bin {target.id!r} is held by an operator')
    if target.id in state.bins.blocked:
        yield Refusal(ErrorCode.NOT_ACTIVE, state.bins.blocked[target.id])
    yield from _once(goal.decision.box, state)
    yield from _on_belt(goal.decision.box, state)
    broken = placement_errors(goal.decision, target, state.profile)
    if broken:
        yield Refusal(ErrorCode.RULE_VIOLATION, '; '.join(broken))
    if with_deadline:
        yield from _in_time(goal, state.now_s)


def _revision(decision: Decision, target: Bin) -> Iterator[Refusal]:
    if decision.bin_revision != target.revision:
        yield Refusal(
            ErrorCode.STALE_BIN_REVISION,
            f'bin {target.id!r} is at revision {target.revision}, '
            f'the goal quotes {decision.bin_revision}: decide again',
        )


def _free(state: AdmissionState) -> Iterator[Refusal]:
    if state.busy_with:
        yield Refusal(
            ErrorCode.BUSY,
            f'box {state.busy_with!r} is being handled; one placement at a time',
        )
    if state.mode is not Mode.IDLE:
        yield Refusal(ErrorCode.NOT_ACTIVE, f'the executor is in mode {state.mode.name}, not IDLE')


def _once(box: Box, state: AdmissionState) -> Iterator[Refusal]:
    if box.id in state.ids_in_bins:
        holder = next(
            (
                f'bin {bin_.id!r}'
                for bin_ in state.bins.bins
                if any(placed.box.id == box.id for placed in bin_.boxes)
            ),
            'a closed bin',
        )
        yield Refusal(ErrorCode.DUPLICATE_BOX, f'box {box.id!r} is already in {holder}')


def _on_belt(box: Box, state: AdmissionState) -> Iterator[Refusal]:
    code, scan = ErrorCode.BOX_NOT_ON_BELT, state.scan
    if scan is None:
        yield Refusal(code, f'no box_scan has come yet, so box {box.id!r} is not known')
        return
    age_s = state.now_s - scan.stamp_s
    if age_s > MAX_SCAN_AGE_S:
        yield Refusal(
            code, f'the latest box_scan is {age_s:.1f} s old, at most {MAX_SCAN_AGE_S:g} s will do'
        )
        return
    scanned = scan.find(box.id)
    if scanned is None:
        ids = ', '.join(other.box.id for other in scan.boxes)
        yield Refusal(
            code, f'box {box.id!r} is not in scan {scan.sequence}, which holds {ids or "none"}'
        )
        return
    for axis, wanted, seen in zip('xyz', box.size_mm, scanned.box.size_mm, strict=True):
        if abs(wanted - seen) > SIZE_TOLERANCE_MM:
            yield Refusal(
                code,
                f'box {box.id!r}: size {axis} is {seen:g} mm in scan {scan.sequence} '
                f'and {wanted:g} mm in the goal',
            )


def _in_time(goal: PlaceGoal, now_s: float) -> Iterator[Refusal]:
    if goal.deadline_s <= now_s:
        yield Refusal(
            ErrorCode.STALE_GOAL,
            f'the deadline had passed {now_s - goal.deadline_s:.2f} s before the goal came',
        )
