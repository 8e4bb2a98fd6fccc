"""What the executor knows of the belt: the latest scan, and how long a box is on its way."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping

from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.codes import Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.picking import lies_as

#: Phases of a motion after the box has left the belt.
_AFTER_PICK = (
    Phase.TRANSFERRING,
    Phase.LOWERING,
    Phase.RELEASING,
    Phase.RETREATING,
    Phase.SETTLING,
)


#: The arm goes for a box only in this first share of its pick window; it grasps in the rest.
START_SHARE = 0.5


class BeltView:
    """The latest scan, shared between the thread that hears it and the one that waits for it.

    ``wall`` gives seconds since the epoch.
    """

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self._changed = threading.Condition()
        self._wall = wall
        self.scan: Scan | None = None

    def update(self, scan: Scan) -> None:
        """A new scan has come."""
        with self._changed:
            self.scan = scan
            self._changed.notify_all()

    def wake(self) -> None:
        """Let a waiting thread look again whether it should give up."""
        with self._changed:
            self._changed.notify_all()

    def wait_presented(
        self, box_id: str, pick: Pose, timeout_s: float, give_up: Callable[[], bool]
    ) -> ScannedBox | None:
        """The box once it is at the pick point; ``None`` after ``timeout_s`` or ``give_up()``.

        It is not there yet while another of its faces is up than at ``pick``, however it is turned
        about the vertical. ``None`` at once when
        the scan, which is complete, no longer holds the box.

        On a belt that lets a box go after a while, a window that is half over is left for the
        next one, a lap later.
        """

        def presented() -> ScannedBox | None:
            scan = self.scan
            scanned = None if scan is None else scan.find(box_id)
            if scan is None or scanned is None or scanned.pick_open_s is None:
                return None
            opens_s, closes_s = scanned.pick_open_s, scanned.pick_close_s
            if opens_s > scan.stamp_s or not lies_as(scanned.pose, pick):
                return None
            if closes_s is not None:
                last_s = opens_s + START_SHARE * (closes_s - opens_s)
                return scanned if self._wall() < last_s else None
            return scanned

        def gone() -> bool:
            return self.scan is not None and self.scan.find(box_id) is None

        with self._changed:
            met = self._changed.wait_for(lambda: give_up() or presented() or gone(), timeout_s)
            return met if isinstance(met, ScannedBox) and not give_up() else None


class BeltClock:
    """Robot seconds that the belt has had since the last box was taken off it.

    The belt starts to bring the next box as soon as one is picked. While the arm moves, its motion
    says how much robot time passes; while it stands still, ``speed`` robot seconds pass in one of
    ``steady``. At speed 0, as fast as possible, none does: then planning counts, second for second,
    like in a cycle time.
    """

    def __init__(self, speed: float = 1.0, steady: Callable[[], float] = time.monotonic) -> None:
        self._speed = speed
        self._steady = steady
        self._motion_s = 0.0
        self._since: float | None = None

    def motion_ended(self, split_s: Mapping[Phase, float]) -> None:
        """A motion that picked its box has ended; ``split_s`` is its robot time by phase."""
        self._motion_s = sum(split_s.get(phase, 0.0) for phase in _AFTER_PICK)
        self._since = self._steady()

    def elapsed_s(self, planning_s: float = 0.0) -> float | None:
        """Robot seconds since the last pick; ``None`` before the first one of this run.

        ``planning_s`` are the seconds of planning since then.
        """
        if self._since is None:
            return None
        still_s = self._speed * (self._steady() - self._since) if self._speed else planning_s
        return self._motion_s + still_s
