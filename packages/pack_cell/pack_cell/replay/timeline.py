"""A recorded run as data for a page: what stood where, and when; robot time in seconds.

Lengths in the bins and on the belt are millimetres, of the robot metres.
"""

from __future__ import annotations

import base64
import contextlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from arm_executor.model.colours import carton
from arm_executor.model.robot_shapes import RobotShapes, read_urdf
from pack_cell.recording.heard import (
    ArmMode,
    FixedFrame,
    Heard,
    JointPositions,
    RobotText,
)
from pack_cell.view.plain_words import ENDINGS, runner_up_lines
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.codes import BoxEventKind, ErrorCode, PlacementStatus
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import oriented_size, way_up
from pack_msgs_py.values import STATIONS, Bin, Box, PlacedBox, frame_name

#: Between two positions of the joints that differ by less nothing has moved, metres and radians.
_STILL = 1e-4
#: A box in a bin that is measured anew within this is where it was, millimetres.
_SAME_PLACE_MM = 1.0
#: What else there was that is told of a decision.
_OTHERS = 4
#: Events at which a box is in the gripper no more.
_LET_GO = (BoxEventKind.PLACED, BoxEventKind.RETURNED, BoxEventKind.LOST, BoxEventKind.REJECTED)


@dataclass
class Timeline:
    """Feeds on what was heard, in its order; :meth:`data` is what a page shows."""

    boxes: dict[str, dict[str, Any]] = field(default_factory=dict)
    robot: RobotShapes | None = None
    urdf: str = ''
    frames: dict[str, Pose] = field(default_factory=dict)
    joint_names: tuple[str, ...] = ()
    joint_times: list[float] = field(default_factory=list)
    joints: list[tuple[float, ...]] = field(default_factory=list)
    belt: list[list[Any]] = field(default_factory=list)
    bins: dict[str, dict[str, Any]] = field(default_factory=dict)
    held: list[list[Any]] = field(default_factory=list)
    decisions: list[dict[str, Any]] = field(default_factory=list)
    modes: list[list[Any]] = field(default_factory=list)
    notes: list[list[Any]] = field(default_factory=list)
    end_s: float = 0.0
    _numbers: dict[str, int] = field(default_factory=dict)
    _where: dict[str, dict[str, tuple[float, ...]]] = field(default_factory=dict)
    _told: set[Any] = field(default_factory=set)
    _arm_moves: bool = False
    _joints_heard_s: float = 0.0

    def add(self, heard: Heard) -> None:
        """One message."""
        now_s, value = round(heard.robot_s, 3), heard.value
        self.end_s = max(self.end_s, now_s)
        match value:
            case Scan():
                self._scan(now_s, value)
            case BinSnapshot():
                self._snapshot(now_s, value)
            case Bin():
                self._closed(now_s, value)
            case ClosingReason():
                self._note(now_s, f'bin {value.bin_id} is closed: {value.text}')
            case Decision():
                self._decision(now_s, value)
            case Report():
                self._report(now_s, value)
            case BoxEvent():
                self._event(now_s, value)
            case ArmMode():
                said = [value.mode.name, value.message]
                if not self.modes or self.modes[-1][1:] != said:
                    self.modes.append([now_s, *said])
            case JointPositions():
                self._joints(now_s, value)
            case RobotText():
                with contextlib.suppress(ValueError):
                    self.robot, self.urdf = read_urdf(value.urdf), value.urdf
            case FixedFrame():
                self.frames[value.name] = value.pose

    def data(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        stations = {
            station: _pose_row(self.frames[frame_name(station)])
            for station in STATIONS
            if frame_name(station) in self.frames
        }
        return {
            'end': self.end_s,
            'boxes': list(self.boxes.values()),
            'robot': _robot_data(self.robot) if self.robot and self.joints else None,
            'stations': stations,
            'belt_head': _pose_row(self.frames['belt']) if 'belt' in self.frames else None,
            'joint_names': self.joint_names,
            'joint_times': _packed(self.joint_times),
            'joints': _packed([value for row in self.joints for value in row]),
            'belt': self.belt,
            'bins': list(self.bins.values()),
            'held': self.held,
            'decisions': self.decisions,
            'modes': self.modes,
            'notes': self.notes,
        }

    # -- one kind of message each ----------------------------------------------------------------

    def _scan(self, now_s: float, scan: Scan) -> None:
        rows = [
            [self._number(item.box), *_pose_row(item.pose, 1000.0), item.laps]
            for item in scan.boxes
        ]
        if not self.belt or self.belt[-1][1] != rows:
            self.belt.append([now_s, rows])

    def _snapshot(self, now_s: float, snapshot: BinSnapshot) -> None:
        for content in snapshot.bins:
            self._content(now_s, content)

    def _content(self, now_s: float, content: Bin) -> None:
        known = self.bins.get(content.id)
        if known is None:
            known = self.bins[content.id] = {
                'id': content.id,
                'station': content.station,
                'kind': content.spec.name,
                'size': list(content.spec.size_mm),
                'walls': content.spec.walls.value,
                'destination': content.destination,
                'opened': now_s,
                'closed': None,
                'put': [],
            }
            self._where[content.id] = {}
        places = self._where[content.id]
        for placed in content.boxes:
            row = _placed_row(placed)
            before = places.get(placed.box.id)
            if before is not None and _near(before, row):
                continue
            places[placed.box.id] = row
            known['put'].append([now_s, self._number(placed.box), *row])
        gone = places.keys() - {placed.box.id for placed in content.boxes}
        for box_id in gone:
            del places[box_id]
            known['put'].append([now_s, self._numbers[box_id], None])

    def _closed(self, now_s: float, closed: Bin) -> None:
        if closed.id in self.bins and self.bins[closed.id]['closed'] is None:
            self._content(now_s, closed)
            self.bins[closed.id]['closed'] = now_s

    def _decision(self, now_s: float, decision: Decision) -> None:
        if not self._is_news('decision', decision.sequence, decision.box.id, decision.stamp_s):
            return
        size = oriented_size(decision.box.size_mm, decision.orientation)
        x, y, z = (1000.0 * value for value in decision.target.position)
        rejected = decision.status is PlacementStatus.REJECT
        told = {
            't': now_s,
            'box': self._number(decision.box),
            'bin': decision.bin_id,
            'at': [round(v, 1) for v in (x, y, z)],
            'size': [round(v, 1) for v in size],
            'turned': way_up(decision.orientation),
            'corner': list(decision.corner_mm),
            'status': decision.status.name.lower(),
            'rejected': rejected,
            'why': decision.reason,
            'planning_ms': round(1e3 * decision.planning_s, 1),
            'check_ms': round(1e3 * decision.check_s, 1),
            'asked': decision.candidates_checked,
            'first_refusal': ''
            if decision.first_refusal is ErrorCode.NONE
            else ENDINGS[decision.first_refusal],
            'others': runner_up_lines(decision)[:_OTHERS],
        }
        self.decisions.append(told)

    def _report(self, now_s: float, report: Report) -> None:
        if not self._is_news('report', report.goal_id):
            return
        if report.code is not ErrorCode.NONE:
            text = f'{report.code.name.replace("_", " ").lower()}: {report.message}'
            self._note(now_s, f'{report.box_id}: {text}', bad=True)
        for told in reversed(self.decisions):
            if self._numbers.get(report.box_id) == told['box']:
                told['motion_s'] = round(report.motion_s, 2)
                told['slack_s'] = round(report.slack_s, 2)
                told['code'] = report.code.name
                break

    def _event(self, now_s: float, event: BoxEvent) -> None:
        if not self._is_news('event', event.box_id, event.event, event.stamp_s):
            return
        box = self._numbers.get(event.box_id)
        if event.event is BoxEventKind.PICKED and box is not None:
            self.held.append([now_s, None, box])
        elif event.event in _LET_GO:
            for row in reversed(self.held):
                if row[2] == box and row[1] is None:
                    row[1] = now_s
                    break
        if event.event not in (BoxEventKind.PICKED, BoxEventKind.PLACED):
            what = f'{event.event.name.lower()}: {event.text}' if event.text else event.event.name
            self._note(now_s, f'{event.box_id} {what}', bad=True)

    def _joints(self, now_s: float, joints: JointPositions) -> None:
        if self.joint_names and joints.names != self.joint_names:
            return
        self.joint_names = joints.names
        moved = not self.joints or any(
            abs(a - b) > _STILL for a, b in zip(self.joints[-1], joints.positions, strict=True)
        )
        if moved:
            if self.joints and not self._arm_moves:
                # It stood until it was last heard: not on its way since it came there.
                self.joint_times.append(self._joints_heard_s)
                self.joints.append(self.joints[-1])
            self.joint_times.append(now_s)
            self.joints.append(joints.positions)
        self._arm_moves, self._joints_heard_s = moved, now_s

    def _note(self, now_s: float, text: str, *, bad: bool = False) -> None:
        self.notes.append([now_s, text, int(bad)])

    def _is_news(self, *key: object) -> bool:
        """Whether it was not heard before: events are repeated to those who come late."""
        if key in self._told:
            return False
        self._told.add(key)
        return True

    def _number(self, box: Box) -> int:
        """Of the box in ``boxes``."""
        if box.id not in self.boxes:
            self._numbers[box.id] = len(self._numbers)
            red, green, blue, _ = carton(box.id)
            self.boxes[box.id] = {
                'id': box.id,
                'size': [round(edge, 1) for edge in box.size_mm],
                'kg': round(box.weight_kg, 2),
                'to': box.destination,
                'colour': [red, green, blue],
            }
        return self._numbers[box.id]


def timeline(heard: Iterable[Heard]) -> Timeline:
    """A whole recording."""
    made = Timeline()
    for each in heard:
        made.add(each)
    return made


def _placed_row(placed: PlacedBox) -> tuple[float, ...]:
    """Centre and edges of a box in its bin, millimetres."""
    size = oriented_size(placed.box.size_mm, placed.orientation)
    centre = placed.measured_mm or tuple(
        corner + edge / 2 for corner, edge in zip(placed.corner_mm, placed.size_mm, strict=True)
    )
    return tuple(round(value, 1) for value in (*centre, *size))


def _near(before: tuple[float, ...], now: tuple[float, ...]) -> bool:
    return all(abs(a - b) <= _SAME_PLACE_MM for a, b in zip(before, now, strict=True))


def _pose_row(pose: Pose, scale: float = 1.0) -> list[float]:
    """Position and quaternion in one row."""
    position = [round(scale * value, 1 if scale > 1 else 4) for value in pose.position]
    return [*position, *(round(value, 4) for value in pose.quaternion)]


def _packed(values: Sequence[float]) -> str:
    """Numbers as base64 of 32 bit floats: a third of their text."""
    return base64.b64encode(np.asarray(values, dtype='<f4').tobytes()).decode()


def _robot_data(robot: RobotShapes) -> dict[str, Any]:
    """Joints, parents before children, and shapes on links; metres and radians."""
    return {
        'joints': [
            {
                'name': joint.name,
                'kind': joint.kind,
                'parent': joint.parent,
                'child': joint.child,
                'pose': _pose_row(joint.origin),
                'axis': joint.axis,
                'limits': joint.limits,
            }
            for joint in robot.joints
        ],
        'shapes': [
            {
                'link': shape.link,
                'kind': shape.kind,
                'sizes': shape.sizes,
                'pose': _pose_row(shape.pose),
                'colour': shape.colour,
            }
            for shape in robot.shapes
        ],
    }
