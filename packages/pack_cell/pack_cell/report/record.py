"""What a run has shown so far, gathered from the topics; knows when the run is complete.

With an archive, boxes that are done with leave the memory: those of a bin some time after it was
closed, rejected ones likewise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from pack_cell.report.archive import Archive, BinFigures, bin_figures
from pack_cell.report.placement_rows import placement_row
from pack_cell.report.run_figures import RunFigures
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_msgs_py.wording import how_many

#: Closed bins that are kept at hand: whatever comes late is about a box in one of these.
KEPT_BINS = 20
#: Reasons for closing that are kept: bins that are about to be closed at a time, and many more.
MOST_REASONS = 100
#: Decisions and reports of which a repetition is recognized.
_KEPT_KEYS = 500

_FINAL = {
    BoxEventKind.PLACED: 'placed',
    BoxEventKind.REJECTED: 'rejected',
    BoxEventKind.LOST: 'lost',
}
_PASSING = {
    BoxEventKind.PICKED: 'in_gripper',
    BoxEventKind.RETURNED: 'on_belt',
    BoxEventKind.UNKNOWN: 'unknown',
}


@dataclass
class RunRecord:
    """Feeds on scans, decisions, reports, events and bins, in any order and more than once.

    ``all_reports`` are the latest by goal; ``figures`` count them all. ``start_ids`` are boxes that
    were in bins before the run began. ``by_hand`` are ids of boxes that people have put into a bin
    or taken out of one, ``bins_by_hand`` those of the bins.
    """

    boxes: dict[str, Box] = field(default_factory=dict)
    true_boxes: dict[str, Box] = field(default_factory=dict)
    decisions: dict[str, Decision] = field(default_factory=dict)
    reports: dict[str, Report] = field(default_factory=dict)
    all_reports: dict[bytes, Report] = field(default_factory=dict)
    events: dict[str, BoxEvent] = field(default_factory=dict)
    scan: Scan | None = None
    bins: dict[str, Bin] = field(default_factory=dict)
    closed: dict[str, Bin] = field(default_factory=dict)
    closings: dict[str, ClosingReason] = field(default_factory=dict)
    archive: Archive | None = None
    start_ids: frozenset[str] = frozenset()
    figures: RunFigures = field(default_factory=RunFigures)
    by_hand: set[str] = field(default_factory=set)
    bins_by_hand: set[str] = field(default_factory=set)
    _decision_keys: dict[tuple[str, int, float], None] = field(default_factory=dict)
    _last: Counter[BoxEventKind] = field(default_factory=Counter)

    def on_scan(self, scan: Scan) -> set[str]:
        """Remember the newest scan and every box it shows; returns those not known like this."""
        self.scan = scan
        # The newest: a box may be scanned again.
        return self._note_boxes(self.boxes, scan)

    def on_truth(self, scan: Scan) -> set[str]:
        """Remember what the boxes really are; returns those not known like this."""
        return self._note_boxes(self.true_boxes, scan)

    def _note_boxes(self, known: dict[str, Box], scan: Scan) -> set[str]:
        fresh = {
            item.box.id: item.box
            for item in scan.boxes
            if known.get(item.box.id) != item.box and not self._archived(item.box.id)
        }
        known.update(fresh)
        return set(fresh)

    def on_decision(self, decision: Decision) -> bool:
        """Remember a decision; ``False`` when it was already known."""
        key = (decision.box.id, decision.sequence, decision.stamp_s)
        if key in self._decision_keys or self._archived(decision.box.id):
            return False
        _remember(self._decision_keys, key, None)
        self.boxes.setdefault(decision.box.id, decision.box)
        self.decisions[decision.box.id] = decision
        self.figures.add_decision(decision)
        return True

    def on_report(self, report: Report) -> bool:
        """Remember the outcome of a goal; ``False`` when it was already known."""
        if report.goal_id in self.all_reports or self._archived(report.box_id):
            return False
        _remember(self.all_reports, report.goal_id, report)
        self.reports[report.box_id] = report
        self.figures.add_report(report)
        return True

    def on_event(self, event: BoxEvent) -> bool:
        """Remember what happened to a box; ``False`` for a repetition or an outdated event."""
        before = self.events.get(event.box_id)
        if before is not None and event.stamp_s <= before.stamp_s:
            return False
        if self._archived(event.box_id):
            return False
        placed = before is not None and before.event is BoxEventKind.PLACED
        taken_out = event.event is BoxEventKind.REJECTED and bool(event.bin_id)
        if placed and event.event is BoxEventKind.REJECTED and not taken_out:
            return False  # the arm was quicker than the reject lane
        if taken_out or (event.event, event.reason) == (BoxEventKind.PLACED, Reason.OPERATOR):
            self.by_hand.add(event.box_id)
            self.bins_by_hand.add(event.bin_id)
        if before is not None:
            self._last[before.event] -= 1
        self._last[event.event] += 1
        self.events[event.box_id] = event
        return True

    def on_bins(self, snapshot: BinSnapshot) -> None:
        """Remember the bins that stand in the cell."""
        self.bins = {
            standing.id: standing for standing in snapshot.bins if standing.id not in self.closed
        }

    def on_closed(self, closed: Bin) -> bool:
        """Remember the content of a bin that was taken away; ``False`` when it was known."""
        archived = [] if self.archive is None else self.archive.bins
        known = closed.id in self.closed
        if any(figures.serial == closed.serial for figures in archived):
            return False
        self.closed[closed.id] = closed
        self.bins.pop(closed.id, None)
        for old in list(self.closed.values())[:-KEPT_BINS]:
            self._retire(old)
        return not known

    def on_closing(self, reason: ClosingReason) -> None:
        """Remember why a bin is about to be closed; the last reason of a bin counts."""
        self.closings[reason.bin_id] = reason
        for bin_id in list(self.closings)[:-MOST_REASONS]:
            del self.closings[bin_id]  # of bins that there are not, if somebody says so

    def _archived(self, box_id: str) -> bool:
        return self.archive is not None and box_id in self.archive.where

    def _retire(self, closed: Bin) -> None:
        """Move a bin into the archive, unless one of its boxes has not come to its end."""
        archive, ids = self.archive, [placed.box.id for placed in closed.boxes]
        if archive is None or not all(self._is_done(box_id) for box_id in ids):
            return
        stamps_s = (self.events[box_id].stamp_s for box_id in ids if box_id in self.events)
        first_s = min(stamps_s, default=0.0)
        rejected = [
            event.box_id
            for event in self.events.values()
            if event.event is BoxEventKind.REJECTED and event.stamp_s < first_s
        ]
        archive.write(self.rows([*rejected, *ids]))
        archive.add_bin(closed, self.true_bin(closed), self.closings.pop(closed.id, None))
        archive.where.update(dict.fromkeys(rejected, 'rejected'))
        del self.closed[closed.id]
        for known in (self.boxes, self.true_boxes, self.decisions, self.reports, self.events):
            for box_id in (*rejected, *ids):
                known.pop(box_id, None)

    def _is_done(self, box_id: str) -> bool:
        event, report = self.events.get(box_id), self.reports.get(box_id)
        placed = event is not None and event.event is BoxEventKind.PLACED
        reported = box_id in self.by_hand or (report is not None and report.code.box_is_in_bin)
        return box_id in self.start_ids or (placed and reported)

    def rows(self, box_ids: Iterable[str]) -> list[dict[str, Any]]:
        """One object per box that is not archived, in the order in which they came to their end."""
        where = {
            placed.box.id: (in_bin, placed)
            for in_bin in self.every_bin()
            for placed in in_bin.boxes
        }
        boxes = self.boxes | {
            box_id: where[box_id][1].box for box_id in self.start_ids if box_id in where
        }
        chosen = list(box_ids)
        ended = [box_id for box_id in chosen if box_id in self.events]
        ended.sort(key=lambda box_id: self.events[box_id].stamp_s)
        return [
            placement_row(
                box_id,
                box=boxes.get(box_id),
                true=self.true_boxes.get(box_id),
                decision=self.decisions.get(box_id),
                report=self.reports.get(box_id),
                event=self.events.get(box_id),
                where=where.get(box_id),
                at_start=box_id in self.start_ids,
            )
            for box_id in [*ended, *(box_id for box_id in chosen if box_id not in self.events)]
        ]

    def every_bin(self) -> list[Bin]:
        """All bins that are not archived, in the order they were opened."""
        return sorted([*self.closed.values(), *self.bins.values()], key=lambda known: known.serial)

    def places(self) -> dict[str, list[str]]:
        """Every place each known box is in. More than one is a doubled box, none is a lost one.

        A box in the archive is named only when it is somewhere else too.
        """
        places: dict[str, list[str]] = {box_id: [] for box_id in {*self.boxes, *self.events}}
        archived = {} if self.archive is None else self.archive.where

        def add(box_id: str, where: str) -> None:
            known = [archived[box_id]] if box_id in archived else []
            places.setdefault(box_id, known).append(where)

        for known_bin in self.every_bin():
            for placed in known_bin.boxes:
                add(placed.box.id, f'bin {known_bin.id}')
        if self.scan is not None:
            for item in self.scan.boxes:
                add(item.box.id, 'belt')
        # A box that came back may have to wait at the induct for its place on the belt.
        on_the_way = self.scan is not None and bool(self.scan.boxes or self.scan.remaining)
        for box_id, where in places.items():
            last = self.events.get(box_id)
            if on_the_way and not where and (last is None or last.event is BoxEventKind.RETURNED):
                where.append('belt')
        for box_id, event in self.events.items():
            if event.event in (BoxEventKind.REJECTED, BoxEventKind.LOST):
                places[box_id].append(_FINAL[event.event])
            elif event.event in (BoxEventKind.PICKED, BoxEventKind.UNKNOWN) and not places[box_id]:
                places[box_id].append(_PASSING[event.event])
        return places

    def count(self, kind: BoxEventKind) -> int:
        """Boxes whose last event is ``kind``."""
        return self._last[kind]

    def unknown(self) -> int:
        """Boxes whose last event is that nobody has resolved where they are."""
        return self._last[BoxEventKind.UNKNOWN]

    def ids_in_bins(self) -> set[str]:
        """Every box that was put into a bin, archived or not."""
        archived = {} if self.archive is None else self.archive.where
        live = {placed.box.id for known in self.every_bin() for placed in known.boxes}
        gone = {box_id for box_id, where in archived.items() if where != 'rejected'}
        return (live | gone) - self.start_ids

    def bin_figures(self, profile: Profile) -> tuple[list[BinFigures], list[BinFigures]]:
        """Figures of the closed bins and of those that stand, each in the order of opening."""
        archived = [] if self.archive is None else self.archive.bins
        closed, still_open = (
            [
                bin_figures(measured, self.true_bin(measured), profile, reasons.get(measured.id))
                for measured in bins.values()
            ]
            for bins, reasons in ((self.closed, self.closings), (self.bins, {}))
        )
        return _by_serial([*archived, *closed]), _by_serial(still_open)

    def true_bin(self, measured: Bin) -> Bin:
        """``measured`` with the true sizes of its boxes, as far as these are known."""
        return replace(measured, boxes=tuple(map(self._truly, measured.boxes)))

    def _truly(self, placed: PlacedBox) -> PlacedBox:
        true = self.true_boxes.get(placed.box.id)
        if true is None:
            return placed
        return replace(placed, box=replace(placed.box, size_mm=true.size_mm))

    @property
    def supplied(self) -> int:
        """Boxes that the conveyor has fed or rejected so far."""
        return self.scan.supplied if self.scan is not None else 0

    @property
    def expected(self) -> int | None:
        """Boxes that the stream holds in all; ``None`` when it is endless or not yet known."""
        if self.scan is None or self.scan.remaining < 0:
            return None
        return self.scan.supplied + self.scan.remaining

    @property
    def settled(self) -> int:
        """Boxes that have come to their end: placed, rejected or lost."""
        return sum(self._last[kind] for kind in _FINAL)

    def complete(self) -> bool:
        """Whether the stream has ended and every box of it has come to its end."""
        scan = self.scan
        if scan is None or scan.remaining != 0 or not self.drained():
            return False
        return len(self.ids_in_bins()) == self.count(BoxEventKind.PLACED)

    def drained(self) -> bool:
        """Whether no box is on its way any more: all that came have come to their end."""
        scan = self.scan
        if scan is None or scan.boxes or any(self._last[kind] for kind in _PASSING):
            return False
        return self.settled >= scan.supplied

    def all_reported(self) -> bool:
        """Whether every placed box has a report that says so."""
        return all(
            box_id in self.reports and self.reports[box_id].code.box_is_in_bin
            for box_id, event in self.events.items()
            if event.event is BoxEventKind.PLACED and box_id not in self.by_hand
        )

    def unaccounted(self, hidden: int = 0) -> list[str]:
        """What is wrong with boxes that are not in exactly one place, a line each.

        ``hidden`` boxes are known to be there although no scan shows them.
        """
        lines = [
            f'box {box_id!r} is in {how_many(len(where), "place")}: {", ".join(where) or "none"}'
            for box_id, where in sorted(self.places().items())
            if len(where) != 1
        ]
        archived = 0 if self.archive is None else len(self.archive.where)
        missing = self.supplied - hidden - archived - len({*self.boxes, *self.events})
        if missing > 0:
            lines.append(f'supplied, and never shown on any topic: {how_many(missing, "box")}')
        return lines


def _by_serial(figures: Iterable[BinFigures]) -> list[BinFigures]:
    return sorted(figures, key=lambda of_bin: of_bin.serial)


def _remember(known: dict[Any, Any], key: object, value: object) -> None:
    """Add to ``known``, and forget the oldest of many."""
    known[key] = value
    while len(known) > _KEPT_KEYS:
        del known[next(iter(known))]
