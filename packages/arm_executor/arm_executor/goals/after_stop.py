"""After a protective stop, when a person has looked: the box back to the belt, the arm home."""

from __future__ import annotations

from arm_executor.goals.outputs import Happened
from arm_executor.goals.placing import Tools
from arm_executor.model.arm_interface import MotionError
from pack_msgs_py.codes import Reason


def clear_gripper(tools: Tools) -> tuple[bool, str]:
    """Bring a held box back to the belt, and the arm to where it waits.

    Returns
    -------
    (bool, str)
        Whether the gripper is empty now, so that the cell may go on, and what became of the box.
    """
    tools.plans.clear()
    attempt, text = tools.book.attempt, 'the gripper was empty'
    if attempt is not None:
        box_id = attempt.placed.box.id
        back, why = False, ''
        try:
            back = tools.arm.return_to_belt()
        except MotionError as error:
            why = f': {error}'
        if back:
            text = f'box {box_id!r} is back on the belt'
            event = tools.book.returned(Reason.OPERATOR, 'reset by the operator')
        elif tools.arm.holds() is None:
            text = f'box {box_id!r} is no longer in the gripper{why}'
            event = tools.book.lost(text)
        else:
            return False, f'box {box_id!r} cannot be brought back to the belt{why}; try again'
        tools.emit(Happened(event))
    if not tools.arm.withdraw():
        text += '; the arm cannot go back to where it waits, and stays where it is'
    return True, text
