"""How long the arm waits for its box: for the belt that brings it, and for the tray that tips it.

Both begin at the last pick and are hidden behind the motion of that box as far as it goes. What the
belt takes longer is reported apart. What the tilt tray takes longer counts like motion, towards
cycle time and deadline, since it is the price of another face.
"""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose, stands_upright


@dataclass(frozen=True)
class Waiting:
    """Robot seconds that the arm waits for the belt, and after that for the tray."""

    belt_s: float = 0.0
    tray_s: float = 0.0


def waiting_for(
    box_id: str, pick: Pose, scan: Scan | None, hidden_s: float | None, tilt_time_s: float
) -> Waiting:
    """How long the arm waits for a box that is to lie at ``pick``.

    Parameters
    ----------
    box_id, pick : the box, and how it is to lie.
    scan : the latest, which says how long the belt takes.
    hidden_s : robot seconds since the last pick; ``None`` when nothing was picked yet: then the
        belt's time is not known, and nothing hides the tray's.
    tilt_time_s : robot time of one tip.
    """
    tip_s = 0.0 if stands_upright(pick.quaternion) else tilt_time_s
    if hidden_s is None:
        return Waiting(0.0, tip_s)
    scanned = None if scan is None else scan.find(box_id)
    travel_s = 0.0 if scanned is None else scanned.travel_time_s
    belt_s = max(0.0, travel_s - hidden_s)
    return Waiting(belt_s, max(0.0, travel_s + tip_s - hidden_s) - belt_s)
