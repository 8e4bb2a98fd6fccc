"""The cell as markers: bins, belt, boxes in bins, on the belt and in the gripper (imports ROS)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from arm_executor.bins.book import BookState
from arm_executor.model.box_on_pad import BoxOnPad, held_by_pad
from arm_executor.model.colours import BELT, PALLET, STEEL, WALL, Colour, carton
from arm_executor.model.layout import Block, Layout, bin_blocks, conveyor_block, rail_block
from arm_executor.model.tree import ROOT, Joint
from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.pose import Pose, rotation_matrix
from pack_msgs_py.values import Box, Vec3, frame_name

Array = NDArray[np.float64]
#: Walls can be seen through.
_WALL: Colour = (*WALL[:3], 0.25)


@dataclass
class Scene:
    """What there is to show. ``tree`` is empty when there is no robot."""

    layout: Layout
    tree: Sequence[Joint] = ()
    bins: BookState = field(default_factory=lambda: BookState(0))
    scan: Scan | None = None
    held: BoxOnPad | None = None

    def pick(self, box_id: str, positions: Sequence[float]) -> None:
        """The box called ``box_id`` is in the gripper of the arm at ``positions`` (7,)."""
        scanned = None if self.scan is None else self.scan.find(box_id)
        self.held = None
        if scanned is not None and self.tree and positions:
            self.held = held_by_pad(scanned, pad_turn(self.tree, positions))


def pad_turn(tree: Sequence[Joint], positions: Sequence[float]) -> Array:
    """Rotation (3, 3) of the pad in `cell`."""
    turn = np.eye(3)
    for joint in tree:
        turn = turn @ np.array(rotation_matrix(joint.transform(positions).quaternion))
    return turn


class MarkerNumbers:
    """Gives each thing in a namespace a number that it keeps; numbers that are free come again."""

    def __init__(self) -> None:
        self._numbers: dict[str, dict[str, int]] = {}
        self._most: dict[str, int] = {}

    def number(self, namespace: str, keys: Iterable[str]) -> dict[str, int]:
        """Numbers of all that is in ``namespace`` now, by ``keys``."""
        wanted = list(dict.fromkeys(keys))
        known = self._numbers.get(namespace, {})
        kept = {key: known[key] for key in wanted if key in known}
        free = (number for number in itertools.count() if number not in set(kept.values()))
        numbers = {key: kept[key] if key in kept else next(free) for key in wanted}
        self._numbers[namespace] = numbers
        highest = max(numbers.values(), default=-1) + 1
        self._most[namespace] = max(self._most.get(namespace, 0), highest)
        return numbers

    def free(self) -> Iterator[tuple[str, int]]:
        """Namespace and number of all that was given before and is not now."""
        for namespace, most in self._most.items():
            taken = set(self._numbers[namespace].values())
            yield from ((namespace, number) for number in range(most) if number not in taken)


@dataclass(frozen=True)
class _Cube:
    """One thing to show; ``key`` names it among those of its ``namespace``."""

    namespace: str
    key: str
    frame: str
    size: Vec3
    pose: Pose
    colour: Colour


#: Namespaces of the markers.
NAMESPACES = ('cell', 'bins', 'boxes', 'gripper', 'belt')


def markers(scene: Scene, numbers: MarkerNumbers, stamp: object) -> MarkerArray:
    """Everything in ``scene``, under the ids it had before, and the end of all that is gone.

    Each message says all, so that it does not matter which ones a viewer has missed.
    """
    cubes = list(_cubes(scene))
    shown = []
    for namespace in NAMESPACES:
        here = [cube for cube in cubes if cube.namespace == namespace]
        ids = numbers.number(namespace, (cube.key for cube in here))
        shown += [_cube(ids[cube.key], cube, stamp) for cube in here]
    for namespace, number in numbers.free():
        gone = Marker(ns=namespace, id=number, action=Marker.DELETE)
        gone.header.frame_id, gone.header.stamp = ROOT, stamp
        shown.append(gone)
    return MarkerArray(markers=shown)


def _cubes(scene: Scene) -> Iterator[_Cube]:
    for name, block, colour in _blocks(scene):
        yield _Cube(name, block.name, ROOT, block.size, Pose(block.centre), colour)
    for bin_ in scene.bins.bins:
        for placed in bin_.boxes:
            pose = scene.bins.poses.get(placed.box.id)
            if pose is not None:
                frame = frame_name(bin_.station)
                yield _Cube('boxes', placed.box.id, frame, *_box(placed.box, pose))
    if scene.held is not None:
        yield _Cube('gripper', 'held', 'tcp', *_box(scene.held.box, scene.held.pose))
    for scanned in () if scene.scan is None else scene.scan.boxes:
        if scene.held is None or scanned.box.id != scene.held.box.id:
            yield _Cube('belt', scanned.box.id, ROOT, *_box(scanned.box, scanned.pose))


def _blocks(scene: Scene) -> Iterator[tuple[str, Block, Colour]]:
    yield 'cell', conveyor_block(scene.layout), BELT
    yield 'cell', rail_block(scene.layout), STEEL
    for bin_ in scene.bins.bins:
        for block in bin_blocks(scene.layout, bin_.station, bin_.spec):
            yield 'bins', block, PALLET if block.name.endswith('floor') else _WALL


def _box(box: Box, pose: Pose) -> tuple[Vec3, Pose, Colour]:
    x, y, z = (edge / 1000 for edge in box.size_mm)
    return (x, y, z), pose, carton(box.id)


def _cube(number: int, cube: _Cube, stamp: object) -> Marker:
    msg = Marker(
        ns=cube.namespace, id=number, type=Marker.CUBE, action=Marker.ADD, frame_locked=True
    )
    msg.header.frame_id, msg.header.stamp = cube.frame, stamp
    where, turn = msg.pose.position, msg.pose.orientation
    where.x, where.y, where.z = cube.pose.position
    turn.x, turn.y, turn.z, turn.w = cube.pose.quaternion
    msg.scale.x, msg.scale.y, msg.scale.z = cube.size
    msg.color.r, msg.color.g, msg.color.b, msg.color.a = cube.colour
    return msg
