"""Motion plans that were made for check_placements, kept for the goal that follows."""

from __future__ import annotations

from arm_executor.admission import Goal, find_scanned
from arm_executor.arm import Arm, MotionPlan, PlaceRequest
from pack_msgs_py.cell_values import Pose, Scan
from pack_msgs_py.values import Box

#: Poses that agree within this much share a plan; far below what the arm can repeat.
GRID_M = 1e-6
#: Neighbours on the belt that stand this near behind the box must be kept clear of.
NEIGHBOUR_REACH_M = 0.5
#: Neighbours may stand this much elsewhere without a new plan.
NEIGHBOUR_GRID_M = 0.02
_SAME_HEIGHT_M = 1e-3


def neighbours(goal: Goal, scan: Scan | None) -> tuple[tuple[Box, Pose], ...]:
    """Boxes behind that of ``goal`` once it is at the pick point, frame `cell`.

    The top strand moves as one towards the arm (-y): the others come along by as much as the box
    still has to go. Those before it go round the head, out of the way.
    """
    box, pick = goal.decision.box, goal.pick
    found = find_scanned(scan, box.id)
    if scan is None or found is None:
        return ()
    on_top = abs(found.pose.position[2] - pick.position[2]) < _SAME_HEIGHT_M
    shift = pick.position[1] - found.pose.position[1] if on_top else 0.0
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


def request_of(goal: Goal, station: str, scan: Scan | None) -> PlaceRequest:
    """What the arm is asked for."""
    decision = goal.decision
    return PlaceRequest(decision.box, goal.pick, station, decision.target, neighbours(goal, scan))


class PlanCache:
    """Plans by what was asked for. Cleared when the arm moves or the bins change."""

    def __init__(self) -> None:
        self._plans: dict[object, MotionPlan] = {}

    def plan(self, arm: Arm, request: PlaceRequest) -> MotionPlan:
        """The plan for ``request``, made now if there is none; may raise ``MotionError``."""
        key = (
            request.box,
            request.station,
            _rounded(request.pick, GRID_M),
            _rounded(request.target, GRID_M),
            tuple((box, _rounded(pose, NEIGHBOUR_GRID_M)) for box, pose in request.belt),
        )
        if key not in self._plans:
            self._plans[key] = arm.plan(request)
        return self._plans[key]

    def clear(self) -> None:
        """Forget all plans."""
        self._plans.clear()


def _rounded(pose: Pose, grid: float) -> tuple[int, ...]:
    return tuple(round(value / grid) for value in (*pose.position, *pose.quaternion))
