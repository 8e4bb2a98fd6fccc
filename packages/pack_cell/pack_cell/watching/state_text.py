"""The state of a cell in words and colour, and as JSON."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from rich.text import Text

from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_state import CellState
from pack_msgs_py.codes import Condition, Level

#: Colours of a control room: green works, yellow somebody has stopped it, red needs somebody.
COLOURS = {
    Condition.UNKNOWN: 'red',
    Condition.STARTING: 'cyan',
    Condition.RUNNING: 'green',
    Condition.WAITING: 'green',
    Condition.DRAINING: 'yellow',
    Condition.ENDED: 'cyan',
    Condition.PAUSED: 'yellow',
    Condition.STOPPED: 'red',
    Condition.ALARM: 'red',
    Condition.FAULT: 'red',
}
_LEVELS = {Level.OK: 'green', Level.WARN: 'yellow', Level.ERROR: 'red', Level.STALE: 'red'}
#: The cell does not go on by itself, and nobody has wanted that.
NEEDS_SOMEBODY = (Condition.UNKNOWN, Condition.STOPPED, Condition.ALARM, Condition.FAULT)


def status_lines(state: CellState) -> Iterator[Text]:
    """What is going on, what to do, each node, what stands; a line each."""
    yield Text(state.summary, f'bold {COLOURS[state.condition]}')
    yield Text(f'Next: {state.next_action or "nothing to do."}')
    width = max((len(node.name) for node in state.nodes), default=0)
    for node in state.nodes:
        waits = f'; waits for {node.waits_for}' if node.waits_for else ''
        yield Text.assemble(f'  {node.name:<{width}}  ', (node.state, _LEVELS[node.level]), waits)
    for alarm in state.alarms:
        yield alarm_line(alarm)


def alarm_line(alarm: Alarm) -> Text:
    """One alarm or warning."""
    when = time.strftime('%H:%M:%S', time.localtime(alarm.raised_s))
    word, colour = ('ALARM', 'red') if alarm.blocks else ('warning', 'yellow')
    return Text.assemble(
        f'  {when} ', (f'{word} {alarm.code}', colour), f': {alarm.message} [{alarm.action}]'
    )


def status_json(state: CellState) -> dict[str, Any]:
    """The same for programs."""
    return {
        'state': state.condition.name,
        'summary': state.summary,
        'next_action': state.next_action,
        'nodes': {
            node.name: {
                'level': node.level.name,
                'state': node.state,
                'waits_for': node.waits_for,
            }
            for node in state.nodes
        },
        'alarms': [
            {
                'severity': alarm.severity.name,
                'code': alarm.code,
                'message': alarm.message,
                'action': alarm.action,
                'box_id': alarm.box_id,
                'bin_id': alarm.bin_id,
                'raised_s': alarm.raised_s,
            }
            for alarm in state.alarms
        ],
    }
