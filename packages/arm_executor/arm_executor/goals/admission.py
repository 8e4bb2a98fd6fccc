"""Checks of a goal that need no motion, in the order of the codes in PlaceBox.action.

Pure functions of what is known at that moment; the first reason that applies is returned.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

from arm_executor.bins.book import BookState
from arm_executor.bins.records import placed_of
from arm_executor.goals.footing import footing_errors
from pack_msgs_py.cell_values import Decision, Scan, ScannedBox
from pack_msgs_py.checks import InvalidValue, check_finite, check_frame, check_pose
from pack_msgs_py.codes import ErrorCode, Mode, PlacementStatus
from pack_msgs_py.geometry.pose import Pose, Quaternion, rotation_matrix
from pack_msgs_py.geometry.resting import measured_top_mm
from pack_msgs_py.orientation import ORIENTATIONS, oriented_size
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import supporters, violations
from pack_msgs_py.values import Bin, Box, PlacedBox, Vec3, check_box, frame_name

CELL_FRAME = 'cell'
MAX_SCAN_AGE_S = 5.0
#: Two measurements of the same box agree within this much.
SIZE_TOLERANCE_MM = 1.0
ANGLE_TOLERANCE_RAD = math.radians(1.0)


@dataclass(frozen=True)
class PlaceGoal:
    """A goal of place_box as plain values.

    ``pick`` is the centre of the box when it is grasped, in ``pick_frame``; ``frame_id`` is the
    frame of ``decision.target``; times are seconds since the epoch.
    """

    decision: Decision
    frame_id: str
    pick: Pose
    pick_frame: str
    deadline_s: float
    goal_id: bytes = bytes(16)


@dataclass(frozen=True)
class Refusal:
    """Why a goal is refused: the code, and a sentence with the numbers."""

    code: ErrorCode
    message: str


@dataclass(frozen=True)
class AdmissionState:
    """All that admission looks at.

    ``ids_in_bins`` are the boxes of all bins, closed ones too. ``busy_with`` is the box being
    handled, empty when the arm is free.
    """

    bins: BookState
    ids_in_bins: Collection[str]
    profile: Profile
    scan: Scan | None
    mode: Mode
    busy_with: str
    now_s: float


def admit(
    goal: PlaceGoal, situation: AdmissionState, *, with_deadline: bool = True
) -> Refusal | None:
    """``None`` when the goal may go on to motion planning, else the first reason why not.

    ``with_deadline`` is off for candidates of check_placements, which have none.
    """
    try:
        target = _valid(goal, situation.bins)
    except ValueError as error:
        return Refusal(ErrorCode.INVALID_GOAL, str(error))
    checks: tuple[Callable[[], Iterator[Refusal]], ...] = (
        lambda: _revision(goal.decision, target),
        lambda: _free(situation),
        lambda: _once(goal.decision.box, situation),
        lambda: _on_belt(goal.decision.box, situation),
        lambda: _rules(goal.decision, target, situation.profile),
        lambda: _in_time(goal, situation.now_s) if with_deadline else iter(()),
    )
    return next((refusal for check in checks for refusal in check()), None)


def _valid(goal: PlaceGoal, bins: BookState) -> Bin:
    """The target bin, when every value of the goal can be used."""
    decision = goal.decision
    box = check_box(decision.box)
    if decision.status is PlacementStatus.REJECT:
        msg = f'placement of box {box.id!r} has status REJECT; only the conveyor rejects boxes'
        raise InvalidValue(msg)
    if decision.orientation not in ORIENTATIONS:
        msg = f'orientation {decision.orientation!r} must be one of {", ".join(ORIENTATIONS)}'
        raise InvalidValue(msg)
    target = bins.find(decision.bin_id)
    if target is None:
        names = ', '.join(one.id for one in bins.bins)
        msg = f'there is no open bin {decision.bin_id!r}; open are {names or "none"}'
        raise InvalidValue(msg)
    check_frame('placement.header.frame_id', goal.frame_id, frame_name(target.station))
    check_frame('pick_pose.header.frame_id', goal.pick_frame, CELL_FRAME)
    check_pose('pick_pose', goal.pick)
    check_pose('placement.pose', decision.target)
    check_finite('deadline', goal.deadline_s)
    true_size = oriented_size(box.size_mm, decision.orientation)
    for axis, true, planned in zip('xyz', true_size, decision.size_mm, strict=True):
        if planned < true - SIZE_TOLERANCE_MM:
            msg = (
                f'planned_size.{axis} is {planned} mm but box {box.id!r} takes {true:g} mm '
                f'in orientation {decision.orientation!r}'
            )
            raise InvalidValue(msg)
    for axis, centre, edge, limit in zip(
        'xyz', decision.target.position, true_size, target.spec.size_mm, strict=True
    ):
        low, high = 1e3 * centre - edge / 2, 1e3 * centre + edge / 2
        if low < -SIZE_TOLERANCE_MM or high > limit + SIZE_TOLERANCE_MM:
            msg = (
                f'placement.pose puts box {box.id!r} at {axis} {low:.1f} to {high:.1f} mm, '
                f'outside bin {target.id!r} of {limit} mm'
            )
            raise InvalidValue(msg)
    return target


def _revision(decision: Decision, target: Bin) -> Iterator[Refusal]:
    if decision.bin_revision != target.revision:
        yield Refusal(
            ErrorCode.STALE_BIN_REVISION,
            f'bin {target.id!r} is at revision {target.revision}, '
            f'the goal quotes {decision.bin_revision}: decide again',
        )


def _free(situation: AdmissionState) -> Iterator[Refusal]:
    if situation.busy_with:
        yield Refusal(
            ErrorCode.BUSY,
            f'box {situation.busy_with!r} is being handled; one placement at a time',
        )
    if situation.mode is not Mode.IDLE:
        yield Refusal(
            ErrorCode.NOT_ACTIVE, f'the executor is in mode {situation.mode.name}, not IDLE'
        )


def _once(box: Box, situation: AdmissionState) -> Iterator[Refusal]:
    if box.id in situation.ids_in_bins:
        holder = next(
            (
                f'bin {one.id!r}'
                for one in situation.bins.bins
                if any(placed.box.id == box.id for placed in one.boxes)
            ),
            'a closed bin',
        )
        yield Refusal(ErrorCode.DUPLICATE_BOX, f'box {box.id!r} is already in {holder}')


def _on_belt(box: Box, situation: AdmissionState) -> Iterator[Refusal]:
    code, scan = ErrorCode.BOX_NOT_ON_BELT, situation.scan
    if scan is None:
        yield Refusal(code, f'no box_scan has come yet, so box {box.id!r} is not known')
        return
    age_s = situation.now_s - scan.stamp_s
    if age_s > MAX_SCAN_AGE_S:
        yield Refusal(
            code, f'the latest box_scan is {age_s:.1f} s old, at most {MAX_SCAN_AGE_S:g} s will do'
        )
        return
    found = find_scanned(scan, box.id)
    if found is None:
        ids = ', '.join(one.box.id for one in scan.boxes)
        yield Refusal(
            code, f'box {box.id!r} is not in scan {scan.sequence}, which holds {ids or "none"}'
        )
        return
    for axis, wanted, seen in zip('xyz', box.size_mm, found.box.size_mm, strict=True):
        if abs(wanted - seen) > SIZE_TOLERANCE_MM:
            yield Refusal(
                code,
                f'box {box.id!r}: size {axis} is {seen:g} mm in scan {scan.sequence} '
                f'and {wanted:g} mm in the goal',
            )


def find_scanned(scan: Scan | None, box_id: str) -> ScannedBox | None:
    """The box called ``box_id`` in ``scan``."""
    boxes = () if scan is None else scan.boxes
    return next((one for one in boxes if one.box.id == box_id), None)


def _rules(decision: Decision, target: Bin, profile: Profile) -> Iterator[Refusal]:
    placed = placed_of(decision)
    found = violations(placed, target.boxes, target.spec, profile, target.destination)
    broken = [str(one) for one in found]
    broken += commanded_pose_errors(placed, decision.target, profile, target.boxes)
    broken += footing_errors(placed, target.boxes, profile)
    if broken:
        yield Refusal(ErrorCode.RULE_VIOLATION, '; '.join(broken))


def _in_time(goal: PlaceGoal, now_s: float) -> Iterator[Refusal]:
    if goal.deadline_s <= now_s:
        yield Refusal(
            ErrorCode.STALE_GOAL,
            f'the deadline had passed {now_s - goal.deadline_s:.2f} s before the goal came',
        )


def commanded_pose_errors(
    placed: PlacedBox, target: Pose, profile: Profile, others: Sequence[PlacedBox] = ()
) -> list[str]:
    """How ``target`` (bin frame) contradicts the corner, size and orientation of ``placed``.

    A stack of boxes stands a little higher or lower than planned: the base may also be where the
    tops of those of ``others`` that carry the box were measured.
    """
    errors = []
    true_size = oriented_size(placed.box.size_mm, placed.orientation)
    planned: Vec3 = (
        placed.corner_mm[0] + placed.size_mm[0] / 2,
        placed.corner_mm[1] + placed.size_mm[1] / 2,
        placed.corner_mm[2] + true_size[2] / 2,
    )
    steps = (profile.resolution_mm, profile.resolution_mm, profile.resolution_z_mm)
    below = supporters(placed, others, profile.support_tolerance_mm)
    sunk = [measured_top_mm(other) - placed.corner_mm[2] for other in below]
    for axis, wanted, metres, step in zip('xyz', planned, target.position, steps, strict=True):
        off = 1e3 * metres - wanted
        low, high = (min(0.0, *sunk), max(0.0, *sunk)) if axis == 'z' and sunk else (0.0, 0.0)
        if not low - step - 1e-6 <= off <= high + step + 1e-6:
            errors.append(
                f'pose.{axis} is {1e3 * metres:.1f} mm where corner, size and orientation '
                f'put the centre at {wanted:.1f} mm, more than {step} mm away'
            )
    angle = orientation_error(target.quaternion, placed.orientation)
    if angle > ANGLE_TOLERANCE_RAD:
        errors.append(
            f'pose turns the box {math.degrees(angle):.1f} degrees away from '
            f'orientation {placed.orientation!r}'
        )
    return errors


def orientation_error(quaternion: Quaternion, orientation: str) -> float:
    """Largest angle between a box axis and the bin axis it should lie along, radians.

    The sign of an axis is free, since a rectangular box looks the same either way.
    """
    matrix = rotation_matrix(quaternion)
    return max(
        math.acos(min(1.0, abs(matrix[row]['xyz'.index(axis)])))
        for row, axis in enumerate(orientation)
    )
