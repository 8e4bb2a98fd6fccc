"""The charts of one run: fill over time, planning under motion, cycle times, decision times."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from itertools import accumulate

from markupsafe import Markup

from pack_cell.report_page.charts import Plot, legend
from pack_cell.report_page.run_folder import FinishedRun, RunBox
from pack_msgs_py.wording import how_many

#: How many boxes the picture of planning under motion shows.
GANTT_BOXES = 14
#: Bins whose fill is drawn, the last ones: more cannot be told apart.
MOST_BINS = 60
#: Where in a motion the grasp, after which the next decision begins, is drawn.
GRASP_SHARE = 1 / 3
_IN_ORDER = 'box, in the order of placing'


def fill_over_time(run: FinishedRun) -> Markup:
    """A rising line for each bin, with a dot where it was closed."""
    ends_s = run.ends_s
    bins = [of_run for of_run in run.bins if of_run.boxes][-MOST_BINS:]
    last_s = max((ends_s.get(p.box.id, 0.0) for b in bins for p in b.boxes), default=0.0)
    if not last_s:
        return Markup('')
    unit_s, unit = (60.0, 'minutes') if last_s < 3 * 3600 else (3600.0, 'hours')
    first_s = min(ends_s.get(b.boxes[0].box.id, 0.0) for b in bins) if len(bins) > 1 else 0.0
    start = 0.0 if first_s < last_s / 2 else first_s / unit_s
    plot = Plot((start, last_s / unit_s), (0.0, 100.0), f'robot time, {unit}', 'fill, % of the bin')
    marks: list[Markup] = []
    for number, of_run in enumerate(bins):
        whole = of_run.spec.volume_mm3
        fills = accumulate(100 * placed.box.volume_mm3 / whole for placed in of_run.boxes)
        times = [ends_s.get(placed.box.id, 0.0) / unit_s for placed in of_run.boxes]
        points = list(zip(times, fills, strict=True))
        style = f's{number % 6}'
        told = f'bin {of_run.name}: {how_many(len(points), "box")}, {points[-1][1]:.1f} %'
        marks.append(plot.line([(times[0], 0.0), *points], style, told))
        if of_run.closed:
            marks.append(plot.dots(points[-1:], f'closed {style}'))
    mean = run.summary.get('fill_closed')
    if mean is not None:
        marks.append(plot.rule(mean, f'closed bins: {mean:.1f} %'))
    return plot.svg(marks, 'Fill of each bin over the time of the robot')


def cycle_times(run: FinishedRun) -> Markup:
    """What each box took of its deadline, in the order of placing."""
    cycles = [
        (float(number), cycle_s)
        for number, box in enumerate(run.placed, start=1)
        if (cycle_s := run.cycle_s(box)) is not None
    ]
    if not cycles:
        return Markup('')
    deadline_s = float(run.summary['deadline_s'])
    top = max(max(cycle_s for _, cycle_s in cycles), min(deadline_s, 3 * cycles[0][1]))
    plot = Plot((0.0, len(run.placed)), (0.0, 1.12 * top), _IN_ORDER, 'seconds')
    late = [point for point in cycles if point[1] > deadline_s]
    marks = [
        plot.dots([point for point in cycles if point[1] <= deadline_s], 's0'),
        plot.dots(late, 'late'),
    ]
    if deadline_s <= 1.12 * top:
        marks.append(plot.rule(deadline_s, f'deadline {deadline_s:g} s'))
    return plot.svg(marks, 'Seconds that each box took, against the deadline')


#: What takes computing time: style, name, how a box tells it.
_COMPUTED: tuple[tuple[str, str, Callable[[RunBox], float | None]], ...] = (
    ('s0', 'decision of the planner', lambda box: box.planning_s),
    ('s4', 'asking the arm', lambda box: box.check_s),
    ('s2', "the arm's planning of its motion", lambda box: box.arm_planning_s),
)


def decision_times(run: FinishedRun) -> Markup:
    """Computing time of each box, milliseconds on a logarithmic axis."""
    series = []
    for style, name, seconds in _COMPUTED:
        points = [
            (float(number), 1e3 * value)
            for number, box in enumerate(run.placed, start=1)
            if (value := seconds(box))
        ]
        if points:
            series.append((style, name, points))
    values = [value for *_, points in series for _, value in points]
    if not values:
        return Markup('')
    plot = Plot(
        (0.0, len(run.placed)),
        (max(0.01, 0.7 * min(values)), max(1.4 * max(values), 10.0)),
        _IN_ORDER,
        'milliseconds',
        log_y=True,
    )
    chart = plot.svg(
        [plot.dots(points, style) for style, _, points in series], 'Computing time of each box'
    )
    return legend([(style, name) for style, name, _ in series]) + chart


def unhidden_s(run: FinishedRun, box: RunBox) -> float:
    """Seconds of the deadline that neither the motion nor the planning of the arm took."""
    cycle_s = run.cycle_s(box)
    if cycle_s is None or box.motion_s is None or box.arm_planning_s is None:
        return 0.0
    return max(0.0, cycle_s - box.motion_s - box.arm_planning_s)


def planning_text(run: FinishedRun) -> str:
    """One sentence on how much of the planning the motions hid; empty where it is not known."""
    known = [box for box in run.placed if box.arm_planning_s is not None and box.planning_s]
    if not known:
        return ''
    deciding_s = statistics.fmean((box.planning_s or 0) + (box.check_s or 0) for box in known)
    shown_s = statistics.fmean(unhidden_s(run, box) for box in known)
    moving_s = statistics.fmean(box.motion_s or 0.0 for box in known)
    return (
        f'A decision took {1e3 * deciding_s:.0f} ms, the answers of the arm included, beside a '
        f'motion of {moving_s:.2f} s; {1e3 * shown_s:.0f} ms a box were left that no motion hid.'
    )


def planning_under_motion(run: FinishedRun) -> Markup:
    """A row per box around the tightest one: its decision under the motion before, its own motion.

    The lengths are measured; that a decision begins a third into the motion before is not.
    """
    placed = [box for box in run.placed if box.motion_s is not None]
    if len(placed) < 2:
        return Markup('')
    slack = [box.slack_s if box.slack_s is not None else 0.0 for box in placed]
    tightest = min(range(len(placed)), key=lambda at: slack[at])
    first = max(0, min(tightest - GANTT_BOXES // 2, len(placed) - GANTT_BOXES))
    shown = placed[first : first + GANTT_BOXES]
    rows = _rows(run, shown)
    plot = Plot(
        (0.0, rows[-1][-1][2]),
        (-(len(shown) - 0.5), 0.5),
        'seconds',
        height=14 + 40 + 22 * len(shown),
        left=150,
    )
    marks = []
    for number, (box, bars) in enumerate(zip(shown, rows, strict=True)):
        marks.append(plot.label(plot.left - 8, -number, _short(box.id), 'end'))
        marks += [
            plot.bar(begin, end, -number, 13, style, f'{box.id}: {what} {end - begin:.3f} s')
            for style, begin, end, what in bars
        ]
    return _GANTT_LEGEND + plot.svg(marks, 'Planning of each box under the motion before')


_GANTT_LEGEND = legend(
    [
        ('s0', 'decision, the arm asked'),
        ('late', 'planning that no motion hid'),
        ('s4', "the arm's planning"),
        ('idle', 'waiting for the belt'),
        ('s2', 'motion'),
    ]
)
_Bar = tuple[str, float, float, str]


def _rows(run: FinishedRun, shown: Sequence[RunBox]) -> list[list[_Bar]]:
    """The bars of each box: style, begin and end in seconds, what it is; the motion comes last."""
    rows: list[list[_Bar]] = []
    now_s, before_s = 0.0, 0.0
    for box in shown:
        deciding_s = (box.planning_s or 0.0) + (box.check_s or 0.0)
        bars: list[_Bar] = []
        if rows:
            begin = now_s - before_s * (1 - GRASP_SHARE)
            bars.append(('s0', begin, begin + deciding_s, 'decision'))
        for style, seconds, what in (
            ('late', unhidden_s(run, box), 'not hidden'),
            ('s4', box.arm_planning_s or 0.0, "the arm's planning"),
            ('idle', box.wait_s or 0.0, 'waiting for the belt'),
            ('s2', box.motion_s or 0.0, 'motion'),
        ):
            if seconds > 0:
                bars.append((style, now_s, now_s + seconds, what))
                now_s += seconds
        before_s = box.motion_s or 0.0
        rows.append(bars)
    return rows


def _short(text: str, most: int = 19) -> str:
    return text if len(text) <= most else f'{text[: most - 1]}…'
