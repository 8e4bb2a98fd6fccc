"""A small cell as its topics tell it, for tests of the live page."""

from __future__ import annotations

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import ROBOTS
from arm_executor.model.robot_shapes import read_urdf
from arm_executor.model.urdf import cell_urdf
from pack_cell.view.cell_view import CellView
from pack_cell.watching.cell_watch import NODES, CellWatch
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Level, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('<b>small & brown</b>', (300.0, 200.0, 100.0), 2.5)
PLACED = PlacedBox(BOX, (0, 0, 0), (310, 210, 110), 'xyz', (155.0, 105.0, 50.0))


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def urdf() -> str:
    return cell_urdf(ROBOTS['ur20'], Layout(), described=True)


def new_view(clock: Clock | None = None) -> CellView:
    """A page that has heard of the robot, and of three nodes that wait for boxes."""
    watch = CellWatch(clock or Clock())
    view = CellView(watch)
    view.on_robot(read_urdf(urdf()))
    beat(view, Mode.IDLE)
    watch.on_scan(0, 5)
    for node in NODES:
        watch.on_diagnostics(node, Level.OK, '', {'belt': 'running'})
    return view


def beat(view: CellView, mode: Mode, active: str = '', message: str = '') -> None:
    """The arm's heartbeat."""
    view.watch.on_heartbeat(mode, active, message)


def box(number: int) -> Box:
    return Box(f'box-{number}', (300.0, 200.0, 100.0), 2.0)


def scan_of(*boxes: Box, laps: int = 0, remaining: int = 5) -> Scan:
    return Scan(
        1,
        1.0,
        tuple(
            ScannedBox(one, Pose((0.0, 0.65 + 0.6 * index, 0.8)), laps=laps)
            for index, one in enumerate(boxes)
        ),
        supplied=len(boxes),
        remaining=remaining,
    )


def bins_of(*placed: PlacedBox, station: str = 'A') -> BinSnapshot:
    return BinSnapshot(1, 1.0, (Bin('LDC-1', 1, parse_bin('LDC'), placed, station, len(placed)),))


def decision_for(one: Box, **more: object) -> Decision:
    values: dict[str, object] = {
        'bin_id': 'LDC-1',
        'bin_serial': 1,
        'size_mm': (310, 210, 110),
        'target': Pose((0.155, 0.105, 0.05)),
        'stamp_s': 2.0,
        'planning_s': 0.05,
        'algorithm': 'rollout',
        'profile': 'cell',
    }
    return Decision(one, **{**values, **more})  # type: ignore[arg-type]


def report_for(one: Box, code: ErrorCode = ErrorCode.NONE, slack_s: float = 1.5) -> Report:
    return Report(
        one.id, 'LDC-1', 1, 0, code, cycle_s=4.0, slack_s=slack_s, goal_id=one.id.encode()[:16]
    )


def event_for(one: Box, kind: BoxEventKind, stamp_s: float = 3.0, **more: object) -> BoxEvent:
    return BoxEvent(one.id, kind, stamp_s=stamp_s, **more)  # type: ignore[arg-type]
