"""The tilt tray at the pick point: it tips a box there so that another face comes up, and back.

The box lies against the guide and on the belt before and after. While it is tipped the belt stands;
an empty tray goes back while the belt already brings the next box, which waits for it at most.
Seconds are robot time; an angle is how long the tray needs for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from conveyor_sim.belt.loop import PICK_Y_M, TOP_Z_M
from pack_msgs_py.geometry.pose import Pose, extent, metres, partial_turn
from pack_msgs_py.orientation import QUATERNIONS, TIPPED
from pack_msgs_py.values import Vec3

#: So many times as fast as with a box an empty tray goes back: nothing can slide off it.
EMPTY_RATE = 2.0


@dataclass(frozen=True)
class TiltTray:
    """How far the tray has turned.

    Attributes
    ----------
    axis : of the box that it brings up; 'z' while it is flat.
    turned_s : so much of a tip is done.
    loaded : whether a box lies on it.
    """

    axis: str = 'z'
    turned_s: float = 0.0
    loaded: bool = False

    @property
    def back_s(self) -> float:
        """How long it needs to go back."""
        return self.turned_s if self.loaded else self.turned_s / EMPTY_RATE

    def back(self, seconds: float) -> TiltTray:
        """After it went back for at most so long."""
        if seconds < self.back_s:
            way_s = seconds if self.loaded else seconds * EMPTY_RATE
            return replace(self, turned_s=self.turned_s - way_s)
        return replace(self, axis='z', turned_s=0.0)

    def tipped(self, axis: str, seconds: float, full_s: float) -> TiltTray:
        """After a flat tray, or one on its way to ``axis``, went on for at most so long."""
        if axis == 'z':
            return self
        return replace(self, axis=axis, turned_s=min(full_s, self.turned_s + seconds))


def pose_on_tray(size_mm: Vec3, axis: str, share: float) -> Pose:
    """Pose of a box of ``size_mm`` at the pick point, tipped by ``share`` of the way, frame `cell`.

    It touches the guide and the belt, and is in the middle across the belt.
    """
    turn = partial_turn(QUATERNIONS[TIPPED[axis]], share)
    (_, y, z), _ = extent(Pose((0.0, 0.0, 0.0), turn), metres(size_mm))
    return Pose((0.0, PICK_Y_M - y, TOP_Z_M - z), turn)
