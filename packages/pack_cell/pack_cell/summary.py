"""Turns the record of a run into ``summary.json`` and ``placements.jsonl``."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

from pack_cell.accounts import Ledger, accounts, disagreements, waits
from pack_cell.asked import asked_summary
from pack_cell.options import RunOptions
from pack_cell.record import RunRecord
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Reason
from pack_msgs_py.metrics import fill_metrics, quantile, time_summary
from pack_msgs_py.profiles import Profile, find_profile
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, PlacedBox

_PACKAGES = ('pack_cell', 'numpy', 'pybullet', 'rclpy', 'toppra', 'pin', 'numba')


def execution_profile(name: str, size_sigmas: float | None = None) -> Profile:
    """The rules as a run with an arm applies them, ``size_sigmas`` instead of the profile's own.

    Whatever the profile allows, this arm picks boxes from above, so they stay upright.
    """
    profile = replace(find_profile(name), orientations='upright')
    return profile if size_sigmas is None else replace(profile, size_sigmas=size_sigmas)


def placement_rows(record: RunRecord) -> list[dict[str, Any]]:
    """One object per box of the run, in the order in which they came to their end."""
    where: dict[str, tuple[Bin, PlacedBox]] = {
        placed.box.id: (one, placed) for one in record.every_bin() for placed in one.boxes
    }
    order = sorted(record.events, key=lambda box_id: record.events[box_id].stamp_s)
    rest = [box_id for box_id in record.boxes if box_id not in record.events]
    return [_row(record, box_id, where.get(box_id)) for box_id in [*order, *rest]]


def _row(record: RunRecord, box_id: str, found: tuple[Bin, PlacedBox] | None) -> dict[str, Any]:
    box, true = record.boxes.get(box_id), record.true_boxes.get(box_id)
    decision = record.decisions.get(box_id)
    report = record.reports.get(box_id)
    event = record.events.get(box_id)
    row: dict[str, Any] = {
        'box_id': box_id,
        'size_mm': list(box.size_mm) if box else None,
        'size_stddev_mm': list(box.size_stddev_mm) if box else None,
        'true_size_mm': list(true.size_mm) if true else None,
        'weight_kg': box.weight_kg if box else None,
        'bin_serial': None,
        'bin_type': None,
        'position_mm': None,
        'placed_size_mm': None,
        'orientation': None,
        'objective': decision.objective if decision else None,
        'algorithm': decision.algorithm if decision else None,
        'status': decision.status.name.lower() if decision else None,
        'planning_s': decision.planning_s if decision else None,
        'motion_s': report.motion_s if report else None,
        'slack_s': report.slack_s if report else None,
        'measured_position_mm': None,
        'outcome': event.event.name.lower() if event else 'on_belt',
        'code': report.code.name if report else None,
        'reason': None,
    }
    if event is not None and event.reason is not Reason.NONE:
        row['reason'] = f'{event.reason.name.lower()}: {event.text}'
    if found is not None:
        one, placed = found
        row.update(
            bin_serial=one.serial,
            bin_type=one.spec.name,
            position_mm=list(placed.corner_mm),
            placed_size_mm=list(placed.size_mm),
            orientation=placed.orientation,
        )
        if placed.measured_mm is not None:
            row['measured_position_mm'] = [round(v, 3) for v in placed.measured_mm]
    return row


def _versions() -> dict[str, str]:
    found = {'python': platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def summarize(
    record: RunRecord,
    options: RunOptions,
    *,
    command: Sequence[str],
    wall_time_s: float,
    first_decision_s: float | None,
    problems: Iterable[str] = (),
    ledger: Ledger | None = None,
    memory: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The summary of a run as plain data; fills are percent, times seconds."""
    profile = execution_profile(options.profile, options.size_sigmas)
    violations = validate_bins(record.every_bin(), profile)
    goals = list(record.all_reports.values())
    done = [report for report in goals if report.code.box_is_in_bin]
    overhead = [
        max(0.0, d.stamp_s - d.trigger_stamp_s - d.planning_s - d.check_s)
        for d in record.all_decisions[1:]  # the first waits for the planner to load its engine
        if d.trigger_stamp_s > 0
    ]
    closed = sorted(record.closed.values(), key=lambda one: one.serial)
    still_open = sorted(record.bins.values(), key=lambda one: one.serial)
    errors = [1e3 * report.position_error_m for report in done if report.measured is not None]
    hidden = 0 if ledger is None else list(ledger.places.values()).count('unseen')
    unaccounted = record.unaccounted(hidden)
    placed = record.count(BoxEventKind.PLACED)
    robot_s = sum(report.cycle_s + report.wait_s for report in goals)
    working_s = wall_time_s - (first_decision_s or 0.0)
    if ledger is not None:
        unaccounted += disagreements(ledger, record)
    return {
        'boxes_supplied': record.supplied,
        'placed': placed,
        'rejected': record.count(BoxEventKind.REJECTED),
        'lost': record.count(BoxEventKind.LOST),
        'unaccounted': len(unaccounted),
        'accounts': None if ledger is None else accounts(ledger, record),
        'waits': {} if ledger is None else waits(ledger),
        'closed_bins': len(closed),
        'open_bins': len(still_open),
        **fill_metrics(record.true_bins(closed), record.true_bins(still_open)),
        'cycle_time_s': time_summary([options.deadline_s - r.slack_s for r in done]),
        'planning_s': time_summary([d.planning_s for d in record.all_decisions]),
        'arm_planning_s': time_summary([r.planning_s for r in done]),
        'motion_s': time_summary([r.motion_s for r in done]),
        'wait_s': time_summary([r.wait_s for r in done]),
        'robot_time_s': robot_s,
        'boxes_per_hour': 3600 * placed / robot_s if robot_s else None,
        'times_real_time': robot_s / working_s if working_s > 0 else None,
        'ros_overhead_s': time_summary(overhead),
        'arm_asked': asked_summary(record.all_decisions),
        'deadline_s': options.deadline_s,
        'deadline_misses': sum(1 for r in done if r.slack_s < 0),
        'refused_goals': sum(1 for r in goals if not r.code.box_is_in_bin),
        'goal_codes': _tally(r.code for r in goals),
        'rule_violations': len(violations),
        'max_pose_error_mm': max(errors, default=None),
        'p95_pose_error_mm': quantile(errors, 0.95) if errors else None,
        'max_others_moved_mm': max((1e3 * r.others_moved_m for r in done), default=None),
        'memory_mb': dict(memory or {}),
        'first_decision_s': first_decision_s,
        'wall_time_s': wall_time_s,
        'bin': options.bin_spec.name,
        'algorithm': options.algorithm,
        'profile': options.profile,
        'look_ahead': options.look_ahead,
        'arm': options.arm,
        'speed': options.speed,
        'seed': options.seed,
        'boxes': options.boxes or 'cartons',
        'faults': options.faults,
        'scan_sigma_mm': options.scan_sigma_mm,
        'size_sigmas': options.size_sigmas,
        'versions': _versions(),
        'command': ' '.join(command),
        'problems': [*problems, *(str(v) for v in violations), *unaccounted],
    }


def _tally(codes: Iterable[ErrorCode]) -> dict[str, int]:
    counts: dict[str, int] = {}
    for code in codes:
        counts[code.name] = counts.get(code.name, 0) + 1
    return dict(sorted(counts.items()))


def write_run(folder: Path, summary: dict[str, Any], rows: Iterable[dict[str, Any]]) -> None:
    """Write ``summary.json`` and ``placements.jsonl`` into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'summary.json').write_text(json.dumps(summary, indent=2) + '\n')
    lines = [json.dumps(row) for row in rows]
    (folder / 'placements.jsonl').write_text('\n'.join(lines) + '\n' if lines else '')
