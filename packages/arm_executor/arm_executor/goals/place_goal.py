"""A goal of place_box as plain values, and whether they can be used at all."""

from __future__ import annotations

from dataclasses import dataclass

from arm_executor.bins.book import BookState
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.checks import InvalidValue, check_finite, check_frame, check_pose
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import ORIENTATIONS, oriented_size
from pack_msgs_py.values import Bin, check_box, frame_name

CELL_FRAME = 'cell'
#: Two measurements of the same box agree within this much.
SIZE_TOLERANCE_MM = 1.0
#: A box that is planned up to the rim may be expected so far above it: the tops under it are where
#: they were measured, and heights are known to a few millimetres.
RIM_TOLERANCE_MM = 5.0


@dataclass(frozen=True)
class PlaceGoal:
    """A goal of place_box as plain values.

    Attributes
    ----------
    decision : what to place where.
    frame_id : frame of ``decision.target``.
    pick, pick_frame : centre of the box when it is grasped, as far as is known, and the frame of
        that; it also says which face is up then.
    deadline_s : seconds since the epoch.
    goal_id : of the action.
    sent_s : when it was sent, seconds since the epoch; 0 when it does not say so.
    """

    decision: Decision
    frame_id: str
    pick: Pose
    pick_frame: str
    deadline_s: float
    goal_id: bytes = bytes(16)
    sent_s: float = 0.0


def target_of(goal: PlaceGoal, bins: BookState) -> Bin:
    """The bin that ``goal`` is for, when every value of it can be used.

    Raises
    ------
    InvalidValue
        A value cannot be used; the message names it, its value and what it may be.
    """
    decision = goal.decision
    box = check_box(decision.box)
    if decision.orientation not in ORIENTATIONS:
        msg = f'orientation {decision.orientation!r} must be one of {", ".join(ORIENTATIONS)}'
        raise InvalidValue(msg)
    target = bins.find(decision.bin_id)
    if target is None:
        names = ', '.join(bin_.id for bin_ in bins.bins)
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
        above = RIM_TOLERANCE_MM if axis == 'z' else SIZE_TOLERANCE_MM
        if low < -SIZE_TOLERANCE_MM or high > limit + above:
            msg = (
                f'placement.pose puts box {box.id!r} at {axis} {low:.1f} to {high:.1f} mm, '
                f'outside bin {target.id!r} of {limit} mm'
            )
            raise InvalidValue(msg)
    return target
