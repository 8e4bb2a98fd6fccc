"""What the planner does, and what it waits for, in words: for `/diagnostics`."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.codes import Mode
from pack_planner.coordination.inputs import Inputs
from pack_planner.coordination.running_goal import RunningGoal

#: Why an arm takes no goal, by its mode.
_ARM_WAITS = {
    Mode.INACTIVE: 'the arm to be ready, and to be activated',
    Mode.PROTECTIVE_STOP: 'the arm, which is stopped, to be reset',
    Mode.FAULT: 'the arm, which has failed, to be restarted',
    Mode.PAUSED: 'the arm, which is paused, to be resumed',
    Mode.ALARM: 'an alarm to be acknowledged',
    Mode.EXECUTING: 'the arm, which works on another goal',
}


@dataclass(frozen=True)
class Doing:
    """A word for what is done, and what is waited for; empty for nothing."""

    state: str
    waits_for: str = ''


#: Before the first decision can be computed.
STARTING = Doing('starting', 'its search to be compiled')


def what_is_done(
    inputs: Inputs,
    goal: RunningGoal | None,
    *,
    alive: bool,
    plans: bool,
    asks: bool,
    swaps: bool,
    stale: bool,
    held: str = '',
) -> Doing:
    """What a coordinator in this state does.

    Parameters
    ----------
    inputs, goal : what was heard last, and the goal that the arm has.
    alive : whether the heartbeat of the arm is heard.
    plans, asks, swaps : a decision is being computed, the arm is asked, a bin is awaited.
    stale : nothing is decided until something new is heard.
    held : why nothing is decided at all; empty when that is not so.
    """
    if not alive or inputs.heartbeat is None:
        return Doing('waiting', 'the heartbeat of the arm')
    if inputs.scan is None or inputs.bins is None:
        return Doing('waiting', 'the belt' if inputs.scan is None else 'the bins')
    if held:
        return Doing('waiting', held)
    if asks:
        return Doing('asking the arm')
    if plans:
        return Doing('deciding')
    if goal is not None:
        return Doing('watching', f'the arm to place box {goal.decision.box.id!r}')
    mode = inputs.heartbeat.mode
    if mode is not Mode.IDLE:
        return Doing('waiting', _ARM_WAITS[mode])
    if swaps:
        return Doing('waiting', 'a bin to be swapped or filled as reported')
    if not inputs.bins.bins:
        return Doing('waiting', 'a bin that may be filled')
    if not inputs.available():
        if inputs.scan.remaining == 0 and not inputs.scan.boxes:
            return Doing('done')
        return Doing('waiting', 'boxes')
    if stale:
        return Doing('waiting', 'the next news of belt or bins')
    return Doing('waiting', 'more boxes to choose from')
