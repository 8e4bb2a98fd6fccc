"""What is done first: the book takes up the journal, and the arm's world follows the book."""

from __future__ import annotations

from collections.abc import Callable

from arm_executor.bins.book import BinBook
from arm_executor.bins.doubt import DOUBT
from arm_executor.goals.operator_panel import OperatorPanel
from arm_executor.goals.outputs import BinClosed, Happened, Output, Said
from arm_executor.goals.resolving import finder
from arm_executor.model.arm_interface import Arm
from pack_msgs_py.alarms import raised


def recover(
    book: BinBook,
    arm: Arm,
    panel: OperatorPanel,
    emit: Callable[[Output], None],
    now_s: float,
) -> None:
    """Decide what became of the box that was under way, and repeat what everybody must know.

    Parameters
    ----------
    book, panel : of the executor.
    arm : is asked where that box is, and then shown the bins.
    emit : takes the events of the journal and the closed bins once more.
    now_s : seconds since the epoch.
    """
    recovery = book.recover(finder(arm))
    state = book.state
    book.settled(arm.set_bins(state.bins, state.poses))
    for attempt in recovery.undecided:
        box_id = attempt.placed.box.id
        alarm = raised('BOX_UNKNOWN', f'box {box_id!r} is unknown: {DOUBT}', now_s, box_id=box_id)
        if alarm is not None:
            panel.raise_alarm(alarm)
    for attempt in recovery.returned:
        text = f'box {attempt.placed.box.id!r} was in the gripper: returned'
        emit(Said('warning', text))
    for attempt in recovery.unmeasured:
        text = f'box {attempt.placed.box.id!r} was just released: measured'
        emit(Said('warning', text))
    for event in book.events():
        emit(Happened(event))
    for closed, poses in book.closed():
        emit(BinClosed(closed, poses))
