"""The latest of everything the planner hears, and which boxes it may choose from."""

from __future__ import annotations

from dataclasses import dataclass, field

from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Report, Scan
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_msgs_py.values import Bin, Box
from pack_planner.coordination.set_aside import SetAside

#: Boxes whose last event is remembered: far more than a belt and its bins hold.
EVENTS_KEPT = 1000


#: A scan comes each second; what is so much older tells of a belt as it was long ago.
SCAN_AGE_S = 10.0
#: A box that is not what was scanned gets this long to be scanned again, seconds.
RESCAN_S = 1.0


def check_scan(scan: Scan, now_s: float) -> Scan:
    """``scan`` itself; ``ValueError`` when its stamp makes it useless.

    ``now_s`` : the same clock as its stamp, seconds since the epoch.
    """
    age = now_s - scan.stamp_s
    if abs(age) > SCAN_AGE_S:
        msg = (
            f'its stamp is {abs(age):.1f} s {"old" if age > 0 else "ahead"}, at most '
            f'{SCAN_AGE_S:g} s will do: is the conveyor alive, do the clocks agree?'
        )
        raise ValueError(msg)
    return scan


@dataclass(frozen=True)
class Heartbeat:
    """The executor's mode; see pack_msgs/ExecutorState."""

    mode: Mode
    active_box_id: str = ''
    stamp_s: float = 0.0


@dataclass
class Inputs:
    """What was heard last. Stamps are seconds since the epoch."""

    scan: Scan | None = None
    unusable: int = 0
    bins: BinSnapshot | None = None
    heartbeat: Heartbeat | None = None
    rejected: set[str] = field(default_factory=set)
    _events: dict[str, BoxEvent] = field(default_factory=dict)
    _newest_event_s: float = 0.0
    _doubted: dict[str, tuple[Box, float]] = field(default_factory=dict)
    _set_aside: SetAside = field(default_factory=SetAside)

    def doubt(self, box: Box, report: Report | None) -> None:
        """A goal for this box has failed: maybe because the box is not what was scanned.

        It is then on offer again once a scan says something else of it, or :data:`RESCAN_S` later:
        whoever scans it again may see the same.
        """
        if report is not None and report.code is ErrorCode.BOX_MISMATCH:
            self._doubted[box.id] = (box, report.stamp_s)
        if self.scan is not None and report is not None:
            self._set_aside.tried(box.id, report.code, report.stamp_s, self.scan)

    def _is_doubted(self, box: Box, scan_stamp_s: float) -> bool:
        doubted, since_s = self._doubted.get(box.id, (None, 0.0))
        if doubted == box and scan_stamp_s < since_s + RESCAN_S:
            return True
        self._doubted.pop(box.id, None)
        return False

    def add_event(self, event: BoxEvent) -> None:
        """Remember what happened to a box last; two nodes report, so stamps decide the order."""
        self._newest_event_s = max(self._newest_event_s, event.stamp_s)
        last = self._events.get(event.box_id)
        if last is not None and event.stamp_s < last.stamp_s:
            return
        self._events.pop(event.box_id, None)
        self._events[event.box_id] = event
        while len(self._events) > EVENTS_KEPT:
            del self._events[next(iter(self._events))]

    def last_event(self, box_id: str) -> BoxEventKind | None:
        """What happened last to this box, ``None`` when nothing did."""
        event = self._events.get(box_id)
        return None if event is None else event.event

    def available(self) -> tuple[Box, ...]:
        """Boxes on the belt that are to be placed, nearest first.

        A box that was picked, placed, rejected or lost may still be in a scan that was made before.
        One that the arm could not take, time and again, waits until the others have been tried.
        """
        if self.scan is None:
            return ()
        return self._set_aside.offered(self._to_be_placed(), self.scan)

    def _to_be_placed(self) -> tuple[Box, ...]:
        if self.scan is None or self.bins is None:
            return ()
        in_bins = {placed.box.id for target in self.bins.bins for placed in target.boxes}
        return tuple(
            item.box
            for item in self.scan.boxes
            if item.box.id not in in_bins
            and item.box.id not in self.rejected
            and self.last_event(item.box.id) in (None, BoxEventKind.RETURNED)
            and not self._is_doubted(item.box, self.scan.stamp_s)
        )

    def open_bin(self, bin_id: str) -> Bin:
        """The open bin with this id; ``StopIteration`` when there is none."""
        bins = self.bins.bins if self.bins is not None else ()
        return next(target for target in bins if target.id == bin_id)

    def is_available(self, box_id: str) -> bool:
        """Whether this box is one of them."""
        return any(box.id == box_id for box in self.available())

    def laps(self, boxes: tuple[Box, ...]) -> tuple[int, ...]:
        """How often each of ``boxes`` was passed over, as the belt counts it."""
        counts = {item.box.id: item.laps for item in self.scan.boxes} if self.scan else {}
        return tuple(counts.get(box.id, 0) for box in boxes)

    def look_ahead_full(self, look_ahead: int) -> bool:
        """Whether the belt shows all it can: the whole look-ahead, or the end of the stream."""
        if self.scan is None:
            return False
        shown = len(self._to_be_placed()) + self.unusable
        return self.scan.remaining == 0 or shown >= look_ahead

    def newest_stamp_s(self) -> float:
        """Stamp of the youngest input."""
        heard = (self.scan, self.bins, self.heartbeat)
        return max(
            self._newest_event_s, *(message.stamp_s for message in heard if message is not None)
        )


def same_content(bins: tuple[Bin, ...], others: tuple[Bin, ...]) -> bool:
    """Whether two states of the bins are the same for planning; measured poses may differ."""
    return _content(bins) == _content(others)


def _content(bins: tuple[Bin, ...]) -> list[tuple[object, ...]]:
    return [
        (
            (target.id, target.serial, target.revision, target.spec),
            *(
                (placed.box.id, placed.corner_mm, placed.size_mm, placed.orientation)
                for placed in target.boxes
            ),
        )
        for target in bins
    ]
