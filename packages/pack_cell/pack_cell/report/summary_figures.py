"""The figures of a run's summary, each declared once.

From :data:`FIGURES` follow ``summary.json``, the summary that is printed, whether a run counts as
clean, and the table in docs/summary.md (:mod:`pack_cell.report.summary`). A new figure is a new
entry; what it counts while the cell runs is remembered in :mod:`pack_cell.report.run_figures`.
"""

from __future__ import annotations

import platform
from dataclasses import asdict
from datetime import datetime
from importlib import metadata
from typing import Any

from pack_cell.report.accounts import account_text, accounts, waits, waits_text
from pack_cell.report.arm_answers import asked_text
from pack_cell.report.closings import closings, closings_text
from pack_cell.report.destinations import destinations, destinations_text
from pack_cell.report.ended_run import EndedRun
from pack_cell.report.figure_kinds import (
    Summary,
    SummaryFigure,
    boxes_now,
    counted,
    fill_rate,
    is_zero,
    times,
)
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.metrics import quantile
from pack_msgs_py.wording import how_many

#: Distributions whose versions a summary names.
_DISTRIBUTIONS = ('pack_cell', 'numpy', 'pybullet', 'rclpy', 'toppra', 'pin', 'numba')


def _bins_needed_text(summary: Summary) -> str:
    """Bins used, the bound, and the offline packer's; empty where no box was placed."""
    offline = summary['bins_offline']
    if offline is None or not summary['bins_used']:
        return ''
    packed = '' if offline['packed'] is None else f', {offline["packed"]} by an offline packer'
    least = f'{offline["least"]} at least by volume and weight'
    return f'{summary["bins_used"]} used; without a belt {least}{packed}'


def _cycles_s(run: EndedRun) -> list[float]:
    return [run.options.deadline_s - slack_s for slack_s in run.record.figures.slack_s]


def _boxes_per_hour(run: EndedRun) -> float | None:
    robot_s = run.record.figures.robot_s
    return 3600 * run.record.count(BoxEventKind.PLACED) / robot_s if robot_s else None


def _times_real_time(run: EndedRun) -> float | None:
    return run.record.figures.robot_s / run.working_s if run.working_s > 0 else None


def _robot_time_text(summary: Summary) -> str:
    """Robot time of all goals, boxes an hour of it, and how much faster than real time that was."""
    hourly, times = summary['boxes_per_hour'], summary['times_real_time']
    if hourly is None or times is None:
        return 'none'
    spent = summary['robot_time_s']
    return f'{spent:.1f} s, {hourly:.0f} boxes/h, {times:.1f} times real time'


def _goal_codes(run: EndedRun) -> dict[str, int]:
    goals = run.record.figures.goals
    return {code.name: goals[code] for code in sorted(goals, key=lambda code: code.name)}


def _refused_goals(run: EndedRun) -> int:
    goals = run.record.figures.goals
    return sum(number for code, number in goals.items() if not code.box_is_in_bin)


def _p95_pose_error_mm(run: EndedRun) -> float | None:
    errors_mm = run.record.figures.errors_mm
    return quantile(errors_mm, 0.95) if errors_mm else None


def _pose_error_text(summary: Summary) -> str:
    error_mm = summary['max_pose_error_mm']
    return 'none' if error_mm is None else f'{error_mm:.2f} mm'


def _resumed(run: EndedRun) -> dict[str, Any]:
    began = [datetime.fromtimestamp(session.began_s) for session in run.sessions[1:]]
    return {'times': len(began), 'at': [when.isoformat('T', 'seconds') for when in began]}


def _resumed_text(summary: Summary) -> str:
    """How often and when; empty for a run in one go."""
    resumed = summary['resumed']
    return (
        f'{how_many(resumed["times"], "time")}, last at {resumed["at"][-1]}'
        if resumed['times']
        else ''
    )


def _problems(run: EndedRun) -> list[str]:
    return [*run.problems_seen, *map(str, run.violations), *run.unaccounted]


def _versions(_: EndedRun) -> dict[str, str]:
    versions = {'python': platform.python_version()}
    for name in _DISTRIBUTIONS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


_QUANTILES = 'seconds: `mean`, `p50`, `p95`, `p99`, `max`'

#: In the order of ``summary.json`` and of the printed lines.
FIGURES: tuple[SummaryFigure, ...] = (
    SummaryFigure(
        'boxes_supplied',
        'boxes that the conveyor fed or rejected',
        lambda run: run.record.supplied,
        'boxes',
        counted('boxes_supplied', 'supplied'),
    ),
    boxes_now('placed', 'boxes in bins', BoxEventKind.PLACED),
    SummaryFigure(
        'start_boxes',
        'boxes that were in the bins at the start; bins and fills count them, `placed` does not',
        lambda run: len(run.record.start_ids),
        'boxes',
        lambda summary: f'{summary["start_boxes"]} at the start' if summary['start_boxes'] else '',
    ),
    boxes_now('rejected', 'boxes in the reject lane', BoxEventKind.REJECTED),
    boxes_now('lost', 'boxes that the arm lost; must be 0', BoxEventKind.LOST, is_zero),
    SummaryFigure(
        'unaccounted',
        'boxes that are not in exactly one place, or of which the books of conveyor and bins '
        'differ; must be 0',
        lambda run: len(run.unaccounted),
        'boxes',
        counted('unaccounted', 'unaccounted for'),
        is_zero,
    ),
    SummaryFigure(
        'accounts',
        "where every fed box is by the conveyor's books: [faults](faults.md)",
        lambda run: None if run.books is None else accounts(run.books, run.record),
        '  ledger',
        lambda summary: account_text(summary['accounts']),
        lambda value: value is None or (value['sum_is_right'] and not value['unknown']),
    ),
    SummaryFigure(
        'by_hand',
        'boxes that people have put into a bin or taken out of one; the rules are not judged in '
        'these bins',
        lambda run: len(run.record.by_hand),
        'boxes',
        lambda summary: f'{summary["by_hand"]} by hand' if summary['by_hand'] else '',
    ),
    SummaryFigure(
        'waits',
        'longest wait on the belt (robot time) and whose, most laps of a box, missed pick windows, '
        'jams',
        lambda run: {} if run.books is None else waits(run.books),
        '  longest wait',
        lambda summary: '' if summary['accounts'] is None else waits_text(summary['waits']),
    ),
    SummaryFigure(
        'closed_bins',
        'bins that were closed',
        lambda run: len(run.closed_bins),
        'bins',
        lambda summary: f'{summary["bin"]}: {summary["closed_bins"]} closed',
    ),
    SummaryFigure(
        'closings',
        'each closed bin: boxes, fill in percent, why the planner closed it in words, boxes on '
        'offer then by what kept them out, placements that the arm was asked about and refused',
        lambda run: closings(run.closed_bins),
        '  closed for',
        lambda summary: closings_text(summary['closings']),
    ),
    SummaryFigure(
        'open_bins',
        'bins that stood open at the end',
        lambda run: len(run.open_bins),
        'bins',
        counted('open_bins', 'open'),
    ),
    SummaryFigure(
        'bins_used',
        'bins that hold a box',
        lambda run: sum(bool(used.boxes) for used in run.all_bins),
    ),
    SummaryFigure(
        'bins_offline',
        'bins for the same boxes without a belt: `least`, which their volume and weight prove, and '
        '`packed`, with which an offline packer gets along that knows all boxes and leaves out '
        'margins, support and the arm; null where it has no answer in time',
        lambda run: None if run.offline is None else asdict(run.offline),
        'bins needed',
        _bins_needed_text,
    ),
    SummaryFigure(
        'destinations',
        'boxes, bins and fill by [destination](destinations.md)',
        lambda run: destinations(run.closed_bins, run.open_bins),
        'destinations',
        destinations_text,
    ),
    SummaryFigure(
        'mis_sorts',
        'boxes in bins that serve another destination; each is a broken rule',
        lambda run: sum(figures.mis_sorts for figures in run.all_bins),
    ),
    fill_rate('fill_closed', 'mean fill of the closed bins by true sizes, percent', 'closed bins'),
    fill_rate('fill_all', 'the same of all bins that hold a box', 'all bins'),
    fill_rate('fill_first_failure', 'the same of the bin that was closed first', 'first failure'),
    times(
        'cycle_time_s',
        f'what a box took of its deadline, {_QUANTILES}',
        _cycles_s,
        'cycle time',
    ),
    times(
        'motion_s',
        'motion of the arm, robot seconds',
        lambda run: run.record.figures.motion_s,
        '  motion',
    ),
    times(
        'planning_s',
        "the planner's decisions",
        lambda run: run.record.figures.planning_s,
        '  planning',
        (1e3, 'ms', 1),
    ),
    times(
        'arm_planning_s',
        "the arm's planning of its motion",
        lambda run: run.record.figures.arm_planning_s,
        '  arm planning',
        (1e3, 'ms', 0),
    ),
    times(
        'wait_s',
        'waiting of the arm for the belt, robot seconds',
        lambda run: run.record.figures.wait_s,
        '  waiting for belt',
    ),
    SummaryFigure(
        'turned_over',
        'placed boxes with another face up than on the belt',
        lambda run: len(run.record.figures.tray_s),
    ),
    times(
        'tray_s',
        'waiting of the arm for the tilt tray with these, robot seconds; part of `cycle_time_s`',
        lambda run: run.record.figures.tray_s,
        '  waiting for tray',
    ),
    times(
        'ros_overhead_s',
        'from the news that a decision follows to the decision, less planning and asking',
        lambda run: run.record.figures.overhead_s,
    ),
    SummaryFigure(
        'deadline_s',
        'deadline of a box, seconds',
        lambda run: run.options.deadline_s,
        'deadline',
        lambda summary: f'{summary["deadline_s"]:g} s',
    ),
    SummaryFigure(
        'deadline_misses',
        'boxes that took longer',
        lambda run: sum(slack_s < 0 for slack_s in run.record.figures.slack_s),
        'deadline',
        counted('deadline_misses', 'missed'),
    ),
    SummaryFigure(
        'arm_asked',
        "the arm's answers before a goal: decisions asked about, percent of first choices that it "
        'could do, why not the others, candidates per decision, objective lost (cm), seconds of '
        'asking',
        lambda run: run.record.figures.asked.summary(),
        'first choices',
        lambda summary: asked_text(summary['arm_asked']),
    ),
    SummaryFigure(
        'refused_goals', 'goals that ended without a box in a bin', _refused_goals, 'refused goals'
    ),
    SummaryFigure('goal_codes', 'goals by the code that they ended with', _goal_codes),
    SummaryFigure(
        'rule_violations',
        'packing rules that a replay of all bins found broken; must be 0',
        lambda run: len(run.violations),
        'rule violations',
        is_clean=is_zero,
    ),
    SummaryFigure(
        'max_pose_error_mm',
        'largest distance of a placed box from where it was to stand, millimetres',
        lambda run: max(run.record.figures.errors_mm, default=None),
        'worst pose error',
        _pose_error_text,
    ),
    SummaryFigure('p95_pose_error_mm', 'its 95 percent quantile', _p95_pose_error_mm),
    SummaryFigure(
        'max_others_moved_mm',
        'most that a placement moved another box, millimetres',
        lambda run: run.record.figures.others_moved_mm,
    ),
    SummaryFigure(
        'robot_time_s',
        'robot time of all goals, waiting for the belt included, seconds',
        lambda run: run.record.figures.robot_s,
        'robot time',
        _robot_time_text,
    ),
    SummaryFigure('boxes_per_hour', 'placed boxes per hour of robot time', _boxes_per_hour),
    SummaryFigure(
        'times_real_time', 'robot time per wall time since the first decision', _times_real_time
    ),
    SummaryFigure(
        'memory_mb',
        'memory of each process at a tenth of the run and at its end, megabytes',
        lambda run: dict(run.memory_mb),
    ),
    SummaryFigure(
        'first_decision_s',
        'from the start of the command to the first decision, seconds',
        lambda run: run.first_decision_s,
    ),
    SummaryFigure(
        'wall_time_s',
        'from the start of the command to the end of the nodes, seconds',
        lambda run: run.wall_time_s,
        'wall time',
        lambda summary: f'{summary["wall_time_s"]:.1f} s',
    ),
    SummaryFigure(
        'resumed',
        'how often the run was gone on with after a cut, and when; times and counts are of the '
        'whole run, but for boxes whose report a cut has swallowed',
        _resumed,
        'resumed',
        _resumed_text,
    ),
    SummaryFigure('bin', 'kind of every bin', lambda run: run.options.bin_spec.name),
    SummaryFigure('boxes', 'which boxes', lambda run: run.options.boxes or 'cartons'),
    SummaryFigure('versions', 'of Python and of what the cell stands on', _versions),
    SummaryFigure('command', 'the command line', lambda run: ' '.join(run.command)),
    SummaryFigure('problems', 'all that went wrong, a line each', _problems),
)
