"""How boxes lie on the belt: beside its middle, short of the guide, turned; the scanner sees it.

How a box lies is a function of seed, place in the stream, and attempt: a restart changes nothing.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace

from pack_msgs_py.geometry.pose import Pose, about_z, extent, metres, quaternion_product
from pack_msgs_py.values import Vec3


@dataclass(frozen=True)
class Lie:
    """How a box lies, metres and radians.

    Attributes
    ----------
    aside_m : along x from the middle of the belt.
    short_m : how far it stays behind the guide that it should lie against.
    yaw_rad : how it is turned about the vertical.
    """

    aside_m: float = 0.0
    short_m: float = 0.0
    yaw_rad: float = 0.0

    def of(self, pose: Pose, size_mm: Vec3) -> Pose:
        """Where the centre of a box is that would be at ``pose`` if it lay straight.

        What of it is nearest to the guide stays there, ``short_m`` further back.
        """
        if self == Lie():
            return pose
        x, y, z = pose.position
        turned = replace(
            pose, quaternion=quaternion_product(about_z(self.yaw_rad), pose.quaternion)
        )
        size = metres(size_mm)
        nearer = extent(pose, size)[0][1] - extent(turned, size)[0][1]
        return replace(turned, position=(x + self.aside_m, y + nearer + self.short_m, z))


class BoxLies:
    """Draws how boxes lie: up to ``offset_mm`` off and ``yaw_deg`` turned, all equally likely."""

    def __init__(self, offset_mm: float = 0.0, yaw_deg: float = 0.0, seed: int = 0) -> None:
        self._offset_mm = offset_mm
        self._yaw_deg = yaw_deg
        self._seed = seed

    @property
    def key(self) -> str:
        """Equal for those that say the same; empty where all boxes lie straight."""
        most = (self._offset_mm, self._yaw_deg)
        return f'lie{most};{self._seed}' if any(most) else ''

    def of(self, ordinal: int, scans: int) -> Lie:
        """How the box at ``ordinal`` lies after it was scanned ``scans`` times."""
        if not self.key:
            return Lie()
        rng = random.Random('/'.join(map(str, (self._seed, 'lie', ordinal, scans))))
        offset_m = self._offset_mm / 1e3
        return Lie(
            rng.uniform(-offset_m, offset_m),
            rng.uniform(0.0, offset_m),
            math.radians(rng.uniform(-self._yaw_deg, self._yaw_deg)),
        )
