"""How far a box sinks that was let go a little above what really lies beneath it.

Boxes are rarely as high as they were scanned, and the planner leaves room for that: so the next one
comes to rest some millimetres lower than it was let go, which all later ones stand on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from pack_msgs_py.geometry.pose import Pose, extent
from pack_msgs_py.values import Vec3

#: Farther it does not sink: then it was let go beside what was to carry it.
MOST_M = 0.03
#: What overlaps less than this carries nothing, m.
_EDGE_M = 0.005


def sunk(pose: Pose, size: Vec3, others: Iterable[tuple[Vec3, Pose]]) -> Pose:
    """``pose`` of a box of this ``size``, lowered onto floor or ``others``; bin frame, metres.

    It stays level, on the highest of what is beneath; it stays where it is when nothing is near
    enough, or when what carries it stands a little higher than it was let go.

    >>> sunk(Pose((0.2, 0.2, 0.153)), (0.4, 0.4, 0.1), [((0.4, 0.4, 0.1), Pose((0.2, 0.2, 0.05)))])
    Pose(position=(0.2, 0.2, 0.15), quaternion=(0.0, 0.0, 0.0, 1.0))
    """
    low, high = extent(pose, size)
    tops = [0.0]
    for other_size, other in others:
        other_low, other_high = extent(other, other_size)
        if all(
            min(high[axis], other_high[axis]) - max(low[axis], other_low[axis]) > _EDGE_M
            for axis in (0, 1)
        ):
            tops.append(other_high[2])
    # One that is higher than it was scanned carries it all the same: what is below that does not.
    gap = low[2] - min(low[2], max(tops))
    if gap > MOST_M:
        return pose
    x, y, z = pose.position
    return replace(pose, position=(x, y, round(z - gap, 9)))
