"""What the arm is asked for: the goal, and the boxes that wait on the belt meanwhile."""

from __future__ import annotations

from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.model.arm_interface import PlaceRequest
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box

#: Neighbours on the belt that stand this near behind the box must be kept clear of.
NEIGHBOUR_REACH_M = 0.5
_SAME_HEIGHT_M = 1e-3


def neighbours(goal: PlaceGoal, scan: Scan | None) -> tuple[tuple[Box, Pose], ...]:
    """Boxes behind that of ``goal`` once it is at the pick point, frame `cell`.

    The top strand moves as one towards the arm (-y): the others come along by as much as the box
    still has to go. Those before it go round the head, out of the way.
    """
    box, pick = goal.decision.box, goal.pick
    scanned = None if scan is None else scan.find(box.id)
    if scan is None or scanned is None:
        return ()
    on_top = abs(scanned.pose.position[2] - pick.position[2]) < _SAME_HEIGHT_M
    shift = pick.position[1] - scanned.pose.position[1] if on_top else 0.0
    belt_z = pick.position[2] - box.size_mm[2] / 2e3
    back_y = pick.position[1] + box.size_mm[1] / 2e3
    near = []
    for other in scan.boxes:
        x, y, z = other.pose.position
        front_y = y + shift - other.box.size_mm[1] / 2e3
        on_belt = abs(z - other.box.size_mm[2] / 2e3 - belt_z) < _SAME_HEIGHT_M
        if other.box.id != box.id and on_belt and 0 <= front_y - back_y <= NEIGHBOUR_REACH_M:
            near.append((other.box, Pose((x, y + shift, z), other.pose.quaternion)))
    return tuple(near)


def request_of(goal: PlaceGoal, station: str, scan: Scan | None) -> PlaceRequest:
    """What the arm is asked for."""
    decision = goal.decision
    return PlaceRequest(decision.box, goal.pick, station, decision.target, neighbours(goal, scan))
