"""Coordinate frames that move against each other, and the way from one to another (as tf2 has it).

Each frame but one has a parent. Poses of a frame are in its parent, metres; times are seconds since
the epoch.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, field

from pack_msgs_py.geometry.pose import Pose, Quaternion, conjugate, quaternion_product, rotated

#: So much of the past is kept, seconds: what tf2 keeps by default.
HISTORY_S = 10.0
#: A pose is taken to hold so long after the last one that was heard, seconds.
STALE_S = 1.0
#: A chain of more frames than this is a circle.
_LONGEST_CHAIN = 100


def composed(second: Pose, first: Pose) -> Pose:
    """In the frame that ``second`` is in, the pose of what is at ``first`` in the frame there.

    >>> composed(Pose((1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)), Pose((2.0, 0.0, 0.0))).position
    (-1.0, 0.0, 0.0)
    """
    offset = rotated(second.quaternion, first.position)
    x, y, z = (a + b for a, b in zip(second.position, offset, strict=True))
    return Pose((x, y, z), quaternion_product(second.quaternion, first.quaternion))


def inverse(pose: Pose) -> Pose:
    """Where the frame that ``pose`` is in lies, seen from what is there."""
    back = conjugate(pose.quaternion)
    x, y, z = (-part for part in rotated(back, pose.position))
    return Pose((x, y, z), back)


def between(first: Pose, second: Pose, share: float) -> Pose:
    """The pose ``share``, 0 to 1, of the way from ``first`` to ``second``."""
    x, y, z = (a + share * (b - a) for a, b in zip(first.position, second.position, strict=True))
    # the shorter way round: a quaternion and its negative are the same turn
    dot = sum(a * b for a, b in zip(first.quaternion, second.quaternion, strict=True))
    sign = -1.0 if dot < 0 else 1.0
    mixed = [
        (1.0 - share) * a + sign * share * b
        for a, b in zip(first.quaternion, second.quaternion, strict=True)
    ]
    length = math.hypot(*mixed)
    turn: Quaternion = tuple(part / length for part in mixed)  # type: ignore[assignment]
    return Pose((x, y, z), turn)


class UnknownTransform(ValueError):
    """There is no way, or none at that time, from one frame to another."""


@dataclass
class _Link:
    """Where a frame is in its parent: one pose for good, or a history."""

    parent: str
    is_static: bool
    times_s: list[float] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)

    def add(self, time_s: float, pose: Pose) -> None:
        if self.is_static:
            self.times_s, self.poses = [time_s], [pose]
            return
        at = bisect_right(self.times_s, time_s)
        self.times_s.insert(at, time_s)
        self.poses.insert(at, pose)
        old = bisect_right(self.times_s, self.times_s[-1] - HISTORY_S)
        del self.times_s[:old], self.poses[:old]

    def at(self, child: str, time_s: float) -> Pose:
        if self.is_static:
            return self.poses[0]
        times_s = self.times_s
        after = bisect_right(times_s, time_s)
        if after == 0 or time_s > times_s[-1] + STALE_S:
            msg = (
                f'the transform of frame {child!r} in {self.parent!r} is known from '
                f'{times_s[0]:.3f} to {times_s[-1]:.3f} s, it was asked for at {time_s:.3f} s'
            )
            raise UnknownTransform(msg)
        if after == len(times_s):
            return self.poses[-1]
        begin_s, end_s = times_s[after - 1], times_s[after]
        share = (time_s - begin_s) / (end_s - begin_s) if end_s > begin_s else 1.0
        return between(self.poses[after - 1], self.poses[after], share)


class FrameTree:
    """Frames by name, as they were told."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}

    def add(self, child: str, parent: str, pose: Pose, time_s: float, *, is_static: bool) -> None:
        """At ``time_s`` ``child`` is at ``pose`` in ``parent``; for good when it is static."""
        link = self._links.get(child)
        if link is None or (link.parent, link.is_static) != (parent, is_static):
            link = self._links[child] = _Link(parent, is_static)
        link.add(time_s, pose)

    def pose_of(self, frame: str, within: str, time_s: float) -> Pose:
        """Pose of ``frame`` in ``within``.

        Raises
        ------
        UnknownTransform
            Nobody has told how the two lie to each other, or where at ``time_s``.
        """
        if frame == within:
            return Pose()
        ups, downs = self._ancestors(frame), self._ancestors(within)
        common = next((name for name in ups if name in downs), None)
        if common is None:
            known = ', '.join(sorted({*self._links, *(x.parent for x in self._links.values())}))
            msg = (
                f'nothing connects frame {frame!r} with {within!r}; known are '
                f'{known or "no frames at all"}: publish where it is, for one that stays where it '
                f'is with `ros2 run tf2_ros static_transform_publisher --frame-id {within} '
                f'--child-frame-id {frame}`'
            )
            raise UnknownTransform(msg)
        up, down = (self._in_ancestor(name, common, time_s) for name in (frame, within))
        return composed(inverse(down), up)

    def _ancestors(self, frame: str) -> list[str]:
        """``frame``, its parent, and so on to the root."""
        names = [frame]
        while (link := self._links.get(names[-1])) is not None:
            names.append(link.parent)
            if len(names) > _LONGEST_CHAIN or link.parent in names[:-1]:
                msg = f'the frames {" in ".join(names[:5])} ... form a circle'
                raise UnknownTransform(msg)
        return names

    def _in_ancestor(self, frame: str, ancestor: str, time_s: float) -> Pose:
        pose = Pose()
        while frame != ancestor:
            link = self._links[frame]
            pose = composed(link.at(frame, time_s), pose)
            frame = link.parent
        return pose
