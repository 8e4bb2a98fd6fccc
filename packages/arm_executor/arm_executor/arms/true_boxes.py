"""What the boxes really are, for the simulated world alone: a real arm meets them anyway.

The conveyor tells it on `true_boxes`: the boxes on the belt with their true size, weight and pose.
The planner, the rules and the book of bins know a box only as it was scanned.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from arm_executor.model.arm_interface import PlaceRequest
from pack_msgs_py.box_codec import box_from_data, box_to_data, pose_from_data, pose_to_data
from pack_msgs_py.geometry.pose import Pose, conjugate, quaternion_product, rotated, upright_axis
from pack_msgs_py.picking import lies_as
from pack_msgs_py.values import Box

FILE_NAME = 'true_boxes.json'

#: The gripper notices a box that weighs so much more or less than it should, share and kilograms.
WEIGHT_SHARE, WEIGHT_KG = 0.15, 0.15
#: The light curtain over the pick point notices an edge that is so far off, millimetres, and so
#: many standard deviations of the scanner.
EDGE_MM, EDGE_SIGMAS = 15.0, 6.0
#: So long the list of true boxes may come behind the scan, seconds.
_NEWS_S = 1.0


@dataclass(frozen=True)
class TrueBox:
    """A box as it is, and where its centre is once it stands at the pick point, frame `cell`."""

    box: Box
    pose: Pose


class Truth:
    """True boxes by id: those on the belt as told last, and those that the arm has picked.

    Safe to use from any thread. ``folder`` keeps the picked ones for the next start; empty for
    memory only.
    """

    def __init__(self, folder: str | Path = '') -> None:
        self._path = Path(folder).expanduser() / FILE_NAME if str(folder) else None
        self._lock = threading.Condition()
        self._on_belt: dict[str, TrueBox] = {}
        self._picked: dict[str, TrueBox] = {}
        if self._path is not None and self._path.exists():
            self._picked = {true.box.id: true for true in _read(self._path)}

    def update(self, boxes: Iterable[TrueBox]) -> None:
        """These are on the belt now."""
        with self._lock:
            self._on_belt = {true.box.id: true for true in boxes}
            self._lock.notify_all()

    def find(self, box_id: str) -> TrueBox | None:
        """The box called ``box_id``: as it is on the belt, else as it was picked."""
        with self._lock:
            return self._on_belt.get(box_id) or self._picked.get(box_id)

    def lying(self, box_id: str, pick: Pose) -> TrueBox | None:
        """As :meth:`find`, once that has the face up which is up at ``pick``; else after a second.

        The scan that shows a box on the tray and the list of true boxes are two messages.
        """
        with self._lock:
            self._lock.wait_for(lambda: self._lies(box_id, pick), _NEWS_S)
        return self.find(box_id)

    def _lies(self, box_id: str, pick: Pose) -> bool:
        true = self._on_belt.get(box_id)
        return true is None or lies_as(true.pose, pick)

    def box(self, scanned: Box) -> Box:
        """The true box behind ``scanned``; that itself when nothing else is known."""
        true = self.find(scanned.id)
        return scanned if true is None else true.box

    def picked(self, box_id: str) -> None:
        """The arm has this box now: remember it when it is no longer on the belt."""
        with self._lock:
            true = self._on_belt.get(box_id)
            if true is not None:
                self._picked[box_id] = true
                self._save()

    def keep(self, box_ids: Collection[str]) -> None:
        """Only these are still in bins: forget what else was picked."""
        with self._lock:
            gone = [box_id for box_id in self._picked if box_id not in box_ids]
            for box_id in gone:
                del self._picked[box_id]
            if gone:
                self._save()

    def _save(self) -> None:
        if self._path is None:
            return
        draft = self._path.with_suffix('.new')
        rows = [
            {'box': box_to_data(true.box), 'pose': pose_to_data(true.pose)}
            for true in self._picked.values()
        ]
        draft.write_text(json.dumps(rows), encoding='utf-8')
        os.replace(draft, self._path)


def _read(path: Path) -> list[TrueBox]:
    try:
        rows = json.loads(path.read_text(encoding='utf-8'))
        return [TrueBox(box_from_data(row['box']), pose_from_data(row['pose'])) for row in rows]
    except (ValueError, KeyError, TypeError) as error:
        msg = f'{path} cannot be used: {error}; move the file away, and boxes are as scanned'
        raise ValueError(msg) from error


def mismatch(scanned: Box, true: Box) -> str:
    """What the gripper's scale and the light curtain have against a box; empty when it is right."""
    off_kg = abs(true.weight_kg - scanned.weight_kg)
    if off_kg > WEIGHT_KG + WEIGHT_SHARE * scanned.weight_kg:
        return (
            f'box {scanned.id!r} weighs {true.weight_kg:.2f} kg in the gripper, '
            f'the scan says {scanned.weight_kg:.2f} kg'
        )
    for axis, edge, seen, sigma in zip(
        'xyz', true.size_mm, scanned.size_mm, scanned.size_stddev_mm, strict=True
    ):
        if abs(edge - seen) > EDGE_MM + EDGE_SIGMAS * sigma:
            return (
                f'box {scanned.id!r} measures {edge:.0f} mm along {axis} in the gripper, '
                f'the scan says {seen:.0f} mm'
            )
    return ''


def missed_by_pad(pick: Pose, true: TrueBox) -> bool:
    """Whether a pad in the middle of the box as it was scanned finds no box below it."""
    (px, py, _), (x, y, _), lies = pick.position, true.pose.position, true.pose.quaternion
    aside = rotated(conjugate(lies), (px - x, py - y, 0.0))
    up = upright_axis(lies)
    return any(
        abs(way) > edge / 2e3
        for axis, (way, edge) in enumerate(zip(aside, true.box.size_mm, strict=True))
        if axis != up
    )


def true_rest(request: PlaceRequest, true: TrueBox) -> Pose:
    """Where the true centre comes to rest when the arm does exactly as planned, bin frame.

    The pad took the box beside its true centre and turned as it lay; its base is where it should
    be, since the arm moves the base that it saw on the belt.
    """
    turn = quaternion_product(request.target.quaternion, conjugate(request.pick.quaternion))
    aside = tuple(a - b for a, b in zip(true.pose.position, request.pick.position, strict=True))
    x, y, _ = rotated(turn, (aside[0], aside[1], 0.0))
    tx, ty, tz = request.target.position
    up = upright_axis(request.pick.quaternion)
    higher = (true.box.size_mm[up] - request.box.size_mm[up]) / 2e3
    return Pose((tx + x, ty + y, tz + higher), quaternion_product(turn, true.pose.quaternion))
