"""What a run shows on the screen: a line per box, a progress bar, and the summary at the end."""

from __future__ import annotations

from typing import Any

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from pack_cell.report.record import RunRecord
from pack_cell.report.summary import summary_lines
from pack_cell.running.screen import Screen
from pack_cell.watching.state_text import COLOURS, alarm_line
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.cell_values import BoxEvent, Decision, Report
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.codes import BoxEventKind, Condition
from pack_msgs_py.values import Bin
from pack_msgs_py.wording import how_many

#: What an operator has done, or is to do: told as it comes.
_SHOWN = (Condition.PAUSED, Condition.STOPPED, Condition.ALARM, Condition.DRAINING)


class RunDisplay:
    """Prints a run as it happens; only lines of text where no one looks at a terminal."""

    def __init__(self, record: RunRecord, *, quiet: bool = False) -> None:
        self.console = Screen()
        self._record = record
        self._quiet = quiet
        self._closed: list[Bin] = []
        self._unexplained = ''
        self._state: tuple[Condition, str] | None = None
        self._alarms: set[tuple[str, str, float]] = set()
        self._progress = Progress(
            TextColumn('{task.description}'),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TextColumn('boxes'),
            TimeElapsedColumn(),
            console=self.console,
            transient=True,
            disable=quiet or not self.console.is_terminal,
        )
        self._task = self._progress.add_task('packing', total=None)

    def __enter__(self) -> RunDisplay:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._tell_closed(at_last=True)
        self._progress.stop()

    def say(self, text: str | Text, style: str = '') -> None:
        """Print a line as it is above the bar, unless quiet."""
        if not self._quiet:
            self.console.tell(text, style)

    def on_change(self, kind: str, value: object) -> None:
        """Show one change of the record."""
        if isinstance(value, Report):
            self._report(value)
            self._tell_closed()
        elif isinstance(value, BoxEvent) and value.event is not BoxEventKind.PLACED:
            self._event(value)
        elif isinstance(value, Bin) and kind == 'closed':
            self._closed.append(value)
            self._tell_closed()
        elif isinstance(value, ClosingReason) and value.bin_id == self._unexplained:
            # the planner's word and the executor's come on two topics
            self._unexplained = ''
            self.say(f'       bin {value.bin_id} closed: {value.text}', 'cyan')
        self._progress.update(
            self._task, completed=self._record.settled, total=self._record.expected
        )

    def on_state(self, state: CellState) -> None:
        """Say when somebody has stopped the cell, when it needs somebody, and when it goes on."""
        shown = state.condition in _SHOWN
        # How many boxes are left is told by each box.
        told = '' if state.condition is Condition.DRAINING else state.summary
        if (state.condition, told) != self._state and (shown or self._state is not None):
            self._state = (state.condition, told) if shown else None
            action = f'. {state.next_action}' if state.next_action else ''
            text = f'{state.summary.rstrip(".")}{action}'
            self.say(f'       {text}', COLOURS[state.condition])
        for alarm in state.alarms:
            key = (alarm.code, alarm.box_id, alarm.raised_s)
            if key not in self._alarms:
                self._alarms.add(key)
                if not shown:
                    self.say(Text('     ').append_text(alarm_line(alarm)))

    def _tell_closed(self, *, at_last: bool = False) -> None:
        """Print bins once all that went into them is printed; bins and reports may overtake."""
        for closed in list(self._closed):
            if at_last or not any(self._is_awaited(placed.box.id) for placed in closed.boxes):
                self._closed.remove(closed)
                boxes = how_many(len(closed.boxes), 'box')
                fill = f'{100 * closed.fill_rate:.1f} % full'
                reason = self._record.closings.get(closed.id)
                why = f'; {reason.text}' if reason is not None else ''
                self._unexplained = '' if reason is not None else closed.id
                self.say(f'       bin {closed.id} closed: {boxes}, {fill}{why}', 'cyan')

    def _is_awaited(self, box_id: str) -> bool:
        report = self._record.reports.get(box_id)
        done = report is not None and report.code.box_is_in_bin
        return box_id in self._record.decisions and not done

    def _report(self, report: Report) -> None:
        box = self._record.boxes.get(report.box_id)
        decision: Decision | None = self._record.decisions.get(report.box_id)
        size = 'x'.join(f'{edge:g}' for edge in box.size_mm) if box else '?'
        if not report.code.box_is_in_bin:
            text = f'{report.bin_id}: {report.code.name} {report.message}'
            self.say(f'       {report.box_id} refused for {text}', 'yellow')
            return
        corner = decision.corner_mm if decision else ('?', '?', '?')
        planning = f'{1e3 * decision.planning_s:6.1f}' if decision else '     ?'
        total = self._record.expected
        count = self._record.figures.in_bin
        at = '({:>4}, {:>4}, {:>4})'.format(*corner)
        line = Text(
            f'{count:>3}/{total if total is not None else "?":<3} {report.box_id:<24.24} '
            f'{size:>13} mm -> {report.bin_id:<7} {at} mm  plan {planning} ms  '
            f'motion {report.motion_s:4.2f} s  slack '
        )
        line.append(f'{report.slack_s:+5.2f} s', 'green' if report.slack_s >= 0 else 'red')
        if report.code.value:
            line.append(f' {report.code.name} {report.message}', 'red')
        self.say(line)

    def _event(self, event: BoxEvent) -> None:
        if event.event is BoxEventKind.REJECTED:
            reason = event.reason.name.lower()
            self.say(f'       {event.box_id} rejected, {reason}: {event.text}', 'yellow')
        elif event.event in (BoxEventKind.RETURNED, BoxEventKind.LOST, BoxEventKind.UNKNOWN):
            self.say(f'       {event.box_id} {event.event.name.lower()}: {event.text}', 'red')

    def summary(self, summary: dict[str, Any], folder: object) -> None:
        """Print the summary of a run, a line per measure."""
        self.console.tell('\nSummary', 'bold')
        for name, text in summary_lines(summary):
            self.console.tell(f'  {name:<18} {text}')
        for problem in summary['problems']:
            self.console.tell(Text.assemble('  ', ('problem', 'red'), f'            {problem}'))
        self.console.tell(f'written to {folder}')
