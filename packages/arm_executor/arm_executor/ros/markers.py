"""The cell as markers: bins, belt, boxes in bins, on the belt and in the gripper (imports ROS)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from arm_executor.bins.book import BookState
from arm_executor.model.colours import BELT, PALLET, STEEL, WALL, Colour, carton
from arm_executor.model.kinematics import quaternions_of
from arm_executor.model.layout import Block, Layout, bin_blocks, conveyor_block, rail_block
from arm_executor.model.tree import ROOT, Joint
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose, rotation_matrix
from pack_msgs_py.values import Box, Vec3, frame_name

Array = NDArray[np.float64]
#: Walls can be seen through.
_WALL: Colour = (*WALL[:3], 0.25)


@dataclass(frozen=True)
class HeldBoxMarker:
    """A box in the gripper, and its centre in frame `tcp`."""

    box: Box
    pose: Pose


@dataclass
class Scene:
    """What there is to show. ``tree`` is empty when there is no robot."""

    layout: Layout
    tree: Sequence[Joint] = ()
    bins: BookState = field(default_factory=lambda: BookState(0))
    scan: Scan | None = None
    held: HeldBoxMarker | None = None

    def pick(self, box_id: str, positions: Sequence[float]) -> None:
        """The box called ``box_id`` is in the gripper of the arm at ``positions`` (7,)."""
        scanned = None if self.scan is None else self.scan.find(box_id)
        self.held = None
        if scanned is not None and self.tree and positions:
            turn = pad_turn(self.tree, positions)
            self.held = HeldBoxMarker(scanned.box, _on_pad(scanned.box, scanned.pose, turn))


def pad_turn(tree: Sequence[Joint], positions: Sequence[float]) -> Array:
    """Rotation (3, 3) of the pad in `cell`."""
    turn = np.eye(3)
    for joint in tree:
        turn = turn @ np.array(rotation_matrix(joint.transform(positions).quaternion))
    return turn


def _on_pad(box: Box, pose: Pose, pad: Array) -> Pose:
    """Centre of ``box`` in frame `tcp`: square to the pad, the face that was taken on the pad."""
    relative = pad.T @ np.array(rotation_matrix(pose.quaternion))
    # The arm has moved on a little since; a box is taken square to the pad.
    columns = np.zeros((3, 3))
    for row in range(2, -1, -1):
        free = np.abs(relative[row]) * (columns.any(axis=0) == 0)
        columns[row, free.argmax()] = np.copysign(1.0, relative[row, free.argmax()])
    if np.linalg.det(columns) < 0:
        columns[0] *= -1
    depth = float(np.abs(columns[2]) @ np.array(box.size_mm)) / 2000
    return Pose((0.0, 0.0, depth), quaternions_of(columns[None])[0])


def markers(scene: Scene, stamp: object) -> MarkerArray:
    """Everything in ``scene``, in place of all that was shown before."""
    wipe = Marker(action=Marker.DELETEALL)
    wipe.header.frame_id, wipe.header.stamp = ROOT, stamp
    shown = [wipe]
    for name, frame, size, pose, colour in _cubes(scene):
        shown.append(_cube(len(shown), name, frame, size, pose, colour, stamp))
    return MarkerArray(markers=shown)


def _cubes(scene: Scene) -> Iterator[tuple[str, str, Vec3, Pose, Colour]]:
    """Namespace, frame, size, pose and colour of each."""
    for name, block, colour in _blocks(scene):
        yield name, ROOT, block.size, Pose(block.centre), colour
    for bin_ in scene.bins.bins:
        for placed in bin_.boxes:
            pose = scene.bins.poses.get(placed.box.id)
            if pose is not None:
                yield 'boxes', frame_name(bin_.station), *_box(placed.box, pose)
    if scene.held is not None:
        yield 'gripper', 'tcp', *_box(scene.held.box, scene.held.pose)
    for scanned in () if scene.scan is None else scene.scan.boxes:
        if scene.held is None or scanned.box.id != scene.held.box.id:
            yield 'belt', ROOT, *_box(scanned.box, scanned.pose)


def _blocks(scene: Scene) -> Iterator[tuple[str, Block, Colour]]:
    yield 'cell', conveyor_block(scene.layout), BELT
    yield 'cell', rail_block(scene.layout), STEEL
    for bin_ in scene.bins.bins:
        for block in bin_blocks(scene.layout, bin_.station, bin_.spec):
            yield 'bins', block, PALLET if block.name.endswith('floor') else _WALL


def _box(box: Box, pose: Pose) -> tuple[Vec3, Pose, Colour]:
    x, y, z = (edge / 1000 for edge in box.size_mm)
    return (x, y, z), pose, carton(box.id)


def _cube(
    number: int, name: str, frame: str, size: Vec3, pose: Pose, colour: Colour, stamp: object
) -> Marker:
    msg = Marker(ns=name, id=number, type=Marker.CUBE, action=Marker.ADD, frame_locked=True)
    msg.header.frame_id, msg.header.stamp = frame, stamp
    where, turn = msg.pose.position, msg.pose.orientation
    where.x, where.y, where.z = pose.position
    turn.x, turn.y, turn.z, turn.w = pose.quaternion
    msg.scale.x, msg.scale.y, msg.scale.z = size
    msg.color.r, msg.color.g, msg.color.b, msg.color.a = colour
    return msg
