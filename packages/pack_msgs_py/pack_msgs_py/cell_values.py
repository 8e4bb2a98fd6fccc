"""Values that travel between the nodes: scans, decisions, events, reports.

Each mirrors one message of pack_msgs. Lengths are millimetres like everywhere in the core; poses
hold metres and unit quaternions, since they go to the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from pack_msgs_py.codes import BoxEventKind, ErrorCode, PlacementStatus, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, Int3, Vec3

#: What a motion that is planned counts where the clock does not, seconds: its usual time, for the
#: planner that asks about it and for the arm that carries it out.
MOTION_PLAN_S = 0.03


@dataclass(frozen=True)
class ScannedBox:
    """One box on offer; see pack_msgs/ScannedBox.

    ``pick_open_s`` is ``None`` while the box is not at the pick point.
    """

    box: Box
    pose: Pose
    pick_open_s: float | None = None
    pick_close_s: float | None = None
    travel_time_s: float = 0.0
    laps: int = 0


@dataclass(frozen=True)
class Scan:
    """A full snapshot of the look-ahead, nearest box first; see pack_msgs/BoxScan."""

    sequence: int
    stamp_s: float
    boxes: tuple[ScannedBox, ...] = ()
    frame_id: str = 'cell'
    belt_velocity: Vec3 = (0.0, 0.0, 0.0)
    supplied: int = 0
    remaining: int = 0

    def find(self, box_id: str) -> ScannedBox | None:
        """The box called ``box_id``, if it is in the look-ahead."""
        return next((scanned for scanned in self.boxes if scanned.box.id == box_id), None)


@dataclass(frozen=True)
class BinSnapshot:
    """Every bin that stands in the cell, oldest first; see pack_msgs/BinStateArray."""

    revision: int
    stamp_s: float
    bins: tuple[Bin, ...]


@dataclass(frozen=True)
class RunnerUp:
    """A placement that a decision was preferred to; see pack_msgs/RunnerUp.

    ``refusal`` is why the arm would not do it, ``NONE`` when it merely comes after the decision.
    """

    box_id: str
    bin_id: str
    corner_mm: Int3 = (0, 0, 0)
    objective: float = 0.0
    refusal: ErrorCode = ErrorCode.NONE


#: Runners-up that a decision names.
MOST_RUNNERS_UP = 6


@dataclass(frozen=True)
class Decision:
    """One decision of the planner; see pack_msgs/PlacementDecision.

    ``bin_id`` is empty when ``status`` is ``REJECT``. ``target`` is where the box's centre is to
    come to rest, in the bin frame. The last fields say what the arm answered before: how many
    candidates it looked at, in what time, what it said of the planner's first choice, and what the
    decision was preferred to.
    """

    box: Box
    bin_id: str = ''
    bin_serial: int = 0
    bin_revision: int = 0
    orientation: str = 'xyz'
    corner_mm: Int3 = (0, 0, 0)
    size_mm: Int3 = (0, 0, 0)
    target: Pose = field(default_factory=Pose)
    objective: float = 0.0
    algorithm: str = ''
    profile: str = ''
    status: PlacementStatus = PlacementStatus.OPTIMAL
    planning_s: float = 0.0
    sequence: int = 0
    scan_sequence: int = 0
    stamp_s: float = 0.0
    trigger_stamp_s: float = 0.0
    reason: str = ''
    reject_reason: Reason = Reason.NONE
    candidates_checked: int = 0
    check_s: float = 0.0
    first_objective: float = 0.0
    first_refusal: ErrorCode = ErrorCode.NONE
    runners_up: tuple[RunnerUp, ...] = ()

    @property
    def is_upright(self) -> bool:
        """Whether the box keeps the top up that it has on the belt."""
        return self.orientation[2] == 'z'


@dataclass(frozen=True)
class BoxEvent:
    """Something that happened to one box; see pack_msgs/BoxEvent."""

    box_id: str
    event: BoxEventKind
    reason: Reason = Reason.NONE
    text: str = ''
    bin_id: str = ''
    bin_serial: int = 0
    stamp_s: float = 0.0


@dataclass(frozen=True)
class Report:
    """Outcome of one placement goal; see pack_msgs/PlacementReport. Seconds and metres.

    ``attributes`` are the ``extra`` of its box.
    """

    box_id: str
    bin_id: str = ''
    bin_serial: int = 0
    bin_revision: int = 0
    code: ErrorCode = ErrorCode.NONE
    message: str = ''
    commanded: Pose = field(default_factory=Pose)
    measured: Pose | None = None
    position_error_m: float = 0.0
    angle_error_rad: float = 0.0
    others_moved_m: float = 0.0
    planning_s: float = 0.0
    wait_s: float = 0.0
    motion_s: float = 0.0
    cycle_s: float = 0.0
    slack_s: float = 0.0
    goal_id: bytes = bytes(16)
    stamp_s: float = 0.0
    attributes: tuple[tuple[str, str], ...] = ()
