"""Turns the record of a run into ``summary.json`` and ``placements.jsonl``."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

from pack_cell.options.run_options import GRASP_FACES, RunOptions
from pack_cell.report.accounts import Ledger, accounts, disagreements, waits
from pack_cell.report.archive import BinFigures
from pack_cell.report.record import RunRecord
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.metrics import fill_metrics_of
from pack_msgs_py.profiles import Profile, find_profile

_PACKAGES = ('pack_cell', 'numpy', 'pybullet', 'rclpy', 'toppra', 'pin', 'numba')


def execution_profile(
    name: str, size_sigmas: float | None = None, grasp_faces: str = 'top'
) -> Profile:
    """The rules as a run with an arm applies them, ``size_sigmas`` instead of the profile's own.

    Whatever the profile allows, it is the arm's ``grasp_faces`` that orientations depend on.
    """
    profile = replace(find_profile(name), orientations=GRASP_FACES[grasp_faces])
    return profile if size_sigmas is None else replace(profile, size_sigmas=size_sigmas)


def placement_rows(record: RunRecord) -> list[dict[str, Any]]:
    """One object per box that is not archived, in the order in which they came to their end."""
    return record.rows(dict.fromkeys([*record.events, *record.boxes]))


def _versions() -> dict[str, str]:
    found = {'python': platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def destinations(
    closed: Sequence[BinFigures], still_open: Sequence[BinFigures]
) -> dict[str, dict[str, Any]]:
    """Boxes in the bins of each destination; empty where every bin takes any box."""
    names = sorted({one.destination for one in (*closed, *still_open) if one.destination})
    found = {}
    for name in names:
        gone = [one for one in closed if one.destination == name and one.boxes]
        standing = [one for one in still_open if one.destination == name and one.boxes]
        fills = fill_metrics_of(*([one.fill_rate for one in some] for some in (gone, standing)))
        found[name] = {
            'boxes': sum(one.boxes for one in (*gone, *standing)),
            'closed_bins': len(gone),
            'open_bins': len(standing),
            'fill_all': fills['fill_all'],
        }
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
    closed, still_open = record.bin_figures(
        execution_profile(options.profile, options.size_sigmas, options.grasp_faces)
    )
    violations = [broken for one in (*closed, *still_open) for broken in one.violations]
    hidden = 0 if ledger is None else list(ledger.places.values()).count('unseen')
    unaccounted = record.unaccounted(hidden)
    placed = record.count(BoxEventKind.PLACED)
    robot_s = record.figures.robot_s
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
        **fill_metrics_of(
            [one.fill_rate for one in closed if one.boxes],
            [one.fill_rate for one in still_open if one.boxes],
        ),
        **record.figures.summary(options.deadline_s),
        'robot_time_s': robot_s,
        'boxes_per_hour': 3600 * placed / robot_s if robot_s else None,
        'times_real_time': robot_s / working_s if working_s > 0 else None,
        'rule_violations': len(violations),
        'mis_sorts': sum(one.mis_sorts for one in (*closed, *still_open)),
        'destinations': destinations(closed, still_open),
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


def write_run(folder: Path, summary: dict[str, Any], record: RunRecord) -> None:
    """Write ``summary.json`` into ``folder``, and the rows that ``placements.jsonl`` lacks."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'summary.json').write_text(json.dumps(summary, indent=2) + '\n')
    if record.archive is not None:
        record.archive.write(placement_rows(record))
