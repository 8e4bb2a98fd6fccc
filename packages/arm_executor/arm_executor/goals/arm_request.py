"""What the arm is asked for: the goal, and the boxes that wait on the belt meanwhile.

On the belt a box lies against a guide, so that all that the scanner is wrong about its depth is on
the far side. What is reserved in the bin has the margin for it half on each side. So the pad does
not take the middle of the box as it was scanned, but of the space that it may take up: the
guide's face to the scanned far side plus the whole margin for that. The margin for the angle at
which it may lie stays on both sides.
"""

from __future__ import annotations

import math
from dataclasses import replace

from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.model.arm_interface import PlaceRequest
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import (
    Pose,
    Quaternion,
    conjugate,
    extent,
    metres,
    quaternion_product,
    rotated,
    rotation_matrix,
    stands_upright,
)
from pack_msgs_py.picking import levelled, lies_as
from pack_msgs_py.values import Box, Vec3

#: Neighbours on the belt that stand this near behind the box must be kept clear of.
NEIGHBOUR_REACH_M = 0.5
#: What a scanner sees so near to the height of the belt lies on it.
_SAME_HEIGHT_M = 0.02


def neighbours(goal: PlaceGoal, scan: Scan | None) -> tuple[tuple[Box, Pose], ...]:
    """Boxes behind that of ``goal`` once it is at the pick point, frame `cell`.

    The top strand moves as one towards the arm (-y): the others come along by as much as the box
    still has to go. Those before it go round the head, out of the way.
    """
    box, pick = goal.decision.box, goal.pick
    scanned = None if scan is None else scan.find(box.id)
    if scan is None or scanned is None:
        return ()
    (_, pick_y, belt_z), (_, back_y, _) = extent(pick, metres(box.size_mm))
    (_, now_y, base_z), _ = extent(scanned.pose, metres(scanned.box.size_mm))
    on_top = abs(base_z - belt_z) < _SAME_HEIGHT_M
    shift = pick_y - now_y if on_top else 0.0
    near = []
    for other in scan.boxes:
        length, depth, height = metres(other.box.size_mm)
        (low_x, low_y, base_z), (high_x, _, _) = extent(other.pose, (length, depth, height))
        front_y = low_y + shift
        on_belt = abs(base_z - belt_z) < _SAME_HEIGHT_M
        if other.box.id != box.id and on_belt and 0 <= front_y - back_y <= NEIGHBOUR_REACH_M:
            if lies_as(other.pose, Pose()):
                x, y, z = other.pose.position
                pose = levelled(replace(other.pose, position=(x, y + shift, z)), Pose())
            else:
                # One that was tipped for another decision is tipped back before the belt moves.
                pose = Pose(((low_x + high_x) / 2, front_y + depth / 2, belt_z + height / 2))
            near.append((other.box, pose))
    return tuple(near)


def far_side_m(box: Box, pick: Pose, target: Pose, size_sigmas: float) -> float:
    """How far behind its scanned middle the pad takes ``box``, along y of `cell`, metres.

    Half of ``size_sigmas`` standard deviations of the edge that lies along y at ``pick``, less
    where the box may lie askew: that takes of the margin on either side, and both sides are to
    bear as many standard deviations. Nothing where another face than the top at ``pick`` is up at
    ``target``, since that box is taken by its front.
    """
    if not stands_upright(_turn(pick, target)):
        return 0.0
    along_x, along_y, _ = rotation_matrix(pick.quaternion)
    depth_mm = _along(along_y, box.size_stddev_mm)
    across_mm = _along(along_x, box.size_mm)
    askew_mm = box.yaw_stddev_rad * across_mm / 2
    far_mm = math.hypot(depth_mm, askew_mm)
    if not far_mm:
        return 0.0
    margin_mm = size_sigmas * box.room_stddev(depth_mm, across_mm) / 2
    even_mm = margin_mm * (far_mm - askew_mm) / (far_mm + askew_mm)
    return min(size_sigmas * depth_mm / 2, even_mm) / 1e3


def aside_in_bin(box: Box, pick: Pose, target: Pose, size_sigmas: float) -> Vec3:
    """Where the point that the pad takes lies from the scanned middle at ``target``, bin frame, m.

    Or the other way, where the arm turns the box by half a turn more.
    """
    far_m = far_side_m(box, pick, target, size_sigmas)
    return rotated(_turn(pick, target), (0.0, far_m, 0.0))


def request_of(
    goal: PlaceGoal, station: str, scan: Scan | None, size_sigmas: float = 0.0
) -> PlaceRequest:
    """What the arm is asked for.

    Parameters
    ----------
    goal : what goes where.
    station : where its bin stands.
    scan : the latest, for the neighbours on the belt.
    size_sigmas : of the profile (:class:`pack_msgs_py.profiles.Profile`): the margin of sizes.
    """
    decision, (x, y, z) = goal.decision, goal.pick.position
    far_m = far_side_m(decision.box, goal.pick, decision.target, size_sigmas)
    grasped = Pose((x, y + far_m, z), goal.pick.quaternion)
    return PlaceRequest(decision.box, grasped, station, decision.target, neighbours(goal, scan))


def _along(axis: Vec3, edges: Vec3) -> float:
    """Length along ``axis`` of what has ``edges``."""
    return sum(abs(share) * edge for share, edge in zip(axis, edges, strict=True))


def _turn(pick: Pose, target: Pose) -> Quaternion:
    """From how a box lies at ``pick`` to how it is to lie at ``target``."""
    return quaternion_product(target.quaternion, conjugate(pick.quaternion))
