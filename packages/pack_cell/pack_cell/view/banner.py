"""The state of the cell, to be read from three metres: one word, one colour, one action."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from pack_msgs_py.cell_state import CellState
from pack_msgs_py.codes import Condition


class Tone(str, Enum):
    """What the colour says; the word says it too."""

    RUN = 'run'
    PAUSED = 'paused'
    OPERATOR = 'operator'
    FAULT = 'fault'
    IDLE = 'idle'


@dataclass(frozen=True)
class Banner:
    """The state in a word, and the one next action; ``now`` is what the cell is doing."""

    tone: Tone
    word: str
    action: str
    now: str = ''


#: Word and colour of each condition.
LOOKS = {
    Condition.UNKNOWN: ('NO CELL', Tone.IDLE),
    Condition.STARTING: ('STARTING', Tone.IDLE),
    Condition.RUNNING: ('RUN', Tone.RUN),
    Condition.WAITING: ('RUN', Tone.RUN),
    Condition.DRAINING: ('DRAINING', Tone.PAUSED),
    Condition.ENDED: ('DONE', Tone.IDLE),
    Condition.PAUSED: ('PAUSED', Tone.PAUSED),
    Condition.STOPPED: ('WAITING FOR OPERATOR', Tone.OPERATOR),
    Condition.ALARM: ('WAITING FOR OPERATOR', Tone.OPERATOR),
    Condition.FAULT: ('FAULT', Tone.FAULT),
}
#: What to do where the state itself names nothing.
_OTHERWISE = {
    Condition.STARTING: 'Wait',
    Condition.WAITING: 'Lay boxes on the belt',
}
#: The buttons of the page that stand for verbs of the command line.
_BUTTONS = {
    'ack': 'Acknowledge',
    'feed': 'Feed again',
    'reset': 'Reset',
    'resume': 'Resume',
}


def banner_of(state: CellState, doing: str = '', domain: int = 0) -> Banner:
    """The banner for ``state``; ``doing`` is what the arm is at, ``domain`` that of ROS."""
    condition = state.condition
    word, tone = LOOKS[condition]
    action = state.next_action or _OTHERWISE.get(condition, 'Nothing to do')
    now = without_state(state.summary)
    if condition is Condition.UNKNOWN:
        now = f'No cell is heard in ROS domain {domain}'
    elif condition is Condition.RUNNING and doing:
        now = doing
    return Banner(tone, word, for_the_page(action), now)


def for_the_page(action: str) -> str:
    """An action with the button to press instead of the command to type.

    >>> for_the_page('See that nobody is near the arm, then: cell reset')
    'See that nobody is near the arm, then press Reset'
    """

    def button(match: re.Match[str]) -> str:
        name = _BUTTONS.get(match[1])
        return match[0] if name is None else f' press {name}'

    return re.sub(r': cell (\w+)', button, action)


def without_state(summary: str) -> str:
    """A summary without the word in capitals with which it begins.

    >>> without_state('WAITING for boxes: the belt is empty.')
    'For boxes: the belt is empty.'
    """
    rest = re.sub(r'^[A-Z]{3,}(?: [A-Z_]{3,})*:? ', '', summary)
    return rest[:1].upper() + rest[1:]
