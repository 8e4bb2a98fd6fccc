"""What the scan says of the belt: numbers that grow over restarts, poses, windows as stamps."""

from __future__ import annotations

from conveyor_sim.belt.loop import Belt, OnBelt, loop_pose
from conveyor_sim.belt.tilt_tray import pose_on_tray
from conveyor_sim.induct.box_book import BoxBook
from conveyor_sim.ledger.ledger import Ledger
from pack_msgs_py.cell_values import Scan, ScannedBox

#: Scan numbers reserved in the ledger at a time, so that they grow over restarts.
_SEQUENCE_BLOCK = 1000


class ScanMaker:
    """Makes scans of ``belt``, a loop of ``length_m`` metres, with the boxes of ``book``."""

    def __init__(self, belt: Belt, ledger: Ledger, book: BoxBook, length_m: float) -> None:
        self._belt = belt
        self._book = book
        self._ledger = ledger
        self._length_m = length_m
        self._pick_open: tuple[float, float] | None = None
        self._sequence = self._sequence_end = int(ledger.setting('scan_sequence', '0'))

    def scan(self, now_s: float, stamp_s: float, supplied: int, remaining: int) -> Scan:
        """The look-ahead at this instant; each call has the next sequence number."""
        if self._sequence >= self._sequence_end:
            self._sequence_end = self._sequence + _SEQUENCE_BLOCK
            self._ledger.set_setting('scan_sequence', str(self._sequence_end))
        self._sequence += 1
        return Scan(
            sequence=self._sequence,
            stamp_s=stamp_s,
            boxes=tuple(self._scanned(item, now_s, stamp_s) for item in self._belt.view(now_s)),
            belt_velocity=self._belt.velocity(now_s),
            supplied=supplied,
            remaining=remaining,
        )

    def true_boxes(self, now_s: float) -> tuple[ScannedBox, ...]:
        """The boxes on the belt as they are, each where it is once it stands at the pick point."""
        boxes = []
        for item in self._belt.view(now_s):
            record = self._book.record(item.box.id)
            if record is not None:
                pose = self._book.true_pose(record, item.to_be_up)
                boxes.append(ScannedBox(self._book.true_box(record), pose))
        return tuple(boxes)

    def _scanned(self, item: OnBelt, now_s: float, stamp_s: float) -> ScannedBox:
        opens_s = closes_s = None
        if item.opens_s is not None:
            opens_s = self._opens(item.opens_s, now_s, stamp_s, held=item.held)
            if item.closes_s is not None:
                closes_s = opens_s + (item.closes_s - item.opens_s)
        seen = self._book.seen(item.box.id)
        if item.tipped:
            pose = pose_on_tray(seen.size_mm, item.up, item.tipped)
        else:
            pose = loop_pose(item.s_m, self._length_m, seen.size_mm)
        pose = self._book.lie(item.box.id).of(pose, seen.size_mm)
        return ScannedBox(
            box=seen,
            pose=pose,
            pick_open_s=opens_s,
            pick_close_s=closes_s,
            travel_time_s=item.travel_time_s,
            laps=item.laps,
        )

    def _opens(self, opens_s: float, now_s: float, stamp_s: float, *, held: bool) -> float:
        """As seconds since the epoch; for a box that is held the same in every scan."""
        if not held:
            return stamp_s + (opens_s - now_s)
        if self._pick_open is None or self._pick_open[0] != opens_s:
            self._pick_open = (opens_s, stamp_s - (now_s - opens_s))
        return self._pick_open[1]
