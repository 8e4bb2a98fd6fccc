"""Boxes that the arm could not take where the belt holds them: others come first."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pack_msgs_py.cell_values import Scan
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, turn_between
from pack_msgs_py.values import Box

#: After so many goals in a row that found the box not presented, others are offered instead.
TRIES = 3
#: When there is no other box, one that was set aside is tried again after so many seconds.
RETRY_S = 5.0
#: A box that lies so far elsewhere, metres, or is turned so far otherwise, radians, is a new case.
_MOVED_M, _TURNED_RAD = 0.02, math.radians(5.0)


@dataclass(frozen=True)
class _Tries:
    """Goals that did not find a box presented: how many in a row, the last when, and how it lay."""

    count: int
    stamp_s: float
    pose: Pose | None


class SetAside:
    """Counts goals that end with ``BOX_NOT_PRESENTED``, by box.

    A box is set aside as long as it lies where it lay then. Stamps are seconds since the epoch.
    """

    def __init__(self) -> None:
        self._tries: dict[str, _Tries] = {}

    def tried(self, box_id: str, code: ErrorCode, stamp_s: float, scan: Scan) -> None:
        """A goal for this box ended with ``code`` while the belt was as in ``scan``."""
        if code is not ErrorCode.BOX_NOT_PRESENTED:
            self._tries.pop(box_id, None)
            return
        before = self._tries.get(box_id)
        count = before.count if before is not None and self._lies_there(box_id, scan) else 0
        self._tries[box_id] = _Tries(count + 1, stamp_s, _pose(box_id, scan))

    def offered(self, boxes: tuple[Box, ...], scan: Scan) -> tuple[Box, ...]:
        """Those of ``boxes`` that are to be tried now."""
        if not self._tries:
            return boxes
        present = {item.box.id for item in scan.boxes}
        self._tries = {key: tries for key, tries in self._tries.items() if key in present}
        ready = tuple(box for box in boxes if not self._is_aside(box.id, scan))
        if ready:
            return ready
        return tuple(box for box in boxes if scan.stamp_s >= self._tries[box.id].stamp_s + RETRY_S)

    def _is_aside(self, box_id: str, scan: Scan) -> bool:
        tries = self._tries.get(box_id)
        return tries is not None and tries.count >= TRIES and self._lies_there(box_id, scan)

    def _lies_there(self, box_id: str, scan: Scan) -> bool:
        """Whether it still lies as it did, as far as is known."""
        was, now = self._tries[box_id].pose, _pose(box_id, scan)
        if now is None:
            return True
        if was is None:
            return False
        apart_m = math.dist(was.position, now.position)
        return apart_m <= _MOVED_M and turn_between(was, now) <= _TURNED_RAD


def _pose(box_id: str, scan: Scan) -> Pose | None:
    """Where a box is held at the pick point; ``None`` for one that is on its way."""
    scanned = scan.find(box_id)
    return None if scanned is None or scanned.pick_open_s is None else scanned.pose
