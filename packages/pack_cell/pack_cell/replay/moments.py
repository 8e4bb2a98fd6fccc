"""Where everything is at a moment of a recorded run, between what was said of it; metres."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.rotations import quaternions_of
from pack_cell.replay.timeline import Timeline
from pack_msgs_py.geometry.pose import Pose, rotation_matrix
from pack_msgs_py.values import STATIONS, Vec3, frame_name

Array = NDArray[np.float64]
#: The pad's pose (4, 4) in frame `cell` with the joints at these positions.
PadAt = Callable[[Mapping[str, float]], Array]

#: Between two scans further apart than this a box is not moved, seconds.
_LONGEST_BETWEEN_S = 1.5
#: A box that never came nearer to its place than this was not let go there, metres.
_NEVER_THERE = 0.25


@dataclass(frozen=True)
class SeenBox:
    """A box at a moment: its edges, and the pose of its centre (4, 4) in frame `cell`."""

    box_id: str
    size: Vec3
    pose: Array


@dataclass
class Carry:
    """A box on its way: from the grasp until it was measured.

    ``grip`` is its pose on the pad, ``target`` that of its place in `cell`, each (4, 4), as far as
    they are known; the pad lets go at ``let_go_s``.
    """

    box: int
    from_s: float
    to_s: float
    start: Array | None
    target: Array | None
    target_size: Vec3
    grip: Array | None = None
    let_go_s: float = field(default=0.0)


class Moments:
    """The moments of a run; ``pad_at`` is asked only where the arm has joints."""

    def __init__(self, run: Timeline, pad_at: PadAt | None) -> None:
        self.run = run
        self._names = list(run.boxes)
        self._rows = list(run.boxes.values())
        self._joints = np.array(run.joints) if run.joints else None
        self._pad_at = pad_at if run.joints else None
        self._stations = {
            station: matrix_of(run.frames[frame_name(station)])
            for station in STATIONS
            if frame_name(station) in run.frames
        }
        self._carries = [self._carry(*row) for row in run.held]

    def joints(self, now_s: float) -> dict[str, float]:
        """Positions by the names of the joints; empty for an arm without any."""
        if self._joints is None:
            return {}
        values = [np.interp(now_s, self.run.joint_times, column) for column in self._joints.T]
        return dict(zip(self.run.joint_names, map(float, values), strict=True))

    def standing(self, now_s: float) -> list[Mapping[str, Any]]:
        """The bins that stand there; a closed one until the next stands in its place."""
        at = {of_run['station']: of_run for of_run in self.run.bins.values()
              if of_run['opened'] <= now_s}  # fmt: skip
        return list(at.values())

    def station(self, name: str) -> Array:
        """Frame of the bin at a station (4, 4) in `cell`."""
        return self._stations.get(name, np.eye(4))

    def boxes(self, now_s: float) -> list[SeenBox]:
        """Every box that is to be seen."""
        seen: dict[int, SeenBox] = {}
        for of_run in self.standing(now_s):
            frame = self.station(of_run['station'])
            for box, row in content(of_run, now_s).items():
                x, y, z, *size = (value / 1000 for value in row)
                pose = frame @ matrix_of(Pose((x, y, z)))
                seen[box] = SeenBox(self._names[box], _three(size), pose)
        for carry in self._carries:
            if carry.from_s <= now_s < carry.to_s and carry.box not in seen:
                carried = self._carried(carry, now_s)
                if carried is not None:
                    seen[carry.box] = carried
        for box, pose in self._belt(now_s).items():
            seen.setdefault(box, SeenBox(self._names[box], self._size(box), pose))
        return list(seen.values())

    # -- the belt --------------------------------------------------------------------------------

    def _belt(self, now_s: float) -> dict[int, Array]:
        rows = self.run.belt
        index = bisect_right(rows, now_s, key=lambda row: row[0]) - 1
        if index < 0:
            return {}
        from_s, before = rows[index]
        poses = {row[0]: _belt_pose(row) for row in before}
        if index + 1 == len(rows) or not 0 < rows[index + 1][0] - from_s < _LONGEST_BETWEEN_S:
            return poses
        until_s, after = rows[index + 1]
        share = (now_s - from_s) / (until_s - from_s)
        for row in after:
            if row[0] in poses:
                there = poses[row[0]]
                there[:3, 3] += share * (_belt_pose(row)[:3, 3] - there[:3, 3])
        return poses

    def _last_on_belt(self, box: int, now_s: float) -> Array | None:
        index = bisect_right(self.run.belt, now_s, key=lambda row: row[0])
        for _, rows in reversed(self.run.belt[:index]):
            for row in rows:
                if row[0] == box:
                    return _belt_pose(row)
        return None

    # -- in the gripper --------------------------------------------------------------------------

    def _carry(self, from_s: float, to_s: float | None, box: int) -> Carry:
        to_s = self.run.end_s if to_s is None else to_s
        carry = Carry(box, from_s, to_s, self._last_on_belt(box, from_s), None, self._size(box))
        made = [
            each for each in self.run.decisions
            if each['box'] == box and not each['rejected'] and each['t'] <= to_s
        ]  # fmt: skip
        if made and made[-1]['bin'] in self.run.bins:
            of_run = self.run.bins[made[-1]['bin']]
            x, y, z = (value / 1000 for value in made[-1]['at'])
            carry.target = self.station(of_run['station']) @ matrix_of(Pose((x, y, z)))
            carry.target_size = _three([edge / 1000 for edge in made[-1]['size']])
        carry.let_go_s = to_s
        if self._pad_at is not None and carry.start is not None:
            pad = self._pad_at(self.joints(from_s))
            carry.grip = _on_pad(pad, carry.start, self._size(box))
            carry.let_go_s = self._let_go_s(carry, self._pad_at)
        return carry

    def _let_go_s(self, carry: Carry, pad_at: PadAt) -> float:
        """When the held box is nearest to its place: no message says when the pad lets go."""
        if carry.target is None or carry.grip is None:
            return carry.to_s
        nearest, let_go_s = np.inf, carry.to_s
        for time_s in self.run.joint_times:
            if carry.from_s <= time_s <= carry.to_s:
                held = pad_at(self.joints(time_s)) @ carry.grip
                away = float(np.linalg.norm(held[:3, 3] - carry.target[:3, 3]))
                if away < nearest + 0.004:
                    nearest, let_go_s = min(away, nearest), time_s
        return let_go_s if nearest < _NEVER_THERE else carry.to_s

    def _carried(self, carry: Carry, now_s: float) -> SeenBox | None:
        box_id = self._names[carry.box]
        if carry.target is not None and now_s > carry.let_go_s:
            return SeenBox(box_id, carry.target_size, carry.target)
        if carry.grip is not None and self._pad_at is not None:
            pose = self._pad_at(self.joints(now_s)) @ carry.grip
            return SeenBox(box_id, self._size(carry.box), pose)
        if carry.start is None or carry.target is None:
            return None
        # An arm that shows no joints: the box flies.
        share = min(1.0, (now_s - carry.from_s) / max(1e-3, carry.to_s - carry.from_s))
        pose = carry.target.copy()
        pose[:3, 3] = (1 - share) * carry.start[:3, 3] + share * carry.target[:3, 3]
        pose[2, 3] += 0.8 * np.sin(np.pi * share)
        return SeenBox(box_id, carry.target_size, pose)

    def _size(self, box: int) -> Vec3:
        return _three([edge / 1000 for edge in self._rows[box]['size']])


def content(of_run: Mapping[str, Any], now_s: float) -> dict[int, list[float]]:
    """Centre and edges, millimetres, of each box that is in a bin by ``now_s``."""
    places: dict[int, list[float]] = {}
    for time_s, box, *row in of_run['put']:
        if time_s > now_s:
            break
        places.pop(box, None)
        if row[0] is not None:
            places[box] = row
    return places


def matrix_of(pose: Pose) -> Array:
    """``pose`` as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(pose.quaternion)
    matrix[:3, 3] = pose.position
    return matrix


def pose_of(matrix: Array) -> Pose:
    """Inverse of :func:`matrix_of`."""
    x, y, z = matrix[:3, 3].tolist()
    return Pose((x, y, z), quaternions_of(matrix[None, :3, :3])[0])


def _belt_pose(row: Sequence[float]) -> Array:
    _, x, y, z, qx, qy, qz, qw, *_ = row
    return matrix_of(Pose((x / 1000, y / 1000, z / 1000), (qx, qy, qz, qw)))


def _on_pad(pad: Array, box: Array, size: Vec3) -> Array:
    """Pose (4, 4) of a box on the pad: square to it, the face that was taken on the pad."""
    relative = (np.linalg.inv(pad) @ box)[:3, :3]
    turn = np.zeros((3, 3))
    for row in (2, 1, 0):
        free = np.abs(relative[row]) * (np.abs(turn).sum(axis=0) == 0)
        best = int(free.argmax())
        turn[row, best] = np.copysign(1.0, relative[row, best])
    grip = np.eye(4)
    grip[:3, :3] = turn
    grip[2, 3] = float(np.abs(turn[2]) @ np.array(size)) / 2
    return grip


def _three(values: Sequence[float]) -> Vec3:
    x, y, z = values
    return (x, y, z)
