"""What the page knows of the cell, gathered from the topics; any order, any repetition."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from arm_executor.model.box_on_pad import BoxOnPad, held_by_pad
from arm_executor.model.robot_shapes import RobotShapes
from pack_cell.view.banner import Banner, banner_of
from pack_cell.view.happenings import Happenings
from pack_cell.view.live_figures import LiveFigures, SeenBefore
from pack_cell.watching.cell_watch import CellWatch
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.codes import BoxEventKind, Mode, PlacementStatus
from pack_msgs_py.geometry.pose import metres
from pack_msgs_py.values import Bin

#: Frame of the pad's face, to which a box in the gripper is fixed.
PAD_FRAME = 'tcp'


@dataclass
class CellView:
    """Feeds on what the nodes say, beside ``watch``, which knows the state of the cell.

    ``belt_end_m`` and ``belt_low_m`` are how far (y) and how low (z, frame `cell`) boxes ride.
    ``scene_changes`` and ``text_changes`` count what could be drawn or written anew.
    """

    watch: CellWatch
    domain: int = 0
    robot: RobotShapes | None = None
    scan: Scan | None = None
    bins: tuple[Bin, ...] = ()
    joints: dict[str, float] = field(default_factory=dict)
    held: BoxOnPad | None = None
    last_placed: str = ''
    decision: Decision | None = None
    last_closing: ClosingReason | None = None
    belt_end_m: float = -math.inf
    belt_low_m: float = math.inf
    figures: LiveFigures = field(default_factory=LiveFigures)
    happenings: Happenings = field(default_factory=Happenings)
    scene_changes: int = 0
    text_changes: int = 0

    def __post_init__(self) -> None:
        self._seen = SeenBefore()
        self._carried: Decision | None = None

    # -- what is heard ---------------------------------------------------------------------------

    def on_robot(self, robot: RobotShapes) -> None:
        """The arm looks like this."""
        self.robot = robot
        self.scene_changes += 1

    def on_scan(self, scan: Scan) -> None:
        """The belt is now like this."""
        self.scan = scan
        self.watch.on_scan(len(scan.boxes), scan.remaining)
        for scanned in scan.boxes:
            (_, y, z), half = scanned.pose.position, metres(scanned.box.size_mm)[2] / 2
            self.belt_end_m = max(self.belt_end_m, math.ceil(2 * y + 0.5) / 2)
            self.belt_low_m = min(self.belt_low_m, round(z - half, 1))
        self._changed()

    def on_bins(self, snapshot: BinSnapshot) -> None:
        """These bins may be filled; one that was there and was not closed is held and stays."""
        stations = {standing.station for standing in snapshot.bins}
        held = [known for known in self.bins if known.station not in stations]
        self.bins = tuple(sorted((*snapshot.bins, *held), key=lambda standing: standing.serial))
        self._changed()

    def on_closed(self, closed: Bin) -> None:
        """A bin was taken away."""
        self.bins = tuple(known for known in self.bins if known.id != closed.id)
        self.figures.add_closed(closed)
        self.text_changes += 1

    def on_closing(self, reason: ClosingReason) -> None:
        """Why a bin is taken away."""
        self.last_closing = reason
        self.text_changes += 1

    def on_decision(self, decision: Decision) -> None:
        """The planner has decided."""
        if self._seen(('decision', decision.box.id, decision.sequence, decision.stamp_s)):
            return
        self.figures.add_decision(decision)
        self.decision = decision
        self._changed()

    def on_report(self, report: Report) -> None:
        """A goal has ended."""
        if self._seen(('report', report.goal_id)):
            return
        self.figures.add_report(report)
        self.happenings.add_report(report)
        self._changed()

    def on_event(self, event: BoxEvent) -> None:
        """Something happened to a box."""
        if self._seen(('event', event.box_id, event.event, event.stamp_s)):
            return
        self.figures.add_event(event)
        self.happenings.add_event(event)
        if event.event is BoxEventKind.PICKED:
            self._pick(event.box_id)
        elif self._carried is not None and self._carried.box.id == event.box_id:
            self._carried = None
        if event.event is not BoxEventKind.PICKED:
            if self.held is not None and self.held.box.id == event.box_id:
                self.held = None
            if self.decision is not None and self.decision.box.id == event.box_id:
                self.decision = None
        if event.event is BoxEventKind.PLACED:
            self.last_placed = event.box_id
        self._changed()

    def on_joints(self, positions: Mapping[str, float]) -> None:
        """The joints are there: radians, and metres along the rail."""
        self.joints.update((name, at) for name, at in positions.items() if math.isfinite(at))

    # -- what is shown ---------------------------------------------------------------------------

    @property
    def planned(self) -> tuple[Decision, ...]:
        """Placements that are still to come: the one under way, and the next."""
        both = (self._carried, self.decision)
        known = {one.box.id: one for one in both if one is not None}
        return tuple(one for one in known.values() if one.status is not PlacementStatus.REJECT)

    @property
    def fill_now(self) -> float | None:
        """Fill of the open bins together, 0 to 1; ``None`` while none is known."""
        room = sum(math.prod(standing.spec.size_mm) for standing in self.bins)
        if not room:
            return None
        return sum(one.fill_rate * math.prod(one.spec.size_mm) for one in self.bins) / room

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """What stands and waits for a person, alarms first."""
        return self.watch.alarms

    @property
    def is_stopped(self) -> bool:
        """Whether the arm waits for a reset."""
        return self.watch.mode is Mode.PROTECTIVE_STOP

    @property
    def is_paused(self) -> bool:
        """Whether a person has paused arm or belt."""
        return self.watch.paused or self.watch.belt_condition == 'paused'

    def banner(self) -> Banner:
        """State and next action at this moment."""
        return banner_of(self.watch.state(), self._doing(), self.domain)

    def _doing(self) -> str:
        active = self.watch.active_box
        if not active:
            return 'Choosing the next box'
        under_way = next((one for one in self.planned if one.box.id == active), None)
        return f'Packing {active}' + (f' into {under_way.bin_id}' if under_way else '')

    def _pick(self, box_id: str) -> None:
        if self.decision is not None and self.decision.box.id == box_id:
            self._carried = self.decision
        scanned = None if self.scan is None else self.scan.find(box_id)
        if scanned is not None and self.robot is not None and self.joints:
            self.held = held_by_pad(scanned, self.robot.turn_of(PAD_FRAME, self.joints))

    def _changed(self) -> None:
        self.scene_changes += 1
        self.text_changes += 1
