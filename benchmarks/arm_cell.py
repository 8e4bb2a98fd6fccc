#!/usr/bin/env python3
"""What the arm does in the whole cell, bin type by bin type: one table of the figures to reach.

    ./cell python benchmarks/arm_cell.py --count 200 --seed 1
    ./cell python benchmarks/arm_cell.py --count 200 --seed 1 --boxes cases.csv --bins EQ LDC

Each row is one `./cell run` with physics, flat out, and comes from its `summary.json`. The scanner
is exact unless `--scan-sigma` says otherwise: with an error of size, the position error contains
what the scanner did not know.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pack_msgs_py.codes import ErrorCode

#: Codes of goals that ended before the arm moved.
_BEFORE = range(ErrorCode.INVALID_GOAL, ErrorCode.GRASP_FAILED)
_MOVED_MM, _ERROR_MM = 5.0, 1.0
_PLANNING_MS = (60, 150)
_REAL_TIME = 10


@dataclass(frozen=True)
class Goal:
    """Figures to reach: percent of first choices, seconds of a cycle, boxes an hour."""

    first: float
    median: float
    p95: float
    hourly: float = 0.0


GOALS = {
    'EQ': Goal(99, 3.8, 4.8, 700),
    'LDC': Goal(98, 4.0, 5.2, 700),
    'SYN': Goal(99, 3.6, 4.6),
    'PAL': Goal(95, 4.4, 5.5),
    'RC': Goal(90, 5.0, 5.5),
}
_HEAD = (
    'bin',
    'placed of',
    'first choices done',
    'cycle median / p95 / max, s',
    'missed',
    'refused before moving',
    'failed in motion',
    'moved over 5 mm',
    'worst error, mm',
    'asking the arm, median / p95, ms',
    'boxes/h',
    'x real time',
    'closed fill (bins)',
)


def run_cell(kind: str, options: argparse.Namespace, out: Path) -> dict[str, Any]:
    """One run; its summary. ``RuntimeError`` when it left none."""
    command = [sys.executable, '-m', 'pack_cell', 'run', '--bin', kind, '--out', str(out)]
    command += ['--count', str(options.count), '--seed', str(options.seed), '--quiet']
    command += ['--scan-sigma', str(options.scan_sigma), '--algorithm', options.algorithm]
    command += ['--boxes', options.boxes] if options.boxes else []
    ended = subprocess.run(command, check=False, capture_output=True, text=True)
    path = out / 'summary.json'
    if not path.exists():
        msg = f'{" ".join(command)} ended with {ended.returncode}: {ended.stderr.strip()[-500:]}'
        raise RuntimeError(msg)
    report: dict[str, Any] = json.loads(path.read_text())
    return report


def row(kind: str, report: dict[str, Any]) -> list[str]:
    """The cells of one row; what falls short of its goal is bold."""
    goal = GOALS.get(kind, Goal(0, 100, 100))
    codes = {ErrorCode[name]: count for name, count in report['goal_codes'].items()}
    before = sum(count for code, count in codes.items() if code in _BEFORE)
    failed = {
        code.name: count
        for code, count in codes.items()
        if code not in _BEFORE and not code.box_is_in_bin
    }
    cycle, asked = report['cycle_time_s'], report['arm_asked']
    first, error = asked['first_choices_possible'] or 0.0, report['max_pose_error_mm'] or 0.0
    disturbed = codes.get(ErrorCode.OTHERS_DISTURBED, 0)
    ask = [1000 * (asked['check_s'][name] or 0.0) for name in ('p50', 'p95')]
    times, hourly = report['times_real_time'] or 0.0, report['boxes_per_hour'] or 0.0
    median = _marked(f'{cycle["p50"]:.2f}', cycle['p50'] <= goal.median)
    p95 = _marked(f'{cycle["p95"]:.2f}', cycle['p95'] <= goal.p95)
    fill = '' if report['fill_closed'] is None else f'{report["fill_closed"]:.1f} %'
    return [
        kind,
        f'{report["placed"]} of {report["boxes_supplied"]}',
        _marked(f'{first:.1f} %', first >= goal.first),
        f'{median} / {p95} / {cycle["max"]:.2f}',
        _marked(str(report['deadline_misses']), not report['deadline_misses']),
        str(before),
        _marked(', '.join(f'{n} {name}' for name, n in failed.items()) or '0', not failed),
        _marked(str(disturbed), not disturbed),
        _marked(f'{error:.2f}', error <= _ERROR_MM),
        ' / '.join(
            _marked(f'{value:.0f}', value <= most)
            for value, most in zip(ask, _PLANNING_MS, strict=True)
        ),
        _marked(f'{hourly:.0f}', hourly >= goal.hourly),
        _marked(f'{times:.1f}', times >= _REAL_TIME),
        f'{fill} ({report["closed_bins"]})',
    ]


def _marked(text: str, good: bool) -> str:
    return text if good else f'**{text}**'


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0] if __doc__ else '')
    parser.add_argument('--bins', nargs='+', default=list(GOALS))
    parser.add_argument('--count', type=int, default=40)
    parser.add_argument('--seed', type=int, default=0, help='0: boxes in the order of the file')
    parser.add_argument('--boxes', default='', help='box source, as for `cell run`')
    parser.add_argument('--scan-sigma', type=float, default=0.0, help='error of a size, mm')
    parser.add_argument('--algorithm', default='mpack_lite')
    parser.add_argument('--out', type=Path, help='folder to keep the runs in')
    options = parser.parse_args()
    print('| ' + ' | '.join(_HEAD) + ' |')
    print('|' + '---|' * len(_HEAD), flush=True)
    with tempfile.TemporaryDirectory() as spare:
        base = options.out or Path(spare)
        refusals: dict[str, dict[str, int]] = {}
        for kind in options.bins:
            report = run_cell(kind, options, base / kind)
            print('| ' + ' | '.join(row(kind, report)) + ' |', flush=True)
            refusals[kind] = report['arm_asked']['first_refusals']
    for kind, reasons in refusals.items():
        print(f'first choices refused in {kind}: {reasons or "none"}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
