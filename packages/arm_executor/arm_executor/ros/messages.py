"""Messages of the node's action and services, to and from the core's values (imports ROS)."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Time as TimeMsg
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from arm_executor.arms.true_boxes import TrueBox
from arm_executor.bins.book import BookState
from arm_executor.goals.outputs import Progress, Status
from arm_executor.goals.place_goal import CELL_FRAME, PlaceGoal
from pack_msgs.action import PlaceBox
from pack_msgs.msg import BoxScan
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.checks import (
    LARGEST_COUNT,
    LONGEST_NAME,
    LONGEST_S,
    InvalidValue,
    check_name,
    clean_text,
)
from pack_msgs_py.codes import Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions
from pack_msgs_py.values import Box
from pack_msgs_py.wording import how_many

_LEVELS = {
    Mode.FAULT: DiagnosticStatus.ERROR,
    Mode.PROTECTIVE_STOP: DiagnosticStatus.ERROR,
    Mode.INACTIVE: DiagnosticStatus.WARN,
    Mode.PAUSED: DiagnosticStatus.WARN,
    Mode.ALARM: DiagnosticStatus.ERROR,
}
_WAITS_FOR = {
    Mode.FAULT: 'a restart of the node',
    Mode.PROTECTIVE_STOP: 'a reset by an operator',
    Mode.INACTIVE: 'the arm to be ready',
    Mode.PAUSED: 'an operator to resume',
    Mode.ALARM: 'an operator to acknowledge the alarm',
    Mode.IDLE: 'a goal of the planner',
}


def goal_from_ros(msg: PlaceBox.Goal, goal_id: bytes, now_s: float) -> PlaceGoal:
    """A goal of place_box that came at ``now_s``; ``ValueError`` says which field is unusable."""
    deadline_s = conversions.time_from_ros(msg.deadline, 'deadline')
    if deadline_s - now_s > LONGEST_S:
        text = f'deadline is {deadline_s - now_s:g} s from now; at most {LONGEST_S:g} s will do'
        raise InvalidValue(text)
    return PlaceGoal(
        decision=conversions.placement_from_ros(msg.placement),
        frame_id=check_name('frame_id', msg.placement.header.frame_id),
        pick=conversions.pose_from_ros('pick_pose', msg.pick_pose.pose),
        pick_frame=check_name('pick_pose.frame_id', msg.pick_pose.header.frame_id),
        deadline_s=deadline_s,
        goal_id=goal_id,
        sent_s=conversions.time_from_ros(msg.pick_pose.header.stamp),
    )


def unusable_goal(msg: PlaceBox.Goal, goal_id: bytes) -> PlaceGoal:
    """What can be named of a goal that cannot be used, for its report."""
    placement = msg.placement
    return PlaceGoal(
        decision=Decision(
            Box(clean_text(placement.box.id)[:LONGEST_NAME], (0.0, 0.0, 0.0)),
            clean_text(placement.bin_id)[:LONGEST_NAME],
            placement.bin_serial,
            min(placement.bin_revision, LARGEST_COUNT),
        ),
        frame_id='',
        pick=Pose(),
        pick_frame='',
        deadline_s=math.nan,
        goal_id=goal_id,
    )


def candidate(decision: Decision, frame_id: str, pick: Pose) -> PlaceGoal:
    """A candidate of check_placements as a goal without deadline."""
    return PlaceGoal(decision, frame_id, pick, CELL_FRAME, 0.0)


def true_boxes_from_ros(msg: BoxScan) -> list[TrueBox]:
    """What the conveyor says of the boxes as they really are."""
    scan, _ = conversions.scan_from_ros(msg)
    return [TrueBox(item.box, item.pose) for item in scan.boxes]


def feedback_to_ros(progress: Progress) -> PlaceBox.Feedback:
    """Progress as feedback of place_box."""
    return PlaceBox.Feedback(
        phase=int(progress.phase),
        fraction_complete=float(progress.fraction),
        time_to_deadline=conversions.duration_to_ros(progress.left_s),
    )


def _doing(status: Status) -> str:
    """What the arm does, for people."""
    if status.mode is Mode.EXECUTING:
        return f'placing box {status.active_box!r}'
    return status.mode.name.lower()


def diagnostics_to_ros(
    name: str, status: Status, bins: BookState, journal: str, stamp: TimeMsg
) -> DiagnosticArray:
    """Mode, last fault, journal and bins as one diagnostic status (REP 107).

    ``name`` is that of the node, ``journal`` says how its journal is, ``stamp`` is now.
    """
    values = {
        'mode': status.mode.name,
        'waits_for': _WAITS_FOR.get(status.mode, ''),
        'paused': status.paused,
        'active_box': status.active_box,
        'last_fault': status.last_fault or 'none',
        'tracking_error': f'{status.tracking_error:.0%} of what is allowed',
        'journal': journal,
        'revision': str(bins.revision),
        **{
            bin_.id: f'{how_many(len(bin_.boxes), "box")}, {bin_.fill_rate:.1%} full'
            for bin_ in bins.bins
        },
    }
    msg = DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=_LEVELS.get(status.mode, DiagnosticStatus.OK),
                name=name.lstrip('/'),
                message=status.message or _doing(status),
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        ]
    )
    msg.header.stamp = stamp
    return msg
