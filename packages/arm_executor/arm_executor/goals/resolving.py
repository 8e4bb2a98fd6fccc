"""Boxes that a crash has left in doubt: the arm is asked first, a person afterwards."""

from __future__ import annotations

from arm_executor.bins.book import BookError
from arm_executor.bins.doubt import Finder
from arm_executor.bins.records import Attempt
from arm_executor.goals.outputs import BinsChanged, Happened
from arm_executor.goals.placing import Tools
from arm_executor.model.arm_interface import Arm, FindingArm, FoundAt


def finder(arm: Arm) -> Finder:
    """What the journal asks about boxes that ``arm`` was moving; it never knows where it cannot."""

    def find(attempt: Attempt, station: str) -> FoundAt | None:
        if not isinstance(arm, FindingArm):
            return None
        box, released = attempt.placed.box, attempt.step.in_bin
        return arm.find_box(box, station, attempt.target, released=released)

    return find


def resolve_box(tools: Tools, box_id: str, *, placed: bool, text: str) -> tuple[bool, str]:
    """A person has looked for the box ``box_id``: it is in its bin, or was taken away.

    Returns
    -------
    (bool, str)
        Whether it was in doubt, and what became of it.
    """
    try:
        event = tools.book.resolve(box_id, placed=placed, text=text)
    except BookError as error:
        return False, str(error)
    tools.plans.clear()
    state = tools.book.state
    tools.book.settled(tools.arm.set_bins(state.bins, state.poses))
    event = event or tools.book.events()[-1]
    tools.emit(Happened(event))
    tools.emit(BinsChanged(tools.book.state))
    if placed:
        return True, f'box {box_id!r} is in bin {event.bin_id}, which goes on'
    return True, f'box {box_id!r} was taken away; its bin goes on'
