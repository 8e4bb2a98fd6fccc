"""Scans, decisions, events and reports: what travels between the nodes."""

from __future__ import annotations

from dataclasses import replace

from pack_msgs.msg import BoxEvent as BoxEventMsg
from pack_msgs.msg import (
    BoxScan,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs.msg import Placement as PlacementMsg
from pack_msgs.msg import RunnerUp as RunnerUpMsg
from pack_msgs.msg import ScannedBox as ScannedBoxMsg
from pack_msgs_py.cell_values import (
    MOST_RUNNERS_UP,
    BoxEvent,
    Decision,
    Report,
    RunnerUp,
    Scan,
    ScannedBox,
)
from pack_msgs_py.checks import (
    LONGEST_S,
    REACH_M,
    InvalidValue,
    check_count,
    check_length,
    check_name,
    check_orientation,
    check_range,
    check_whole_mm,
    clean_text,
)
from pack_msgs_py.codes import BoxEventKind, ErrorCode, PlacementStatus, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros.conversions.basic import (
    duration_from_ros,
    duration_to_ros,
    pose_from_ros,
    pose_to_ros,
    time_from_ros,
    time_to_ros,
    vector_from_ros,
    vector_to_ros,
)
from pack_msgs_py.ros.conversions.content import (
    attributes_from_ros,
    attributes_to_ros,
    box_from_ros,
    box_to_ros,
)

#: More than any look-ahead holds.
MOST_SCANNED = 1000
#: No objective of a packing algorithm is farther from zero.
LARGEST_OBJECTIVE = 1e12


def scanned_box_to_ros(item: ScannedBox) -> ScannedBoxMsg:
    """One scanned box as pack_msgs/ScannedBox."""
    return ScannedBoxMsg(
        box=box_to_ros(item.box),
        pose=pose_to_ros(item.pose),
        pick_open=time_to_ros(item.pick_open_s or 0.0),
        pick_close=time_to_ros(item.pick_close_s or 0.0),
        travel_time=duration_to_ros(item.travel_time_s),
        laps=item.laps,
    )


def scanned_box_from_ros(msg: ScannedBoxMsg) -> ScannedBox:
    """pack_msgs/ScannedBox as a checked value."""
    return ScannedBox(
        box=box_from_ros(msg.box),
        pose=pose_from_ros('pose', msg.pose),
        pick_open_s=time_from_ros(msg.pick_open, 'pick_open') or None,
        pick_close_s=time_from_ros(msg.pick_close, 'pick_close') or None,
        travel_time_s=duration_from_ros(msg.travel_time, 'travel_time'),
        laps=msg.laps,
    )


def scan_to_ros(scan: Scan) -> BoxScan:
    """A scan as pack_msgs/BoxScan."""
    msg = BoxScan(
        sequence=scan.sequence,
        belt_velocity=vector_to_ros(scan.belt_velocity),
        boxes=[scanned_box_to_ros(item) for item in scan.boxes],
        supplied=scan.supplied,
        remaining=scan.remaining,
    )
    msg.header.stamp = time_to_ros(scan.stamp_s)
    msg.header.frame_id = scan.frame_id
    return msg


def scan_from_ros(msg: BoxScan) -> tuple[Scan, list[str]]:
    """pack_msgs/BoxScan as a value, and what was wrong with boxes that had to be left out.

    One bad box does not cost the others; a repeated id is kept once.
    """
    check_length('box_scan', msg.boxes, MOST_SCANNED)
    boxes: list[ScannedBox] = []
    errors: list[str] = []
    seen: set[str] = set()
    for index, item in enumerate(msg.boxes):
        try:
            scanned = scanned_box_from_ros(item)
        except ValueError as error:
            errors.append(f'box_scan.boxes[{index}]: {error}')
            continue
        if scanned.box.id in seen:
            errors.append(f'box_scan.boxes[{index}]: id {scanned.box.id!r} is there twice')
            continue
        seen.add(scanned.box.id)
        boxes.append(scanned)
    scan = Scan(
        sequence=check_count('sequence', msg.sequence),
        stamp_s=time_from_ros(msg.header.stamp),
        boxes=tuple(boxes),
        frame_id=check_name('frame_id', msg.header.frame_id),
        belt_velocity=vector_from_ros('belt_velocity', msg.belt_velocity),
        supplied=check_count('supplied', msg.supplied),
        remaining=msg.remaining,
    )
    return scan, errors


def placement_to_ros(decision: Decision, frame_id: str = '') -> PlacementMsg:
    """What the arm is to do by a decision as pack_msgs/Placement."""
    msg = PlacementMsg(
        sequence=decision.sequence,
        scan_sequence=decision.scan_sequence,
        box=box_to_ros(decision.box),
        bin_id=decision.bin_id,
        bin_serial=decision.bin_serial,
        bin_revision=decision.bin_revision,
        orientation=decision.orientation,
        planned_corner=vector_to_ros(decision.corner_mm, 1e-3),
        planned_size=vector_to_ros(decision.size_mm, 1e-3),
        pose=pose_to_ros(decision.target),
    )
    msg.header.stamp = time_to_ros(decision.stamp_s)
    msg.header.frame_id = frame_id
    return msg


def placement_from_ros(msg: PlacementMsg) -> Decision:
    """pack_msgs/Placement as a checked value, of which nobody knows how it came about."""
    corner, size = msg.planned_corner, msg.planned_size
    return Decision(
        box=box_from_ros(msg.box),
        bin_id=check_name('bin_id', msg.bin_id),
        bin_serial=msg.bin_serial,
        bin_revision=check_count('bin_revision', msg.bin_revision),
        orientation=check_orientation(msg.orientation),
        corner_mm=check_whole_mm('planned_corner', (corner.x, corner.y, corner.z)),
        size_mm=check_whole_mm('planned_size', (size.x, size.y, size.z)),
        target=pose_from_ros('pose', msg.pose),
        sequence=check_count('sequence', msg.sequence),
        scan_sequence=check_count('scan_sequence', msg.scan_sequence),
        stamp_s=time_from_ros(msg.header.stamp),
    )


def decision_to_ros(decision: Decision, frame_id: str = '') -> PlacementDecision:
    """A decision as pack_msgs/PlacementDecision."""
    return PlacementDecision(
        placement=placement_to_ros(decision, frame_id),
        objective=float(decision.objective),
        algorithm=decision.algorithm,
        profile=decision.profile,
        status=int(decision.status),
        planning_time=duration_to_ros(decision.planning_s),
        trigger_stamp=time_to_ros(decision.trigger_stamp_s),
        reason=decision.reason,
        reject_reason=int(decision.reject_reason),
        candidates_checked=decision.candidates_checked,
        check_time=duration_to_ros(decision.check_s),
        first_objective=float(decision.first_objective),
        first_refusal=int(decision.first_refusal),
        runners_up=[
            RunnerUpMsg(
                box_id=other.box_id,
                bin_id=other.bin_id,
                planned_corner=vector_to_ros(other.corner_mm, 1e-3),
                objective=float(other.objective),
                error_code=int(other.refusal),
            )
            for other in decision.runners_up
        ],
    )


def decision_from_ros(msg: PlacementDecision) -> Decision:
    """pack_msgs/PlacementDecision as a checked value."""
    return replace(
        placement_from_ros(msg.placement),
        objective=_objective('objective', msg.objective),
        algorithm=check_name('algorithm', msg.algorithm),
        profile=check_name('profile', msg.profile),
        status=PlacementStatus(msg.status),
        planning_s=duration_from_ros(msg.planning_time, 'planning_time'),
        trigger_stamp_s=time_from_ros(msg.trigger_stamp, 'trigger_stamp'),
        reason=clean_text(msg.reason),
        reject_reason=Reason(msg.reject_reason),
        candidates_checked=msg.candidates_checked,
        check_s=duration_from_ros(msg.check_time, 'check_time'),
        first_objective=_objective('first_objective', msg.first_objective),
        first_refusal=ErrorCode(msg.first_refusal),
        runners_up=tuple(_runner_up(other) for other in msg.runners_up[:MOST_RUNNERS_UP]),
    )


def _runner_up(msg: RunnerUpMsg) -> RunnerUp:
    corner = msg.planned_corner
    return RunnerUp(
        check_name('runners_up.box_id', msg.box_id),
        check_name('runners_up.bin_id', msg.bin_id),
        check_whole_mm('runners_up.planned_corner', (corner.x, corner.y, corner.z)),
        _objective('runners_up.objective', msg.objective),
        ErrorCode(msg.error_code),
    )


def _objective(name: str, value: float) -> float:
    return check_range(name, value, -LARGEST_OBJECTIVE, LARGEST_OBJECTIVE)


def event_to_ros(event: BoxEvent) -> BoxEventMsg:
    """A box event as pack_msgs/BoxEvent."""
    msg = BoxEventMsg(
        box_id=event.box_id,
        event=int(event.event),
        reason=int(event.reason),
        text=event.text,
        bin_id=event.bin_id,
        bin_serial=event.bin_serial,
    )
    msg.header.stamp = time_to_ros(event.stamp_s)
    return msg


def event_from_ros(msg: BoxEventMsg) -> BoxEvent:
    """pack_msgs/BoxEvent as a checked value."""
    if not msg.box_id:
        text = 'box_event.box_id must not be empty'
        raise InvalidValue(text)
    return BoxEvent(
        box_id=check_name('box_id', msg.box_id),
        event=BoxEventKind(msg.event),
        reason=Reason(msg.reason),
        text=clean_text(msg.text),
        bin_id=check_name('bin_id', msg.bin_id),
        bin_serial=msg.bin_serial,
        stamp_s=time_from_ros(msg.header.stamp),
    )


def report_to_ros(report: Report, frame_id: str = '') -> PlacementReport:
    """A report as pack_msgs/PlacementReport."""
    msg = PlacementReport(
        box_id=report.box_id,
        bin_id=report.bin_id,
        bin_serial=report.bin_serial,
        bin_revision=report.bin_revision,
        error_code=int(report.code),
        error_msg=report.message,
        commanded=pose_to_ros(report.commanded),
        measured=pose_to_ros(report.measured or Pose()),
        measured_valid=report.measured is not None,
        position_error=report.position_error_m,
        angle_error=report.angle_error_rad,
        others_moved=report.others_moved_m,
        planning_time=duration_to_ros(report.planning_s),
        wait_time=duration_to_ros(report.wait_s),
        motion_time=duration_to_ros(report.motion_s),
        cycle_time=duration_to_ros(report.cycle_s),
        slack=duration_to_ros(report.slack_s),
        attributes=attributes_to_ros(report.attributes),
    )
    msg.goal_id.uuid = list(report.goal_id)
    msg.header.stamp = time_to_ros(report.stamp_s)
    msg.header.frame_id = frame_id
    return msg


def report_from_ros(msg: PlacementReport) -> Report:
    """pack_msgs/PlacementReport as a checked value."""
    return Report(
        box_id=check_name('box_id', msg.box_id),
        bin_id=check_name('bin_id', msg.bin_id),
        bin_serial=msg.bin_serial,
        bin_revision=check_count('bin_revision', msg.bin_revision),
        code=ErrorCode(msg.error_code),
        message=clean_text(msg.error_msg),
        commanded=pose_from_ros('commanded', msg.commanded),
        measured=pose_from_ros('measured', msg.measured) if msg.measured_valid else None,
        position_error_m=check_range('position_error', msg.position_error, 0.0, REACH_M, 'm'),
        angle_error_rad=check_range('angle_error', msg.angle_error, 0.0, 7.0, 'rad'),
        others_moved_m=check_range('others_moved', msg.others_moved, 0.0, REACH_M, 'm'),
        planning_s=duration_from_ros(msg.planning_time, 'planning_time'),
        wait_s=duration_from_ros(msg.wait_time, 'wait_time'),
        motion_s=duration_from_ros(msg.motion_time, 'motion_time'),
        cycle_s=duration_from_ros(msg.cycle_time, 'cycle_time'),
        slack_s=duration_from_ros(msg.slack, 'slack', low=-LONGEST_S),
        attributes=attributes_from_ros('report attributes', msg.attributes),
        goal_id=bytes(msg.goal_id.uuid),
        stamp_s=time_from_ros(msg.header.stamp),
    )
