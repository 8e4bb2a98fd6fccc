"""The state of the cell, to be read from three metres: one word, one colour, one action."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from pack_msgs_py.codes import Mode

#: The heartbeat comes ten times a second; silent for so long, the arm's node is not there.
SILENCE_S = 2.0


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


@dataclass(frozen=True)
class Signs:
    """What the state follows from.

    ``silent_s`` is how long no heartbeat came, ``None`` if none ever did; ``domain`` the ROS domain
    that is listened to; ``belt`` what the belt says of itself, empty if nothing.
    """

    mode: Mode | None = None
    message: str = ''
    silent_s: float | None = None
    belt: str = ''
    ended: bool = False
    boxes_on_belt: int = 0
    doing: str = ''
    domain: int = 0

    @property
    def is_paused(self) -> bool:
        """Whether a person has paused the arm."""
        return self.mode is Mode.PAUSED or (
            self.mode is Mode.INACTIVE and self.message.strip() == 'paused'
        )


def banner_of(signs: Signs) -> Banner:
    """The banner; the worst that applies, first."""
    if signs.silent_s is None or signs.mode is None:
        return Banner(
            Tone.IDLE,
            'NO CELL',
            'Start a cell: ./cell run',
            f'No cell is heard in ROS domain {signs.domain}',
        )
    if signs.silent_s > SILENCE_S:
        return Banner(
            Tone.FAULT,
            'FAULT',
            "Look whether the run has ended; if not, start the arm's node again",
            f'The arm has been silent for {signs.silent_s:.0f} s',
        )
    said = signs.message.strip()
    if signs.mode is Mode.FAULT:
        return Banner(Tone.FAULT, 'FAULT', "Start the arm's node again", said or 'The arm failed')
    if signs.mode is Mode.PROTECTIVE_STOP:
        return Banner(
            Tone.OPERATOR,
            'WAITING FOR OPERATOR',
            'See that the way is free, then press Reset',
            f'Protective stop: {said}' if said else 'Protective stop',
        )
    if signs.mode is Mode.ALARM:
        return Banner(
            Tone.OPERATOR, 'WAITING FOR OPERATOR', 'Look at the alarm, then acknowledge it', said
        )
    if signs.is_paused:
        now = said if said != 'paused' else 'The arm takes no new box'
        return Banner(Tone.PAUSED, 'PAUSED', 'Press Resume to go on', now)
    if signs.mode is Mode.INACTIVE:
        return Banner(Tone.IDLE, 'STARTING', 'Wait', said.capitalize())
    if signs.belt == 'paused':
        return Banner(Tone.PAUSED, 'PAUSED', 'Set the belt going again', 'The belt stands')
    if signs.ended and signs.mode is Mode.IDLE:
        return Banner(Tone.IDLE, 'DONE', 'Nothing to do', 'Every box has come to its end')
    if signs.mode is Mode.EXECUTING:
        return Banner(Tone.RUN, 'RUN', 'Nothing to do', signs.doing)
    if not signs.boxes_on_belt:
        return Banner(Tone.RUN, 'RUN', 'Lay boxes on the belt', 'Waiting for boxes')
    return Banner(Tone.RUN, 'RUN', 'Nothing to do', 'Choosing the next box')
