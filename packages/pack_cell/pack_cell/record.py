"""What a run has shown so far, gathered from the topics; knows when the run is complete."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.values import Bin, Box, PlacedBox

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
    """Feeds on scans, decisions, reports, events and bins, in any order and more than once."""

    boxes: dict[str, Box] = field(default_factory=dict)
    true_boxes: dict[str, Box] = field(default_factory=dict)
    decisions: dict[str, Decision] = field(default_factory=dict)
    all_decisions: list[Decision] = field(default_factory=list)
    reports: dict[str, Report] = field(default_factory=dict)
    all_reports: dict[bytes, Report] = field(default_factory=dict)
    events: dict[str, BoxEvent] = field(default_factory=dict)
    scan: Scan | None = None
    bins: dict[str, Bin] = field(default_factory=dict)
    closed: dict[str, Bin] = field(default_factory=dict)
    _decision_keys: set[tuple[str, int, float]] = field(default_factory=set)
    _last: Counter[BoxEventKind] = field(default_factory=Counter)
    in_bin_reports: int = 0

    def on_scan(self, scan: Scan) -> None:
        """Remember the newest scan and every box it shows."""
        self.scan = scan
        for item in scan.boxes:
            # The newest: a box may be scanned again.
            self.boxes[item.box.id] = item.box

    def on_truth(self, scan: Scan) -> None:
        """Remember what the boxes really are."""
        for item in scan.boxes:
            self.true_boxes[item.box.id] = item.box

    def on_decision(self, decision: Decision) -> bool:
        """Remember a decision; ``False`` when it was already known."""
        key = (decision.box.id, decision.sequence, decision.stamp_s)
        if key in self._decision_keys:
            return False
        self._decision_keys.add(key)
        self.boxes.setdefault(decision.box.id, decision.box)
        self.decisions[decision.box.id] = decision
        self.all_decisions.append(decision)
        return True

    def on_report(self, report: Report) -> bool:
        """Remember the outcome of a goal; ``False`` when it was already known."""
        if report.goal_id in self.all_reports:
            return False
        self.all_reports[report.goal_id] = report
        self.reports[report.box_id] = report
        self.in_bin_reports += report.code.box_is_in_bin
        return True

    def on_event(self, event: BoxEvent) -> bool:
        """Remember what happened to a box; ``False`` for a repetition or an outdated event."""
        before = self.events.get(event.box_id)
        if before is not None and event.stamp_s <= before.stamp_s:
            return False
        placed = before is not None and before.event is BoxEventKind.PLACED
        if placed and event.event is BoxEventKind.REJECTED:
            return False  # the arm was quicker than the reject lane
        if before is not None:
            self._last[before.event] -= 1
        self._last[event.event] += 1
        self.events[event.box_id] = event
        return True

    def on_bins(self, snapshot: BinSnapshot) -> None:
        """Remember the bins that stand in the cell."""
        self.bins = {one.id: one for one in snapshot.bins if one.id not in self.closed}

    def on_closed(self, one: Bin) -> None:
        """Remember the content of a bin that was taken away."""
        self.closed[one.id] = one
        self.bins.pop(one.id, None)

    def every_bin(self) -> list[Bin]:
        """All bins of the run in the order they were opened."""
        return sorted([*self.closed.values(), *self.bins.values()], key=lambda one: one.serial)

    def places(self) -> dict[str, list[str]]:
        """Every place each known box is in. More than one is a doubled box, none is a lost one."""
        found: dict[str, list[str]] = {box_id: [] for box_id in {*self.boxes, *self.events}}
        for one in self.every_bin():
            for placed in one.boxes:
                found.setdefault(placed.box.id, []).append(f'bin {one.id}')
        if self.scan is not None:
            for item in self.scan.boxes:
                found.setdefault(item.box.id, []).append('belt')
        # A box that came back may have to wait at the induct for its place on the belt.
        on_the_way = self.scan is not None and bool(self.scan.boxes or self.scan.remaining)
        for box_id, where in found.items():
            last = self.events.get(box_id)
            if on_the_way and not where and (last is None or last.event is BoxEventKind.RETURNED):
                where.append('belt')
        for box_id, event in self.events.items():
            if event.event in (BoxEventKind.REJECTED, BoxEventKind.LOST):
                found[box_id].append(_FINAL[event.event])
            elif event.event in (BoxEventKind.PICKED, BoxEventKind.UNKNOWN) and not found[box_id]:
                found[box_id].append(_PASSING[event.event])
        return found

    def count(self, kind: BoxEventKind) -> int:
        """Boxes whose last event is ``kind``."""
        return self._last[kind]

    def unknown(self) -> int:
        """Boxes whose last event is that nobody has resolved where they are."""
        return self._last[BoxEventKind.UNKNOWN]

    def true_bins(self, bins: Iterable[Bin]) -> list[Bin]:
        """``bins`` with the true sizes of their boxes, as far as these are known."""
        return [replace(one, boxes=tuple(map(self._truly, one.boxes))) for one in bins]

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
        if scan is None or scan.remaining != 0 or scan.boxes or self.settled < scan.supplied:
            return False
        in_bins = sum(len(one.boxes) for one in self.every_bin())
        return in_bins == self.count(BoxEventKind.PLACED)

    def all_reported(self) -> bool:
        """Whether every placed box has a report that says so."""
        return all(
            box_id in self.reports and self.reports[box_id].code.box_is_in_bin
            for box_id, event in self.events.items()
            if event.event is BoxEventKind.PLACED
        )

    def unaccounted(self, hidden: int = 0) -> list[str]:
        """What is wrong with boxes that are not in exactly one place, a line each.

        ``hidden`` boxes are known to be there although no scan shows them.
        """
        lines = [
            f'box {box_id!r} is in {len(where)} places: {", ".join(where) or "none"}'
            for box_id, where in sorted(self.places().items())
            if len(where) != 1
        ]
        missing = self.supplied - hidden - len({*self.boxes, *self.events})
        if missing > 0:
            lines.append(f'{missing} boxes were supplied that no topic ever showed')
        return lines
