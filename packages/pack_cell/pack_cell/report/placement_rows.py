"""What ``placements.jsonl`` says of a box."""

from __future__ import annotations

from typing import Any

from pack_msgs_py.cell_values import BoxEvent, Decision, Report
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Bin, Box, PlacedBox


def placement_row(
    box_id: str,
    *,
    box: Box | None,
    true: Box | None,
    decision: Decision | None,
    report: Report | None,
    event: BoxEvent | None,
    where: tuple[Bin, PlacedBox] | None,
    at_start: bool = False,
) -> dict[str, Any]:
    """A box as it was scanned and as it is, what was decided last, and where it ended.

    Parameters
    ----------
    box_id : the name of the box.
    box : as it was scanned last; ``None`` when no scan showed it.
    true : as it really is, as far as that was told.
    decision : the last one about it.
    report : of the last goal with it.
    event : the last one; ``None`` while it is on the belt.
    where : the bin that it is in, and how it lies there.
    at_start : it was there before the run began.
    """
    row: dict[str, Any] = {
        'box_id': box_id,
        'size_mm': list(box.size_mm) if box else None,
        'size_stddev_mm': list(box.size_stddev_mm) if box else None,
        'yaw_stddev_rad': box.yaw_stddev_rad if box else None,
        'true_size_mm': list(true.size_mm) if true else None,
        'weight_kg': box.weight_kg if box else None,
        'destination': box.destination if box else None,
        'attributes': dict(box.extra) if box else {},
        'bin_serial': None,
        'bin_type': None,
        'bin_destination': None,
        'position_mm': None,
        'placed_size_mm': None,
        'orientation': None,
        'objective': decision.objective if decision else None,
        'algorithm': decision.algorithm if decision else None,
        'status': decision.status.name.lower() if decision else None,
        'planning_s': decision.planning_s if decision else None,
        'check_s': decision.check_s if decision else None,
        'arm_planning_s': report.planning_s if report else None,
        'wait_s': report.wait_s if report else None,
        'motion_s': report.motion_s if report else None,
        'slack_s': report.slack_s if report else None,
        'stamp_s': event.stamp_s if event else None,
        'measured_position_mm': None,
        'outcome': event.event.name.lower() if event else 'on_belt',
        'code': report.code.name if report else None,
        'reason': None,
    }
    if event is not None and event.reason is not Reason.NONE:
        row['reason'] = f'{event.reason.name.lower()}: {event.text}'
    if at_start:
        row.update(outcome='at_start', stamp_s=0.0)
    if where is not None:
        in_bin, placed = where
        row.update(
            bin_serial=in_bin.serial,
            bin_type=in_bin.spec.name,
            bin_destination=in_bin.destination,
            position_mm=list(placed.corner_mm),
            placed_size_mm=list(placed.size_mm),
            orientation=placed.orientation,
        )
        if placed.measured_mm is not None:
            row['measured_position_mm'] = [round(v, 3) for v in placed.measured_mm]
    return row
